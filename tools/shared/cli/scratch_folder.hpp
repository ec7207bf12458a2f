// A folder of this process alone, gone with it.
#pragma once

#include <filesystem>

namespace lbea::tool {

class ScratchFolder {
 public:
  /// In `parent`, which is made where it is missing. Throws Error{write_failed} when nothing can be made there.
  explicit ScratchFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path());
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace lbea::tool
