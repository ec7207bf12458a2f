#include "adapters/wire/access/key_files.hpp"

#include "runtime/src/model/descriptor.hpp"

#include <lbea/lbea.hpp>

#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>

namespace lbea::wire {
namespace {
/// Write permission on a public key file decides who may connect.
void check_rights(const std::filesystem::path& file, const struct stat& found, bool is_secret) {
  if (is_secret && (found.st_mode & 077) != 0)
    refuse_key_file(file, "others may read or change this secret key; make it yours alone: chmod 600 " + file.string());
  if (is_secret && found.st_uid != ::geteuid() && found.st_uid != 0)
    refuse_key_file(file, "this secret key belongs to another user; use one of your own");
  if (!is_secret && (found.st_mode & S_IWOTH) != 0)
    refuse_key_file(file,
                    "anybody may change these public keys, and with them who may connect; chmod o-w " + file.string());
}
}  // namespace

std::string read_key_file(const std::filesystem::path& file, bool is_secret) {
  const Descriptor open(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat found;
  if (open.value() < 0 || ::fstat(open.value(), &found) != 0)
    throw Error{Status::file_not_found, file.string() + ": cannot read this key file (" + std::strerror(errno) +
                                            "); check its path, or make one with lbea-keygen"};
  if (!S_ISREG(found.st_mode) || found.st_size < 0 || static_cast<std::size_t>(found.st_size) > max_key_file_bytes)
    refuse_key_file(file, "is not a key file; make one with lbea-keygen");
  std::string text(static_cast<std::size_t>(found.st_size), '\0');
  const ssize_t got = ::read(open.value(), text.data(), text.size());
  if (got < 0) refuse_key_file(file, std::string("cannot be read (") + std::strerror(errno) + ")");
  text.resize(static_cast<std::size_t>(got));
  check_key_text(file, text, is_secret);
  check_rights(file, found, is_secret);
  return text;
}

void write_key_file(const std::filesystem::path& file, const std::string& text, bool is_secret) {
  const mode_t mode = is_secret ? 0600 : 0644;
  const Descriptor open(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode));
  if (open.value() < 0)
    throw Error{Status::write_failed,
                file.string() + ": " +
                    (errno == EEXIST ? "exists; keys are never overwritten, choose another name"
                                     : std::string("cannot be written (") + std::strerror(errno) + ")")};
  const ssize_t written = ::write(open.value(), text.data(), text.size());
  if (written == static_cast<ssize_t>(text.size()) && ::fsync(open.value()) == 0) return;
  ::unlink(file.c_str());
  throw Error{Status::write_failed, file.string() + ": cannot be written (" + std::strerror(errno) + ")"};
}
}  // namespace lbea::wire
