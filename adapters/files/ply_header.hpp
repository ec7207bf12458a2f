// The header of a PLY file: its elements in order, and the properties of each.
#pragma once

#include "adapters/files/binary_numbers.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::io::ply {
enum class Format { ascii, little_endian, big_endian };
using binary::Scalar;

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::optional<Scalar> count_type;  // of a list: the type of its length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;  // rows, as declared; not yet checked against the file's size
  std::vector<Property> properties;
};

struct Header {
  Format format = Format::ascii;
  std::vector<Element> elements;
  std::optional<std::int64_t> stamp_ns;
  std::size_t bytes = 0;  // length of the header
  std::size_t lines = 0;
};

/// Throws Error{bad_input | unsupported_input} with the line.
[[nodiscard]] Header parse_header(std::string_view text, const std::string& name);
}  // namespace lbea::io::ply
