#include "tools/shared/cli/cloud_files.hpp"

#include "adapters/clouds/stamps.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>
#include <string_view>

namespace lbea::tool {
namespace {

namespace fs = std::filesystem;

bool is_cloud(const fs::path& file) {
  constexpr std::array<std::string_view, 3> extensions{".ply", ".pcd", ".stl"};
  return std::find(extensions.begin(), extensions.end(), file.extension().string()) != extensions.end();
}

// In a folder with such clouds, text files are tables about them; in other folders, text files are clouds.
bool is_text_cloud(const fs::path& file) {
  constexpr std::array<std::string_view, 4> extensions{".xyz", ".txt", ".csv", ".asc"};
  return std::find(extensions.begin(), extensions.end(), file.extension().string()) != extensions.end();
}

void append_folder(const fs::path& folder, std::vector<fs::path>& files) {
  std::vector<fs::path> found, texts;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const bool is_named_so = is_cloud(entry.path()) || is_text_cloud(entry.path());
    std::error_code error;
    const bool is_file = entry.is_regular_file(error);
    if (is_named_so && (error || !entry.exists(error)))
      throw Error{Status::file_not_found, entry.path().string() + ": a broken symbolic link; correct or remove it"};
    if (!is_file) continue;
    if (is_cloud(entry.path())) found.push_back(entry.path());
    if (is_text_cloud(entry.path()) && entry.path().filename() != io::stamp_table_name) texts.push_back(entry.path());
  }
  if (found.empty()) found = std::move(texts);
  if (found.empty())
    throw Error{Status::file_not_found,
                folder.string() + ": no clouds in this folder (.ply .pcd .stl .xyz .txt .csv .asc); give another one"};
  std::sort(found.begin(), found.end());
  files.insert(files.end(), found.begin(), found.end());
}

}  // namespace

std::vector<fs::path> find_clouds(const std::vector<std::string>& paths) {
  std::vector<fs::path> files;
  for (const std::string& path : paths) {
    std::error_code error;
    if (fs::is_directory(path, error)) {
      append_folder(path, files);
    } else if (fs::exists(path, error)) {
      files.emplace_back(path);
    } else {
      throw Error{Status::file_not_found, path + ": no such file or folder; check the path"};
    }
  }
  return files;
}

}  // namespace lbea::tool
