// The seam between the pipeline and the matcher.
#pragma once

#include <lbea/lbea.hpp>
#include <lbea/tracker.hpp>

#include <string_view>

namespace lbea::tool {

/// What the pipeline asks of the matcher; tests put faults here.
class MatchEngine {
 public:
  virtual ~MatchEngine() = default;
  virtual MatchResult match(const Frame& frame) noexcept = 0;
  /// What the test so far says, this frame included; null when nobody adds it up.
  virtual const TestState* track(const MatchResult&) noexcept { return nullptr; }
  /// The next frame comes from a sender that was started anew.
  virtual void begin_test() noexcept {}
  [[nodiscard]] virtual std::string_view simulation_name(std::uint32_t simulation) const noexcept = 0;
  [[nodiscard]] virtual double time_s(Sample sample) const noexcept = 0;
};

}  // namespace lbea::tool
