// Key files on Windows. Who may read or change a file there is in its access control list, which is not checked.
#include "adapters/wire/access/key_files.hpp"

#include <lbea/lbea.hpp>

#include <fstream>

namespace lbea::wire {
std::string read_key_file(const std::filesystem::path& file, bool is_secret) {
  std::ifstream in(file, std::ios::binary);
  if (!in)
    throw Error{Status::file_not_found,
                file.string() + ": cannot read this key file; check its path, or make one with lbea-keygen"};
  std::string text(max_key_file_bytes + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (in.bad() || text.size() > max_key_file_bytes)
    refuse_key_file(file, "is not a key file; make one with lbea-keygen");
  check_key_text(file, text, is_secret);
  return text;
}
}  // namespace lbea::wire
