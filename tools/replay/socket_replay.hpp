// Sends recorded frames to a matcher's socket, as a camera would.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/shared/intake/handshake.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <chrono>
#include <functional>

namespace lbea::tool {

struct PaceConfig {
  double speed = 1;    // relative to the recording; 0: as fast as possible
  bool steps = false;  // one frame per line on standard input
};

/// When each frame is sent.
class Pace {
 public:
  Pace(const PaceConfig& config, std::function<bool()> stop) : config_(config), stop_(std::move(stop)) {}
  /// Waits until a frame received at `log_time_ns` is due, relative to the first call. False when `stop` returns true
  /// or standard input has ended.
  bool wait_for(std::int64_t log_time_ns);
  /// The next frame is due at once; later ones are relative to it.
  void restart() { begun_ = false; }
  /// The largest delay of a frame.
  [[nodiscard]] std::chrono::nanoseconds worst_lateness() const noexcept { return worst_; }

 private:
  using Clock = std::chrono::steady_clock;
  bool wait_for_line() const;
  PaceConfig config_;
  std::function<bool()> stop_;
  bool begun_ = false;
  Clock::time_point begin_{};
  std::int64_t first_ns_ = 0, last_ns_ = 0;
  std::chrono::nanoseconds worst_{0};
};

/// The matcher's receipts for the replayed frames.
class MatcherReceipts {
 public:
  /// Waits for the first state of the matcher that publishes at `results_endpoint`.
  /// Throws Error{bad_config | endpoint_unavailable}.
  MatcherReceipts(wire::WireContext& context, const std::string& results_endpoint, const wire::ClientAccess& access,
                  const std::function<bool()>& stop);
  /// Says goodbye for a session whose ids are all below `next_id` and adds the matcher's receipt. Warns when the
  /// matcher had frames of that session before.
  void ask(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id);
  [[nodiscard]] const Receipt& receipt() const noexcept { return receipts_->sum(); }

 private:
  [[nodiscard]] wire::ResultSource results() const { return {context_, endpoint_, wire::results_held, access_}; }
  wire::WireContext& context_;
  std::string endpoint_;
  wire::ClientAccess access_;
  std::optional<Receipts> receipts_;
};

struct SocketReplayTally {
  std::uint64_t frames = 0;  // sent + refused
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;   // the receiver had no room
  std::uint64_t left = 0;      // sent, but not transferred to the receiver before the end
  std::uint64_t repeated = 0;  // sent, but with an id that was used before, and so refused by the matcher
  double seconds = 0;
  std::optional<Receipt> receipt;
  /// No loss is known.
  [[nodiscard]] bool is_complete() const noexcept {
    return refused == 0 && left == 0 &&
           (!receipt || (receipt->is_whole && receipt->received + repeated >= sent && receipt->dropped == 0));
  }
};

struct SocketReplayConfig {
  std::uint64_t rounds = 1;  // 0: until stopped; later rounds have new sessions
  bool waits = false;        // for room at the receiver, instead of refusing like a camera
  bool ends_stream = true;   // announce the end of the test after the last frame
};

/// Sends the remaining frames of `run` with their recorded sessions and ids. `receipts` may be null.
[[nodiscard]] SocketReplayTally replay_to_socket(RecordedRun& run, const SocketReplayConfig& config,
                                                 wire::FrameSink& sink, MatcherReceipts* receipts, Pace& pace,
                                                 const std::function<bool()>& stop);

}  // namespace lbea::tool
