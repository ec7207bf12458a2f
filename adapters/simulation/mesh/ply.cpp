#include "adapters/files/ply_header.hpp"
#include "adapters/files/text_line.hpp"
#include "adapters/simulation/grid/grid.hpp"

namespace lbea::io::grid {
namespace {
class PlyMeshParser {
 public:
  PlyMeshParser(std::string_view bytes, const std::string& name)
      : bytes_(bytes), name_(name), header_(ply::parse_header(bytes, name)), at_(header_.bytes) {}

  Grid parse() {
    for (const ply::Element& element : header_.elements) {
      if (element.name == "vertex")
        read_vertices(element);
      else if (element.name == "face")
        read_faces(element);
      else
        skip(element);
    }
    return std::move(grid_);
  }

 private:
  void read_vertices(const ply::Element& element) {
    check_count(element);
    std::vector<std::size_t> axis(element.properties.size(), 3);
    int found = 0;
    for (std::size_t p = 0; p < element.properties.size(); ++p) {
      const ply::Property& property = element.properties[p];
      if (property.count_type) fail("lists at vertices are not read", Status::unsupported_input);
      if (property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z') {
        axis[p] = static_cast<std::size_t>(property.name[0] - 'x');
        found |= 1 << axis[p];
      } else {
        grid_.point_arrays.push_back({property.name, 1, {}});
      }
    }
    if (found != 7) fail("the element \"vertex\" needs the properties x, y and z");
    for (std::uint64_t row = 0; row < element.count; ++row) {
      grid_.positions.resize(grid_.positions.size() + 3);
      std::size_t array = 0;
      for (std::size_t p = 0; p < axis.size(); ++p) {
        const double value = next(element.properties[p].type);
        if (axis[p] < 3)
          grid_.positions[3 * row + axis[p]] = static_cast<float>(value);
        else
          grid_.point_arrays[array++].values.push_back(value);
      }
    }
  }

  void read_faces(const ply::Element& element) {
    check_count(element);
    std::vector<std::uint32_t> corners;
    for (std::uint64_t row = 0; row < element.count; ++row)
      for (const ply::Property& property : element.properties) {
        if (!property.count_type) {
          static_cast<void>(next(property.type));
          continue;
        }
        const bool is_corners = property.name == "vertex_indices" || property.name == "vertex_index";
        corners.clear();
        for (double left = next(*property.count_type); left > 0; --left) {
          const double value = next(property.type);
          if (!is_corners) continue;
          if (!(value >= 0 && value < 4294967295.0)) fail("a face names a vertex that does not exist");
          corners.push_back(static_cast<std::uint32_t>(value));
        }
        if (!is_corners) continue;
        if (corners.size() < 3) fail("a face has fewer than three vertices");
        grid_.cells.add(corners.size() == 3 ? CellKind::triangle : CellKind::polygon, corners);
      }
  }

  void skip(const ply::Element& element) {
    check_count(element);
    for (std::uint64_t row = 0; row < element.count; ++row)
      for (const ply::Property& property : element.properties)
        for (double left = property.count_type ? next(*property.count_type) : 1; left > 0; --left)
          static_cast<void>(next(property.type));
  }

  /// Every row takes at least two bytes in text, and a byte per property in binary.
  void check_count(const ply::Element& element) {
    if (element.properties.empty()) fail("the element \"" + element.name + "\" has no properties");
    if (element.count > bytes_.size() - at_)
      fail("element \"" + element.name + "\" declares " + std::to_string(element.count) +
           " rows, more than the file holds; it is cut short");
  }

  double next(ply::Scalar type) {
    if (header_.format == ply::Format::ascii) return next_in_text();
    const std::size_t size = binary::size_of(type);
    if (size > bytes_.size() - at_) fail("the file ends within a row; it is cut short");
    at_ += size;
    return binary::load(reinterpret_cast<const std::byte*>(bytes_.data() + at_ - size), type,
                        header_.format == ply::Format::big_endian);
  }

  double next_in_text() {
    std::string_view rest = bytes_.substr(at_);
    double value = 0;
    const bool is_number = text::next_real(rest, value);
    at_ = bytes_.size() - rest.size();
    if (!is_number) fail(rest.empty() ? "the file is cut short" : "expected a number");
    return value;
  }

  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const {
    throw Error{status, name_ + ", byte " + std::to_string(at_) + ": " + what + " (PLY)"};
  }

  std::string_view bytes_;
  const std::string& name_;
  ply::Header header_;
  std::size_t at_;
  Grid grid_;
};
}  // namespace

bool is_ply(std::string_view start) noexcept {
  return start.starts_with("ply") && start.size() > 3 && (start[3] == '\n' || start[3] == '\r' || start[3] == ' ');
}

/// The elements "vertex" and "face", text or binary. Other values of vertices become arrays.
Grid parse_ply(std::string_view bytes, const std::string& name) { return PlyMeshParser(bytes, name).parse(); }
}  // namespace lbea::io::grid
