#include "adapters/ensemble/ensemble_toml.hpp"
#include "adapters/files/atomic_file.hpp"

#include <algorithm>
#include <charconv>

namespace lbea::io {
namespace {

constexpr std::string_view between = " \t\r,;";

/// Takes the ids of one line.
void take_ids(std::string_view line, std::vector<std::uint32_t>& ids, const std::string& where) {
  line = line.substr(0, line.find('#'));
  for (std::size_t at = line.find_first_not_of(between); at != std::string_view::npos;
       at = line.find_first_not_of(between, at)) {
    const std::size_t end = std::min(line.find_first_of(between, at), line.size());
    const std::string_view word = line.substr(at, end - at);
    std::uint32_t id = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), id);
    if (error != std::errc{} || stop != word.data() + word.size())
      throw Error(Status::bad_input, where + ": \"" + std::string(word.substr(0, 40)) +
                                         "\" is not a node id, a whole number from 0 to 4294967295");
    ids.push_back(id);
    at = end;
  }
}

}  // namespace

std::vector<std::uint32_t> read_node_ids(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  std::string_view text = as_text(bytes);
  std::vector<std::uint32_t> ids;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = text.substr(0, text.find('\n'));
    take_ids(line, ids, path.string() + ", line " + std::to_string(number));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
  }
  if (ids.empty()) throw Error(Status::bad_input, path.string() + ": no node ids");
  return ids;
}

}  // namespace lbea::io
