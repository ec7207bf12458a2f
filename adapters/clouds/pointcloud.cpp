#include "adapters/clouds/pointcloud.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/stl_corners.hpp"

#include <algorithm>
#include <array>

namespace lbea::io {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::size_t looked_at = 4096;

struct CloudFormat {
  const char* name;
  const char* what;
  bool (*is_it)(std::string_view start, std::size_t bytes);
  PointCloud (*parse)(Bytes bytes, const std::string& name);
};

bool is_ply(std::string_view start, std::size_t) {
  return start == "ply" || start.starts_with("ply\n") || start.starts_with("ply\r") ||
         start.starts_with("ply ");  // or cut there
}

bool is_pcd(std::string_view start, std::size_t) {
  return start.starts_with("# .PCD") || start.starts_with("VERSION 0.7") || start.starts_with("VERSION .7");
}

bool is_stl(std::string_view start, std::size_t bytes) { return stl::is_binary(start, bytes) || stl::is_text(start); }

bool is_text(std::string_view start, std::size_t) { return start.find('\0') == std::string_view::npos; }

/// In the order in which they are tried.
constexpr std::array formats{
    CloudFormat{"PLY", "text or binary: the vertices", is_ply, parse_ply},
    CloudFormat{"PCD", "text, binary or packed; of organised clouds the pixels that hold a point", is_pcd, parse_pcd},
    CloudFormat{"STL", "text or binary: the corners, each once", is_stl, parse_stl_cloud},
    CloudFormat{"XYZ", "text, a point per line (.xyz, .txt, .csv, .asc)", is_text, parse_xyz}};

}  // namespace

PointCloud parse_point_cloud(Bytes bytes, const std::string& name) {
  const std::string_view start = as_text(bytes).substr(0, looked_at);
  for (const CloudFormat& format : formats)
    if (format.is_it(start, bytes.size())) return format.parse(bytes, name);
  throw Error(Status::unsupported_input, name +
                                             " is a binary file of unknown kind; expected PLY, PCD, STL or text with "
                                             "columns x y z: convert it to PLY");
}

PointCloud read_point_cloud(const std::filesystem::path& path) {
  return parse_point_cloud(read_file(path), path.string());
}

std::string list_cloud_formats() {
  std::string list = "Point clouds, told by content:\n";
  for (const CloudFormat& format : formats) list += "  " + std::string(format.name) + "  " + format.what + "\n";
  return list +
         "Stamps: stamps.csv beside the clouds or --stamps, else in the file, else in its name (cloud_12.5ms.ply)\n";
}

}  // namespace lbea::io
