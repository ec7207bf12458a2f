#include "adapters/files/stl_corners.hpp"

#include "adapters/files/binary_numbers.hpp"
#include "adapters/files/text_line.hpp"

#include <lbea/lbea.hpp>

#include <cmath>

namespace lbea::io::stl {
namespace {
constexpr std::size_t head_bytes = 84, triangle_bytes = 50, normal_bytes = 12;
constexpr double least_float = 1.17549435e-38;  // below, floats are denormal

std::uint64_t announced(std::string_view bytes) noexcept {
  return binary::load_bits(reinterpret_cast<const std::byte*>(bytes.data()) + 80, 4, false);
}

std::vector<float> binary_corners(std::string_view bytes) {
  std::vector<float> corners;
  corners.reserve(announced(bytes) * 9);
  for (std::size_t triangle = head_bytes; triangle + triangle_bytes <= bytes.size(); triangle += triangle_bytes)
    for (std::size_t i = 0; i < 9; ++i)
      corners.push_back(static_cast<float>(
          binary::load(reinterpret_cast<const std::byte*>(bytes.data()) + triangle + normal_bytes + 4 * i,
                       binary::Scalar::float32, false)));
  return corners;
}

std::vector<float> text_corners(std::string_view bytes, const std::string& name) {
  text::LineReader lines(bytes, name, "STL");
  std::vector<float> corners;
  std::size_t in_facet = 0;
  for (std::string_view line; lines.next(line);) {
    const std::string_view keyword = text::next_word(line);
    if (keyword == "vertex") {
      for (int axis = 0; axis < 3; ++axis) {
        corners.push_back(0);
        if (!text::parse_number(text::next_word(line), corners.back())) lines.fail("a vertex needs three numbers");
      }
      ++in_facet;
    } else if (keyword == "endfacet") {
      if (in_facet != 3) lines.fail("a facet needs three vertices");
      in_facet = 0;
    }
  }
  if (in_facet != 0) lines.fail("the file ends within a facet; it is cut short");
  return corners;
}
}  // namespace

// Another binary file may have a matching number there by chance. Its next words are then usually small integers, which
// read as floats are denormal, so they are not coordinates.
bool is_binary(std::string_view start, std::uint64_t file_bytes) noexcept {
  if (start.size() < head_bytes || file_bytes != head_bytes + announced(start) * triangle_bytes) return false;
  if (start.size() < head_bytes + triangle_bytes) return true;
  for (std::size_t i = 0; i < 12; ++i) {
    const double value = binary::load(reinterpret_cast<const std::byte*>(start.data()) + head_bytes + 4 * i,
                                      binary::Scalar::float32, false);
    if (!std::isfinite(value) || (value != 0 && std::abs(value) < least_float)) return false;
  }
  return true;
}

bool is_text(std::string_view start) noexcept {
  text::LineReader lines(start);
  std::string_view line;
  return lines.next(line) && text::next_word(line) == "solid" && start.find("facet") != std::string_view::npos;
}

std::vector<float> corners(std::string_view bytes, const std::string& name) {
  if (is_binary(bytes, bytes.size())) return binary_corners(bytes);
  if (is_text(bytes)) return text_corners(bytes, name);
  throw Error{Status::bad_input, name +
                                     ", byte 80: is neither binary STL (its number of triangles does not match its "
                                     "size) nor text; the file is damaged or cut short"};
}
}  // namespace lbea::io::stl
