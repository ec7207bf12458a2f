// Where the frames of each rig are sent, and what became of them.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/shared/intake/handshake.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/intake/rig_options.hpp"

#include <map>
#include <set>

namespace lbea::tool {

struct RigOutlet {
  std::string rig;  // empty: the only one
  wire::FrameSink sink;
  IdTracker ids{};                                    // sent
  std::map<std::uint64_t, std::uint64_t> next_ids{};  // of each recorded session, for the goodbye
  std::map<std::uint64_t, std::uint64_t> tests{};     // the number of each session's latest test
  std::map<std::uint64_t, std::uint64_t> frames{};    // how many of each session were sent or refused
  std::set<std::uint64_t> finished{};                 // sessions whose stream was ended after their last frame
  std::uint64_t received = 0;                         // by the matcher, if it was asked
};

/// Waits until a program listens at each. Throws Error{bad_config | endpoint_unavailable}.
[[nodiscard]] std::vector<RigOutlet> connected(wire::WireContext& context, const std::vector<RigEndpoint>& endpoints,
                                               const wire::ClientAccess& access);

/// The matcher's receipts for the replayed frames.
class MatcherReceipts {
 public:
  /// Waits for the first state of the matcher. Throws Error{bad_config | endpoint_unavailable}.
  MatcherReceipts(wire::WireContext& context, const std::string& results_endpoint, const wire::ClientAccess& access);
  /// Says goodbye for a session whose ids are all below `next_id` and adds the matcher's receipt. Warns when the
  /// matcher had frames of that session before. Returns how many frames it has received now.
  std::uint64_t ask(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id);
  /// Waits until the matcher knows that a session has ended; false if it does not answer.
  bool await_end(wire::FrameSink& frames, std::uint64_t session, std::uint64_t next_id);
  [[nodiscard]] const Receipt& sum() const noexcept { return receipts_->sum(); }

 private:
  [[nodiscard]] wire::ResultSource results() const { return {context_, endpoint_, wire::results_held, access_}; }
  wire::WireContext& context_;
  std::string endpoint_;
  wire::ClientAccess access_;
  std::optional<Receipts> receipts_;
};

struct SocketCounts {
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;   // the receiver had no room
  std::uint64_t left = 0;      // sent, but not transferred to the receiver before the end
  std::uint64_t repeated = 0;  // sent, but with an id that was used before, and so refused by the matcher
};

struct SocketTally : SocketCounts {
  struct Rig : SocketCounts {
    std::string name;
    std::uint64_t received = 0;  // by the matcher, with a receipt
  };
  double seconds = 0, worst_lateness_ms = 0;
  std::optional<Receipt> receipt;
  std::vector<Rig> rigs;  // of several
  /// left: frames that remained in this process.
  void add(const RigOutlet& outlet, std::uint64_t left);
  /// No loss is known.
  [[nodiscard]] bool is_complete() const noexcept {
    return refused == 0 && left == 0 &&
           (!receipt || (receipt->is_whole && receipt->received + repeated >= sent && receipt->dropped == 0 &&
                         receipt->out_of_step == 0));
  }
};
[[nodiscard]] std::string to_text(const SocketTally& tally);
[[nodiscard]] std::string to_json(const SocketTally& tally);

}  // namespace lbea::tool
