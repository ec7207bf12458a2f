// A temporary folder of this process.
#pragma once

#include <lbea/lbea.hpp>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace lbea::tool {

class ScratchFolder {
 public:
  /// Creates it in `parent`, and `parent` if necessary. Throws Error{write_failed}.
  explicit ScratchFolder(const std::filesystem::path& parent = std::filesystem::temp_directory_path()) {
    std::error_code error;
    std::filesystem::create_directories(parent, error);
    std::string name = (parent / ".lbea-XXXXXX").string();
    if (error || ::mkdtemp(name.data()) == nullptr)
      throw Error(Status::write_failed, parent.string() + ": cannot create a folder in it; choose another one");
    path_ = name;
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
