// Recorded frames to a matcher, as a camera would send them.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/replay/pace.hpp"
#include "tools/replay/witness.hpp"
#include "tools/shared/recording/recorded_run.hpp"

namespace lbea::tool {

struct SocketReplayTally {
  std::uint64_t frames = 0;  // whose time came: sent + refused
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;   // the receiver had no room in time
  std::uint64_t left = 0;      // sent, but not taken over by the receiver before the end
  std::uint64_t repeated = 0;  // of those sent: under an id that came before, and refused for it
  double seconds = 0;
  std::optional<Receipt> receipt;
  /// Nothing was lost, as far as is known.
  [[nodiscard]] bool is_complete() const noexcept {
    return refused == 0 && left == 0 &&
           (!receipt || (receipt->is_whole && receipt->received + repeated >= sent && receipt->dropped == 0));
  }
};

struct SocketReplayConfig {
  std::uint64_t rounds = 1;  // 0: until stopped; later ones under sessions of their own
  bool waits = false;        // for room at the receiver, instead of refusing as a camera must
  bool ends_stream = true;   // say after the last frame that the test is over
};

/// Sends the frames of `run`, from where it stands, with the sessions and ids they had. `witness`: who says what
/// arrived; may be null.
[[nodiscard]] SocketReplayTally replay_to_socket(RecordedRun& run, const SocketReplayConfig& config,
                                                 wire::FrameSink& sink, MatcherWitness* witness, Pace& pace,
                                                 const std::function<bool()>& stop);

}  // namespace lbea::tool
