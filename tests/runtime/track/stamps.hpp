// Times and shapes of the frames of a test.
#pragma once

#include "runtime/src/depth/shape_history.hpp"

#include <cstdint>

namespace lbea::test {

inline constexpr std::int64_t millisecond = 1'000'000;  // in nanoseconds

/// Without similar samples.
inline EarlierShape shape_at(std::int64_t stamp_ns, float error = 0) { return {stamp_ns, error, {}}; }

}  // namespace lbea::test
