#include "adapters/pointcloud/pointcloud.hpp"

#include "adapters/file/atomic_file.hpp"

namespace lbea {

namespace {

constexpr std::size_t looked_at = 4096;

bool is_ply(std::string_view text) {
  return text.starts_with("ply") && text.size() > 3 && (text[3] == '\n' || text[3] == '\r' || text[3] == ' ');
}

bool is_text(std::string_view text) { return text.substr(0, looked_at).find('\0') == std::string_view::npos; }

[[noreturn]] void refuse(const std::string& name, const std::string& what) {
  throw Error(Status::unsupported_input,
              name + " " + what + "; expected PLY or text with columns x y z: convert it to PLY");
}

}  // namespace

PointCloud parse_point_cloud(std::span<const std::byte> bytes, const std::string& name) {
  const std::string_view text = as_text(bytes);
  if (is_ply(text)) return parse_ply(bytes, name);
  if (text.starts_with("# .PCD") || text.starts_with("VERSION .7")) refuse(name, "is a PCD file");
  if (!is_text(text)) refuse(name, "is a binary file of unknown kind");
  return parse_xyz(bytes, name);
}

PointCloud read_point_cloud(const std::filesystem::path& path) {
  return parse_point_cloud(read_file(path), path.string());
}

}  // namespace lbea
