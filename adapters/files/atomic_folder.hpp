// A folder of files that appears under its name only when it is complete.
#pragma once

#include <filesystem>

namespace lbea::io {

/// Refuses a name that exists, or that no folder can have. Throws Error{write_failed}.
void require_new_folder(const std::filesystem::path& path);

/// Files go to path(), in a temporary folder beside the final one; commit() renames it. Without commit() the destructor
/// removes it.
class AtomicFolder {
 public:
  /// Creates the temporary folder. Throws Error{write_failed}, also when a file or folder of that name exists.
  explicit AtomicFolder(std::filesystem::path final_path);
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
  /// Throws Error{write_failed}; the folder then does not exist under its name.
  void commit();

 private:
  std::filesystem::path final_path_, temporary_, path_;
};

}  // namespace lbea::io
