// Folders of test files: small files in the repository, large files beside it, temporary folders.
#pragma once

#include <filesystem>
#include <random>
#include <string>

namespace lbea::test {

inline std::filesystem::path data() { return LBEA_TEST_DATA; }
inline std::filesystem::path reference_data() { return LBEA_REFERENCE_DATA; }
bool& needs_reference_data();  // true in executables that are skipped without this data

/// A new folder that is removed with its content at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::random_device random;
    do path_ = std::filesystem::temp_directory_path() / ("lbea-test-" + std::to_string(random()));
    while (!std::filesystem::create_directory(path_));
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace lbea::test
