// Durations as results carry them: ns in 32 bits, more than 4.29 s is 4.29 s.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <limits>

namespace lbea::tool {

[[nodiscard]] inline std::uint32_t short_ns(std::int64_t ns) noexcept {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(ns, 0, std::numeric_limits<std::uint32_t>::max()));
}

[[nodiscard]] inline std::uint32_t since_ns(std::chrono::steady_clock::time_point begin) noexcept {
  return short_ns((std::chrono::steady_clock::now() - begin) / std::chrono::nanoseconds(1));
}

}  // namespace lbea::tool
