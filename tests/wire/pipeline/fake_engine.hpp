// A fake matcher for tests of the pipeline.
#pragma once

#include "tools/shared/matching/match_engine.hpp"

#include <atomic>
#include <chrono>
#include <limits>
#include <thread>

namespace lbea::test {

using namespace lbea::tool;

/// Waits for `delay`, or for the first point's y in us; its match is the simulation whose number is the first point's
/// x. With a positive z it has channels.
class FakeEngine final : public MatchEngine {
 public:
  explicit FakeEngine(std::chrono::microseconds delay = {}) : delay_(delay) {}
  MatchResult match(const Frame& frame, std::uint32_t matcher) noexcept override {
    const auto own = std::chrono::microseconds(frame.points.empty() ? 0 : static_cast<int>(frame.points[0].y));
    if (const auto delay = std::max(delay_.load(), own); delay.count() > 0) std::this_thread::sleep_for(delay);
    ++matched;
    MatchResult result;
    result.frame_id = frame.id;
    result.stamp_ns = frame.stamp_ns;
    result.points.received = static_cast<std::uint32_t>(frame.points.size());
    if (frame.points.empty()) {
      result.status = Status::empty_frame;
      return result;
    }
    result.coverage = 0.5f;
    if (frame.points.size() == 1) result.status = Status::low_coverage;
    matches_[matcher] = {{static_cast<std::uint32_t>(frame.points[0].x), 3}, 1.5f};
    result.matches = {&matches_[matcher], 1};
    if (frame.points[0].z > 0) result.channels = channels_;
    result.elapsed_ns = {1, 2, 3, 4, 5};
    return result;
  }
  std::string_view simulation_name(std::uint32_t simulation) const noexcept override {
    return simulation == 4 ? "run_004" : "run_other";
  }
  double time_s(Sample sample) const noexcept override { return 0.001 * sample.time_step; }
  ChannelInfo channel(std::uint32_t channel) const noexcept override {
    ChannelInfo info;
    info.name = channel == 0 ? "end \"x\" \\ \n" : channel == 1 ? "gap" : "unknown";
    info.unit = channel == 0 ? "mm" : "";
    return info;
  }
  void set_delay(std::chrono::microseconds delay) { delay_ = delay; }

  std::atomic<std::uint32_t> matched{0};  // frames

 private:
  std::atomic<std::chrono::microseconds> delay_;
  std::array<Match, 8> matches_{};  // of as many matchers
  static constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  std::array<ChannelValue, 3> channels_{{{12.3f, 0.5f}, {-3, unknown}, {unknown, unknown}}};
};

}  // namespace lbea::test
