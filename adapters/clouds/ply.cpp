#include "adapters/clouds/ply_rows.hpp"
#include "adapters/clouds/pointcloud.hpp"
#include "adapters/files/atomic_file.hpp"

#include <algorithm>
#include <array>

namespace lbea::io {

namespace clouds {

std::size_t axis_of(const ply::Property& property) noexcept {
  if (property.count_type || property.name.size() != 1) return no_axis;
  const char letter = property.name[0];
  return letter >= 'x' && letter <= 'z' ? static_cast<std::size_t>(letter - 'x') : no_axis;
}

namespace {

void check_axes(const ply::Header& header, const std::string& name) {
  const auto vertex = std::find_if(header.elements.begin(), header.elements.end(),
                                   [](const ply::Element& element) { return element.name == "vertex"; });
  if (vertex == header.elements.end())
    throw Error(Status::bad_input, name + ": no element \"vertex\", so no points; export the cloud with its vertices");
  std::array<int, 4> found{};
  for (const ply::Property& property : vertex->properties) ++found[axis_of(property)];
  if (found[0] != 1 || found[1] != 1 || found[2] != 1)
    throw Error(Status::bad_input, name + ": the element \"vertex\" needs the properties x, y and z, each once");
}

}  // namespace
}  // namespace clouds

PointCloud parse_ply(std::span<const std::byte> bytes, const std::string& name) {
  const ply::Header header = ply::parse_header(as_text(bytes), name);
  clouds::check_axes(header, name);
  PointCloud cloud;
  cloud.points = header.format == ply::Format::ascii ? clouds::read_ascii_points(bytes, header, name)
                                                     : clouds::read_binary_points(bytes, header, name);
  cloud.stamp_ns = header.stamp_ns;
  cloud.source = name;
  return cloud;
}

}  // namespace lbea::io
