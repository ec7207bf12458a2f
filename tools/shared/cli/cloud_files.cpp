#include "tools/shared/cli/cloud_files.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/file_names.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

namespace lbea::tool {
namespace {

namespace fs = std::filesystem;

// Beside clouds of other formats, text files are tables about them.
void append_folder(const fs::path& folder, std::vector<fs::path>& files) {
  std::vector<fs::path> found, texts;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const io::CloudName name = io::cloud_name(entry.path());
    std::error_code error;
    const bool is_file = entry.is_regular_file(error);
    if (name != io::CloudName::none && (error || !entry.exists(error)))
      throw Error{Status::file_not_found, entry.path().string() + ": a broken symbolic link; correct or remove it"};
    if (!is_file) continue;
    if (name == io::CloudName::cloud) found.push_back(entry.path());
    if (name == io::CloudName::text && entry.path().filename() != io::stamp_table_name) texts.push_back(entry.path());
  }
  if (found.empty()) found = std::move(texts);
  if (found.empty())
    throw Error{Status::file_not_found,
                folder.string() + ": no clouds in this folder (" + io::cloud_extensions() + "); give another one"};
  std::sort(found.begin(), found.end());
  files.insert(files.end(), found.begin(), found.end());
}

}  // namespace

std::vector<fs::path> find_clouds(const std::vector<std::string>& paths) {
  std::vector<fs::path> files;
  for (const std::string& name : paths) {
    const fs::path path = io::path_of(name);
    std::error_code error;
    if (fs::is_directory(path, error)) {
      append_folder(path, files);
    } else if (fs::exists(path, error)) {
      files.push_back(path);
    } else {
      throw Error{Status::file_not_found, name + ": no such file or folder; check the path"};
    }
  }
  return files;
}

void add_columns_option(CommandLine& app, std::string& columns) {
  app.add_option(
      "--columns", columns,
      "text clouds: names of the columns, e.g. X,Y,Z or, with displacements, X+U,Y+V,Z+W (default: x, y, z)");
}

}  // namespace lbea::tool
