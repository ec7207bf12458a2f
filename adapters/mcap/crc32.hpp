// CRC-32 as in zlib and MCAP.
#pragma once

#include "adapters/mcap/byte_cursor.hpp"

namespace lbea::mcap {

/// Of `bytes` after what gave `before`.
[[nodiscard]] std::uint32_t crc32(Bytes bytes, std::uint32_t before = 0) noexcept;
/// Of one piece and what follows it, from the checksums of each.
[[nodiscard]] std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second,
                                         std::uint64_t second_bytes) noexcept;

}  // namespace lbea::mcap
