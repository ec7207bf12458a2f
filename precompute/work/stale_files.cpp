#include "precompute/work/stale_files.hpp"

#include <array>
#include <charconv>
#include <csignal>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace lbea::bake {
namespace {
namespace fs = std::filesystem;

void remove_below(int parent, const char* name) noexcept;

/// Whether anything was removed. Then there may be more: the directory is read while it changes.
bool empty_once(int folder) noexcept {
  bool has_removed = false;
  alignas(dirent64) std::array<char, 4096> buffer;
  ::lseek(folder, 0, SEEK_SET);
  for (ssize_t bytes; (bytes = ::getdents64(folder, buffer.data(), buffer.size())) > 0;)
    for (ssize_t at = 0; at < bytes;) {
      const auto* const entry = reinterpret_cast<const dirent64*>(buffer.data() + at);
      at += entry->d_reclen;
      if (std::strcmp(entry->d_name, ".") == 0 || std::strcmp(entry->d_name, "..") == 0) continue;
      remove_below(folder, entry->d_name);
      has_removed = has_removed || ::faccessat(folder, entry->d_name, F_OK, AT_SYMLINK_NOFOLLOW) != 0;
    }
  return has_removed;
}

void remove_below(int parent, const char* name) noexcept {
  if (::unlinkat(parent, name, 0) == 0) return;
  const int folder = ::openat(parent, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder < 0) return;
  while (empty_once(folder)) {}
  ::close(folder);
  ::unlinkat(parent, name, AT_REMOVEDIR);
}

/// The process in a name MODEL.tmp-PID-N or MODEL.tmp-work-PID-N.
std::optional<pid_t> process_in(std::string_view name, std::string_view model) {
  if (!name.starts_with(model)) return std::nullopt;
  name.remove_prefix(model.size());
  for (const std::string_view kind : {temporary_folder, temporary_file}) {
    if (!name.starts_with(kind)) continue;
    const std::string_view rest = name.substr(kind.size());
    const char* const end = rest.data() + rest.size();
    pid_t process = 0;
    unsigned number = 0;
    const auto pid = std::from_chars(rest.data(), end, process);
    if (pid.ec != std::errc{} || process <= 0 || pid.ptr == end || *pid.ptr != '-') continue;
    const auto last = std::from_chars(pid.ptr + 1, end, number);
    if (last.ec == std::errc{} && last.ptr == end) return process;
  }
  return std::nullopt;
}
}  // namespace

bool is_alive(int process) noexcept { return ::kill(process, 0) == 0 || errno != ESRCH; }

// The process may run on another machine that shares the folder.
std::optional<bool> is_abandoned(const fs::path& path) noexcept {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return std::nullopt;
  const bool is_free = lock_file(descriptor), is_held = !is_free && errno == EWOULDBLOCK;
  ::close(descriptor);
  return is_free || is_held ? std::optional(is_free) : std::nullopt;
}

std::string temporary_suffix(const char* kind, int number) {
  return kind + std::to_string(::getpid()) + "-" + std::to_string(number);
}

bool lock_file(int descriptor) noexcept { return ::flock(descriptor, LOCK_EX | LOCK_NB) == 0; }

int create_temporary(const fs::path& file, const std::string& ending, fs::path& temporary) {
  constexpr int names = 1000;
  for (int i = 0; i < names; ++i) {
    temporary = file;
    temporary += temporary_suffix(temporary_file, i) + ending;
    const int descriptor = ::open(temporary.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor >= 0) static_cast<void>(lock_file(descriptor));
    if (descriptor >= 0 || errno != EEXIST) return descriptor;
  }
  return -1;
}

int flush_folder_of(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return 0;
  const int error = ::fsync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  return error;
}

void remove_all_of(const fs::path& path) noexcept { remove_below(AT_FDCWD, path.c_str()); }

void remove_stale_files(const fs::path& model) {
  std::error_code error;
  const fs::path folder = model.has_parent_path() ? model.parent_path() : fs::path(".");
  const std::string name = model.filename().string();
  std::vector<fs::path> stale;
  for (const std::string& entry : names_in(folder, error)) {
    const auto process = process_in(entry, name);
    if (process && !is_alive(*process) && is_abandoned(folder / entry).value_or(false)) stale.push_back(folder / entry);
  }
  for (const fs::path& path : stale) remove_all_of(path);
}
}  // namespace lbea::bake
