// The formats of point clouds. To add one:
// 1. Write NAME.cpp in this folder with is_NAME(), which recognizes the start of a file, and parse_NAME().
// 2. Declare both below and add a row to the table; formats are tried in its order.
// 3. Add a test to tests/clouds (and its CMakeLists.txt), a file to tests/data/fuzz/cloud, and a row to the table in
// docs/at-the-rig.md.
#include "adapters/clouds/point_cloud.hpp"

#include "adapters/files/atomic_file.hpp"

namespace lbea::io {
/// Whether a file of `bytes` bytes that begins with `start` has the format.
using IsCloudFormat = bool(std::string_view start, std::size_t bytes) noexcept;
IsCloudFormat is_ply, is_pcd, is_stl, is_xyz;
ParseCloud parse_ply, parse_pcd, parse_stl, parse_xyz;

namespace {
constexpr std::size_t start_bytes = 4096;

struct CloudFormat {
  const char* name;
  std::string_view extensions;  // in folders, files with these are clouds
  const char* text;             // for --list-formats
  IsCloudFormat* is_format;
  ParseCloud* parse;
};

constexpr std::array formats{
    CloudFormat{"PLY", ".ply", "text or binary: the vertices", is_ply, parse_ply},
    CloudFormat{"PCD", ".pcd", "text, binary or compressed; of organized clouds the pixels that hold a point", is_pcd,
                parse_pcd},
    CloudFormat{"STL", ".stl", "text or binary: the corners, each once", is_stl, parse_stl},
    CloudFormat{"XYZ", ".xyz .txt .csv .asc", "text, a point per line", is_xyz, parse_xyz}};

/// Whether the extension is one of the format's.
bool is_named_so(const CloudFormat& format, const std::string& extension) {
  return !extension.empty() &&
         (" " + std::string(format.extensions) + " ").find(" " + extension + " ") != std::string::npos;
}
}  // namespace

CloudName cloud_name(const std::filesystem::path& file) {
  for (const CloudFormat& format : formats)
    if (is_named_so(format, file.extension().string()))
      return format.parse == parse_xyz ? CloudName::text : CloudName::cloud;
  return CloudName::none;
}

std::string cloud_extensions() {
  std::string all;
  for (const CloudFormat& format : formats) all += (all.empty() ? "" : " ") + std::string(format.extensions);
  return all;
}

PointCloud parse_point_cloud(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view start = as_text(bytes).substr(0, start_bytes);
  for (const CloudFormat& format : formats)
    if (format.is_format(start, bytes.size())) return format.parse(bytes, name);
  std::string names;
  for (const CloudFormat& format : formats) names += (names.empty() ? "" : ", ") + std::string(format.name);
  throw Error(Status::unsupported_input,
              name + " is a binary file of unknown kind; expected " + names + ": convert it to PLY");
}

PointCloud read_point_cloud(const std::filesystem::path& path, const std::string& columns) {
  const auto bytes = read_file(path);
  return columns.empty() ? parse_point_cloud(bytes, path.string()) : parse_text_cloud(bytes, path.string(), columns);
}

std::string list_cloud_formats() {
  std::string list = "Point clouds, recognized by content:\n";
  for (const CloudFormat& format : formats)
    list += "  " + std::string(format.name) + "  " + format.text + " (" + std::string(format.extensions) + ")\n";
  return list +
         "Stamps: stamps.csv beside the clouds or --stamps, else in the file, else in its name (cloud_12.5ms.ply)\n";
}
}  // namespace lbea::io
