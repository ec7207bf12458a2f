// The values in a DataArray of a VTK XML file: text, base64, or raw bytes after the XML, with or without compression.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "adapters/files/binary_numbers.hpp"

namespace lbea::io::grid {
enum class Compressor { none, zlib, lz4 };

/// How a file stores its binary blocks.
struct XmlStorage {
  bool is_big_endian = false;
  std::size_t header_bytes = 4;  // of each count in a block's header
  Compressor compressor = Compressor::none;
  std::string_view appended;     // the bytes after the XML
  bool is_appended_raw = false;  // else base64
};

/// "Float32" and so on; nothing for types without numbers.
[[nodiscard]] std::optional<binary::Scalar> xml_type(std::string_view name);

/// `count` values. `what` begins the sentence of an Error{bad_input}.
[[nodiscard]] std::vector<double> text_values(std::string_view text, std::uint64_t count, const std::string& what);
[[nodiscard]] std::vector<double> block_values(std::string_view block, bool is_raw, const XmlStorage& storage,
                                               binary::Scalar type, std::uint64_t count, const std::string& what);
}  // namespace lbea::io::grid
