// A sender's control dialog with the matcher: hello before the first frame, goodbye after the last one, and the
// matcher's receipt of what arrived. The matcher answers on its results socket.
#pragma once

#include "adapters/wire/sockets/streams.hpp"

#include <nlohmann/json_fwd.hpp>

#include <chrono>
#include <functional>
#include <optional>
#include <set>
#include <string>

namespace lbea::tool {

/// The next state of the matcher; nothing when `stop` returns true before.
[[nodiscard]] std::optional<wire::WireState> wait_for_state(wire::ResultSource& results,
                                                            const std::function<bool()>& stop);

class Handshake {
 public:
  Handshake(wire::FrameSink& frames, wire::ResultSource results, std::uint64_t session)
      : frames_(frames), results_(std::move(results)), session_(session) {}

  /// Sends hello until the matcher's state lists this session; from then on every id is accounted for. Nothing when
  /// `stop` returns true before.
  [[nodiscard]] std::optional<wire::WireState> begin(const std::function<bool()>& stop);
  /// Sends goodbye until the matcher has accounted for all ids below `next_id`, of which the last `withheld` could not
  /// be sent, and returns the matcher's entry for this session; nothing when that does not happen within `timeout`.
  [[nodiscard]] std::optional<wire::WireSender> end(std::uint64_t next_id, std::uint64_t withheld,
                                                    std::chrono::milliseconds timeout);
  /// The matcher's latest state that was read.
  [[nodiscard]] const wire::WireState& state() const noexcept { return state_; }

 private:
  /// Repeats a message until the matcher's entry for this session `is_enough`; nothing when `stop` returns true before.
  [[nodiscard]] std::optional<wire::WireSender> tell_until(
      const std::function<bool(const wire::WireSender&)>& is_enough, const wire::Control& control,
      const std::function<bool()>& stop);

  wire::FrameSink& frames_;
  wire::ResultSource results_;
  std::uint64_t session_;
  wire::WireState state_;
};

/// What the matcher reports about the frames that were sent to it.
struct Receipt {
  bool is_whole = true;  // the matcher answered for each session
  std::uint64_t received = 0, missed = 0, withheld = 0;
  std::uint64_t out_of_step = 0;  // refused by a matcher of several rigs, in the same time
  std::uint64_t dropped = 0;      // by the matcher, without room or for another sender's test, in the same time
};

/// Sums the receipts of one or more sessions.
class Receipts {
 public:
  /// `before`: the matcher's state before the first frame.
  explicit Receipts(wire::WireState before) : before_(std::move(before)) {}
  /// Ends a session and adds what the matcher reports of it; waits at most 5 s.
  void collect(Handshake& handshake, std::uint64_t session, std::uint64_t next_id);
  /// Adds what the matcher's state reports of a session. `dropped` and `out_of_step`: of all senders to its rig.
  void add(std::uint64_t session, const wire::WireState& state);
  /// Whether the matcher had received frames of that session before.
  [[nodiscard]] bool knew(std::uint64_t session) const;
  [[nodiscard]] const Receipt& sum() const noexcept { return sum_; }

 private:
  wire::WireState before_;
  std::set<std::string> rigs_;  // of the sessions, if the matcher has several
  Receipt sum_;
};

/// To be appended to a sender's own tally.
[[nodiscard]] std::string receipt_text(const Receipt& receipt);
[[nodiscard]] nlohmann::ordered_json receipt_json(const Receipt& receipt);

}  // namespace lbea::tool
