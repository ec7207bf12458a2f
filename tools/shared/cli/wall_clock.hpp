// The clock of all stamps and recordings.
#pragma once

#include <chrono>
#include <cstdint>

namespace lbea::tool {

/// ns since 1970.
[[nodiscard]] inline std::int64_t wall_clock_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace lbea::tool
