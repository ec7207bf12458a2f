// A temporary folder of this process.
#pragma once

#include "adapters/files/system_files.hpp"

#include <lbea/lbea.hpp>

#include <filesystem>

namespace lbea::tool {

class ScratchFolder {
 public:
  /// Creates it in `parent`, and `parent` if necessary. Throws Error{write_failed}.
  explicit ScratchFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path()) {
    std::error_code error;
    std::filesystem::create_directories(parent, error);
    if (!error) path_ = io::system::create_temporary_folder(parent);
    if (path_.empty())
      throw Error(Status::write_failed, parent.string() + ": cannot create a folder in it; choose another one");
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace lbea::tool
