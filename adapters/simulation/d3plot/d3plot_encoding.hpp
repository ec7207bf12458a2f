// Word size and byte order of a d3plot database, told from two control words whose values are known.
#pragma once

#include <cstdint>
#include <optional>

#include "adapters/simulation/d3plot/d3plot_words.hpp"

namespace lbea::io::d3plot {

inline constexpr std::uint64_t base_words = 64;  // every database begins with that many control words
inline constexpr std::uint64_t file_type_word = 11, dimensions_word = 15;
inline constexpr std::int64_t type_d3plot = 1, type_d3part = 5, type_d3eigv = 11;
inline constexpr std::int64_t wide_ids = 1000;  // added to the file type when ids take 8 bytes

struct Encoding {
  std::uint64_t word_bytes;
  bool is_big_endian;
};

/// Nothing when the file does not begin like the first file of a d3plot database.
[[nodiscard]] std::optional<Encoding> detect_encoding(const WordFile& file);

}  // namespace lbea::io::d3plot
