// Which frames of several rigs make up one capture, and how long to wait for those that have not arrived.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace lbea::tool {

struct GroupingConfig {
  std::chrono::nanoseconds window = std::chrono::milliseconds(1);  // frames of a capture are captured within it
  std::chrono::nanoseconds wait = std::chrono::milliseconds(20);   // the longest time that a frame waits for others
};

/// Times in ns, within 200 years of 1970: stamps by the rigs' common clock, arrivals by this machine's.
struct WaitingFrame {
  std::uint64_t turn = 0;  // place in the order of arrival
  std::uint32_t rig = 0;
  std::int64_t stamp_ns = 0, receive_ns = 0;
};

/// Orders the frames by their stamps. A capture consists of the oldest frame and of those of other rigs that were
/// captured within the window after it. It is complete as soon as every rig has a frame in it or a later one, or none
/// is to be expected: the rig has ended, its latest frame was out of step, its next one is not due yet, or a wait was
/// in vain since it last sent one.
class CaptureGrouping {
 public:
  CaptureGrouping(std::size_t rigs, const GroupingConfig& config) : config_(config), rigs_(rigs) {}
  /// False when the frame is out of step, so that it belongs to no capture: later ones are complete already; or its
  /// stamp is ahead of those of a rig before it by more than the wait, or differs by more than a second.
  [[nodiscard]] bool add(const WaitingFrame& frame);
  /// No further frame of the rig is to be expected.
  void end(std::uint32_t rig) noexcept { rigs_[rig].is_expected = false; }
  /// The next capture, in the order of rigs; empty if it is not complete yet. `at_once`: nothing is waited for. Valid
  /// until the next call.
  [[nodiscard]] std::span<const WaitingFrame> next(std::int64_t now_ns, bool at_once);
  /// When next() will give a capture at the latest; none without a waiting frame.
  [[nodiscard]] std::optional<std::int64_t> deadline_ns() const noexcept;
  /// Whether a frame of the rig waits.
  [[nodiscard]] bool has_waiting(std::uint32_t rig) const noexcept { return !rigs_[rig].waiting.empty(); }
  /// Frames of one rig.
  [[nodiscard]] std::size_t most_waiting() const noexcept;
  /// The next frame is the first of another test, whose clock may be another one.
  void begin_test() noexcept;

 private:
  struct Rig {
    std::vector<WaitingFrame> waiting;  // by stamp
    std::int64_t latest_stamp_ns = 0, latest_receive_ns = 0;
    std::int64_t interval_ns = 0, interval_before_ns = 0;  // between its latest stamps; 0: not known
    bool has_sent = false;                                 // in this test
    bool is_expected = true;                               // further frames, in step
    [[nodiscard]] std::int64_t lag_ns() const noexcept { return latest_receive_ns - latest_stamp_ns; }
  };
  [[nodiscard]] bool keeps_step(const WaitingFrame& frame) const noexcept;
  [[nodiscard]] const Rig* oldest() const noexcept;
  [[nodiscard]] bool is_due(const Rig& rig, const WaitingFrame& first) const noexcept;
  [[nodiscard]] bool belongs(const WaitingFrame& frame, const Rig& first) const noexcept;

  GroupingConfig config_;
  std::vector<Rig> rigs_;
  std::vector<WaitingFrame> capture_;
  std::optional<std::int64_t> matched_until_ns_;  // stamp of the latest capture
};

}  // namespace lbea::tool
