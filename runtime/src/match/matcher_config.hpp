// What the matcher decides before it looks at points: is the configuration sound, which reference, is a frame refused.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>

namespace lbea {

/// Throws Error{bad_config} with the name of the field, its value and what would be right.
void check(const MatcherConfig& config, const ModelView& model, const SensorViews& views);

/// Method step 2: the reference whose time is nearest to `since_trigger_s`; ties to the earlier one.
[[nodiscard]] std::uint32_t reference_at(const ModelView& model, double since_trigger_s) noexcept;

/// In doubles: any two stamps have a difference there, also hostile ones.
[[nodiscard]] inline double seconds_between(std::int64_t begin_ns, std::int64_t end_ns) noexcept {
  constexpr double seconds_per_nanosecond = 1e-9;
  return (static_cast<double>(end_ns) - static_cast<double>(begin_ns)) * seconds_per_nanosecond;
}

[[nodiscard]] inline MatchResult refused(MatchResult result, Status status) noexcept {
  result.status = status;
  return result;
}

}  // namespace lbea
