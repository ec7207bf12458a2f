// The header of a PLY file: which elements follow, in which order, made of which properties.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::io::ply {

enum class Format { ascii, little_endian, big_endian };
enum class Scalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

[[nodiscard]] std::size_t size_of(Scalar type) noexcept;  // bytes

/// An unsigned number of `size` bytes at `at`.
[[nodiscard]] std::uint64_t load_bits(const std::byte* at, std::size_t size, bool is_big_endian) noexcept;
/// A value of this type at `at`.
[[nodiscard]] double load(const std::byte* at, Scalar type, bool is_big_endian) noexcept;

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::optional<Scalar> count_type;  // of a list: an integer that says how many values follow
};

struct Element {
  std::string name;
  std::uint64_t count = 0;  // rows, as declared: not yet held against the file's size
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
