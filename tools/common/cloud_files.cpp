#include "tools/common/cloud_files.hpp"

#include "adapters/pointcloud/stamps.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>
#include <string_view>

namespace lbea {

namespace {

namespace fs = std::filesystem;

bool is_cloud(const fs::path& file) {
  constexpr std::array<std::string_view, 3> extensions{".ply", ".pcd", ".stl"};
  return std::find(extensions.begin(), extensions.end(), file.extension().string()) != extensions.end();
}

// Text tables in a folder of such clouds say something about them; in a folder without any they are the clouds.
bool is_text_cloud(const fs::path& file) {
  constexpr std::array<std::string_view, 4> extensions{".xyz", ".txt", ".csv", ".asc"};
  return std::find(extensions.begin(), extensions.end(), file.extension().string()) != extensions.end();
}

void append_folder(const fs::path& folder, std::vector<fs::path>& files) {
  std::vector<fs::path> found, texts;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    if (is_cloud(entry.path())) found.push_back(entry.path());
    if (is_text_cloud(entry.path()) && entry.path().filename() != stamp_table_name) texts.push_back(entry.path());
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
    if (fs::is_directory(path)) {
      append_folder(path, files);
    } else if (fs::exists(path)) {
      files.emplace_back(path);
    } else {
      throw Error{Status::file_not_found, path + ": no such file or folder; check the path"};
    }
  }
  return files;
}

}  // namespace lbea
