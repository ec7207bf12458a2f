// Which frames of several rigs make up one capture, and how long to wait for those that have not arrived.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
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

/// The least difference between arrivals and stamps in the last second: the shortest delay of a rig's frames plus the
/// difference between the clocks. All rigs have the same half seconds: the lags of clouds that are played slower than
/// their stamps grow, and can still be compared.
class RigLag {
 public:
  /// False for a frame whose stamp is suddenly ahead by more than `most_ns`: it does not count, unless all frames of a
  /// tenth of a second are ahead, because the clock was set.
  [[nodiscard]] bool add(const WaitingFrame& frame, std::int64_t most_ns) noexcept;
  /// In the present half second and the one before; without a frame in the present one, in the latest. After add().
  [[nodiscard]] std::int64_t at(std::int64_t now_ns) const noexcept;

 private:
  static constexpr std::int64_t half_second_ns = 500'000'000;

  bool is_known_ = false;
  std::int64_t half_second_ = 0;                     // since 1970
  std::int64_t least_ns_ = 0, least_before_ns_ = 0;  // in it, and in the one before
  std::optional<std::int64_t> ahead_since_ns_;
};

/// Orders the frames by their stamps. A capture consists of the oldest frame and of those of other rigs that were
/// captured within the window after it. It is complete as soon as every rig has a frame in it or a later one, or none
/// is to be expected: the rig has ended or is out of step, its next frame is not due yet, or a wait was in vain since
/// it last sent one.
class CaptureGrouping {
 public:
  /// queue_slots: frames of a rig that can wait; a rig waits at most until three quarters of them are used.
  CaptureGrouping(std::size_t rigs, const GroupingConfig& config, std::uint32_t queue_slots)
      : config_(config), queue_slots_(queue_slots), rigs_(rigs) {}
  /// The frame may be out of step, so that it belongs to no capture: its rig's lag differs by more than the wait from
  /// that of the leading rig, its stamp is suddenly ahead of the rig's others, or a later capture is complete.
  void add(WaitingFrame frame);
  /// Per rig: added to its stamps, they give those of a common clock. Here they are those of the clock that is the most
  /// ahead, so that none goes back.
  void correct_clocks(std::span<const std::int64_t> corrections_ns) noexcept;
  /// The frames that have been found to be out of step since the last call.
  [[nodiscard]] std::vector<WaitingFrame> take_refused() noexcept { return std::exchange(refused_, {}); }
  /// Whether the captures so far have another clock, which differs by seconds more from this machine's.
  [[nodiscard]] bool has_better_clock(const WaitingFrame& frame) const noexcept;
  /// No further frame of the rig is to be expected.
  void end(std::uint32_t rig) noexcept { rigs_[rig].is_expected = false; }
  /// The next capture, in the order of rigs; empty if it is not complete yet. `at_once`: nothing is waited for. Valid
  /// until the next call.
  [[nodiscard]] std::span<const WaitingFrame> next(std::int64_t now_ns, bool at_once);
  /// When next() will give a capture at the latest; none without a waiting frame.
  [[nodiscard]] std::optional<std::int64_t> deadline_ns() const noexcept;
  /// Whether a frame of the rig waits.
  [[nodiscard]] bool has_waiting(std::uint32_t rig) const noexcept { return !rigs_[rig].waiting.empty(); }
  /// The next frame is the first of another test, whose clock may be another one. No frame may be waiting.
  void begin_test() noexcept;

 private:
  struct Rig {
    std::vector<WaitingFrame> waiting;  // by stamp
    RigLag lag;
    std::int64_t latest_stamp_ns = 0, latest_receive_ns = 0;
    std::int64_t shift_ns = 0;                             // added to its stamps
    std::int64_t interval_ns = 0, interval_before_ns = 0;  // between its latest stamps; 0: not known
    std::uint64_t captures = 0;                            // of this test that its frames are in
    bool has_sent = false;                                 // in this test
    bool is_expected = true;                               // further frames, in step
  };
  void note(Rig& rig, const WaitingFrame& frame) noexcept;
  [[nodiscard]] bool was_overtaken(const WaitingFrame& frame) const noexcept;
  [[nodiscard]] bool keeps_step(const Rig& rig, std::int64_t now_ns) const noexcept;
  [[nodiscard]] const Rig* leading(std::int64_t now_ns) const noexcept;
  [[nodiscard]] bool is_crowded() const noexcept;
  [[nodiscard]] const Rig* oldest() const noexcept;
  [[nodiscard]] bool is_due(const Rig& rig, const WaitingFrame& first) const noexcept;
  [[nodiscard]] bool belongs(const WaitingFrame& frame, const Rig& first) const noexcept;

  GroupingConfig config_;
  std::uint32_t queue_slots_;
  std::vector<Rig> rigs_;
  std::vector<WaitingFrame> capture_, refused_;
  std::optional<std::int64_t> matched_until_ns_;  // stamp of the latest capture
};

}  // namespace lbea::tool
