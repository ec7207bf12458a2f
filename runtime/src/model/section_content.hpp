// The one pass over a section's bytes, compiled for speed.
#pragma once

#include "runtime/src/model/model_format.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

namespace lbea {
/// Facts about a section's elements, collected while its checksum is computed, so that its bytes are read once.
struct SectionContent {
  bool is_measured = true;     // f32 and f64: all finite, none beyond format::largest_measure
  std::uint32_t greatest = 0;  // u32
  std::uint64_t checksum = 0;
};

/// Called with bytes that were checked and are not needed for matching.
using Release = std::function<void(std::span<const std::byte>)>;

/// release: may be empty.
[[nodiscard]] SectionContent content_of(std::span<const std::byte> section, format::ElementType type,
                                        const Release& release);
[[nodiscard]] std::uint64_t checksum_of(std::span<const std::byte> bytes) noexcept;
}  // namespace lbea
