// A sender's talk with the matcher: hello before the first frame, a receipt after the last one. The matcher
// answers on its results socket.
#pragma once

#include "adapters/wire/sockets/streams.hpp"

#include <chrono>
#include <functional>
#include <optional>

namespace lbea::wire {

class Handshake {
 public:
  Handshake(FrameSink& frames, ResultSource results, std::uint64_t session)
      : frames_(frames), results_(std::move(results)), session_(session) {}

  /// Says hello until the matcher's state lists this session: from then on every id is accounted for. Nothing when
  /// `stop` says so first.
  [[nodiscard]] std::optional<WireState> greet(const std::function<bool()>& stop);
  /// Says goodbye until the matcher knows of all ids below `next_id`, of which the last `withheld` could not be sent,
  /// and returns what it has of this session; nothing when it does not say so within `patience`.
  [[nodiscard]] std::optional<WireSender> part(std::uint64_t next_id, std::uint64_t withheld,
                                               std::chrono::milliseconds patience);
  /// The matcher's latest one that was read.
  [[nodiscard]] const WireState& state() const noexcept { return state_; }

 private:
  [[nodiscard]] const WireSender* own_entry(std::chrono::milliseconds timeout);

  FrameSink& frames_;
  ResultSource results_;
  std::uint64_t session_;
  WireState state_;
};

}  // namespace lbea::wire
