// Lists folders, and removes temporary files and work folders that killed bakes leave beside a model.
#pragma once

#include <cerrno>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <dirent.h>

namespace lbea::bake {
/// Names in `folder`, unordered, without "." and ".."; empty, and `error` set, when it cannot be read. The standard
/// library's directory iterators terminate the program when memory runs out (GCC 12), which would leave temporary files
/// behind.
[[nodiscard]] inline std::vector<std::string> names_in(const std::filesystem::path& folder, std::error_code& error) {
  struct Close {
    void operator()(DIR* open) const noexcept { ::closedir(open); }
  };
  error.clear();
  std::vector<std::string> names;
  const std::unique_ptr<DIR, Close> open(::opendir(folder.c_str()));
  if (open == nullptr && errno == ENOMEM) throw std::bad_alloc();
  if (open == nullptr) error.assign(errno, std::generic_category());
  while (const dirent* const entry = open == nullptr ? nullptr : ::readdir(open.get()))
    if (const std::string_view name = entry->d_name; name != "." && name != "..") names.emplace_back(name);
  return names;
}

/// `kind`PID-`number`, appended to the final name of a file or folder.
[[nodiscard]] std::string temporary_suffix(const char* kind, int number);
inline constexpr const char* temporary_file = ".tmp-";
inline constexpr const char* temporary_folder = ".tmp-work-";

/// Takes the lock that marks a temporary file or folder as in use; the system releases it when the process ends.
/// False where the file system has no locks.
bool lock_file(int descriptor) noexcept;

/// Creates and locks `file` + temporary_suffix() + `ending` under the next free number, and sets `temporary` to its
/// path. The descriptor, for reading and writing; -1: errno tells why.
[[nodiscard]] int create_temporary(const std::filesystem::path& file, const std::string& ending,
                                   std::filesystem::path& temporary);
/// Flushes the folder entry of `file`; returns 0 or an error number. A folder that is writable but not readable cannot
/// be flushed; that is no error.
int flush_folder_of(const std::filesystem::path& file);

/// Whether no process holds the lock of `path`; not set when that is unknown.
[[nodiscard]] std::optional<bool> is_abandoned(const std::filesystem::path& path) noexcept;
/// Whether this machine has a process of this number.
[[nodiscard]] bool is_alive(int process) noexcept;

/// Removes `path` and its content. Allocates no memory, so that it works when memory has run out.
void remove_all_of(const std::filesystem::path& path) noexcept;

/// Removes the temporary files and folders of killed bakes of `model`: no process here has their number, and no process
/// on any machine holds their lock. In case of doubt they stay.
void remove_stale_files(const std::filesystem::path& model);
}  // namespace lbea::bake
