// A file opened for reading on Windows, closed at the end.
#pragma once

#include <filesystem>

namespace lbea {
class WindowsFile {
 public:
  /// Others may read or rename the file, not write to it. Throws Error{file_not_found | not_a_model}.
  explicit WindowsFile(const std::filesystem::path& file);
  ~WindowsFile();
  WindowsFile(const WindowsFile&) = delete;
  WindowsFile& operator=(const WindowsFile&) = delete;
  [[nodiscard]] void* handle() const noexcept { return handle_; }

 private:
  void* handle_;
};
}  // namespace lbea
