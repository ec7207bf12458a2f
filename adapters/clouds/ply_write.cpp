#include "adapters/clouds/pointcloud.hpp"
#include "adapters/files/atomic_file.hpp"

#include <bit>

namespace lbea::io {

static_assert(std::endian::native == std::endian::little && sizeof(Point) == 12, "points are written as they lie");

void write_ply(const std::filesystem::path& path, std::span<const Point> points,
               std::span<const std::string> comments) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) {
    if (comment.find_first_of("\r\n") != std::string::npos)
      throw Error(Status::bad_config, "a comment for " + path.string() + " has a line break: give it as two comments");
    header += "comment " + comment + "\n";
  }
  header += "element vertex " + std::to_string(points.size()) +
            "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  AtomicFile file(path);
  file.write(header);
  file.write(std::as_bytes(points));
  file.commit();
}

}  // namespace lbea::io
