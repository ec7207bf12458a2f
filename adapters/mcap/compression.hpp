// The compressions of MCAP chunks: LZ4 frames and Zstandard.
#pragma once

#include "adapters/mcap/records.hpp"

namespace lbea::mcap {

enum class Compression : std::uint8_t { none, lz4, zstd };

/// The name in the file: "", "lz4" or "zstd".
[[nodiscard]] std::string_view name_of(Compression compression) noexcept;
/// Nothing for any other name.
[[nodiscard]] std::optional<Compression> compression_named(std::string_view name) noexcept;

/// Appends the compressed concatenation of `pieces`. Not for Compression::none. False when the library fails.
[[nodiscard]] bool compress(Compression compression, std::span<const Bytes> pieces, Buffer& out);

/// Replaces `out` with the decompressed `bytes`. False unless they are intact and decompress to exactly `size` bytes.
/// Memory is allocated as output is produced, because `size` is not trusted.
[[nodiscard]] bool decompress(Compression compression, Bytes bytes, std::uint64_t size, Buffer& out);

}  // namespace lbea::mcap
