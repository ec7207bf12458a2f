// The two compressions of MCAP chunks: LZ4 frames and Zstandard.
#pragma once

#include "adapters/mcap/mcap_records.hpp"

namespace lbea::mcap {

enum class Compression : std::uint8_t { none, lz4, zstd };

/// As chunks name it: "", "lz4" or "zstd".
[[nodiscard]] std::string_view name_of(Compression compression) noexcept;
/// Nothing for a name that is none of the three.
[[nodiscard]] std::optional<Compression> compression_named(std::string_view name) noexcept;

/// Appends the compressed concatenation of `pieces`, not for Compression::none. False when the library fails.
[[nodiscard]] bool compress(Compression compression, std::span<const Bytes> pieces, Buffer& out);

/// Replaces `out` by what `bytes` decompress to. False unless that is exactly `size` bytes and the data are
/// intact. Memory grows with what comes out, not with what `size` claims.
[[nodiscard]] bool decompress(Compression compression, Bytes bytes, std::uint64_t size, Buffer& out);

}  // namespace lbea::mcap
