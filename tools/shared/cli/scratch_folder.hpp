// A temporary folder of this process.
#pragma once

#include <filesystem>

namespace lbea::tool {

class ScratchFolder {
 public:
  /// Creates it in `parent`, and `parent` if necessary. Throws Error{write_failed}.
  explicit ScratchFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path());
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace lbea::tool
