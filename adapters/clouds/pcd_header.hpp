// The header of a PCD file: which values each point has, and how they are stored.
#pragma once

#include "adapters/files/ply_header.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::io::clouds {

enum class PcdStorage { text, binary, packed };

struct PcdField {
  std::string name;
  std::size_t size = 4;     // bytes of a value
  char type = 'F';          // I, U or F
  std::uint64_t count = 1;  // values per point
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::array<std::size_t, 3> axes{};  // fields of x, y, z
  std::uint64_t points = 0;           // as declared: not yet held against the file's size
  bool is_organised = false;          // an image of points: pixels without one have a place too
  PcdStorage storage = PcdStorage::text;
  std::optional<std::int64_t> stamp_ns;
  std::size_t bytes = 0, lines = 0;  // length of the header

  [[nodiscard]] std::uint64_t point_bytes() const noexcept;
};

/// The kind of value of a field, when it is one that coordinates may have.
[[nodiscard]] std::optional<ply::Scalar> scalar_of(const PcdField& field) noexcept;

/// Throws Error{bad_input | unsupported_input} with the line.
[[nodiscard]] PcdHeader parse_pcd_header(std::string_view text, const std::string& name);

}  // namespace lbea::io::clouds
