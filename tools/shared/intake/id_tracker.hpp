// Which frame ids a receiver should have seen: gaps, repetitions, late arrivals, per session of a sender.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea::tool {

/// Ids `first`, `first` + 1, ..., `count` of them.
struct IdRange {
  std::uint64_t first = 0, count = 0;
  friend bool operator==(const IdRange&, const IdRange&) = default;
};

class IdTracker {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds usual_patience{3000};
  static constexpr std::uint64_t furthest_jump = std::uint64_t{1} << 32;  // 49 days at 1,000 a second
  /// impossible: no sender's next id; not counted, so that one false number does not ruin an account.
  enum class Arrival : std::uint8_t { in_order, late, duplicate, impossible };
  struct Seen {
    Arrival arrival = Arrival::in_order;
    IdRange gap;  // ids that are missed as of now
  };
  struct Told {
    IdRange gap, withheld;
    bool is_possible = true;  // else nothing was counted
  };

  /// A frame arrived. Gaps count from the first id of a session on: what was sent before this receiver listened
  /// is nobody's loss. An id that was missed and comes after all is late and no longer missed, as long as the gap
  /// is among the latest ones of its session; so is one of the 1,024 before the first that came. Impossible are the
  /// highest number of all, which has no next one, and ids that are 2^32 or more beyond what their session has reached.
  Seen saw(std::uint64_t session, std::uint64_t id, Clock::time_point now = {});
  /// A sender spoke of its ids: those below next_id are missed unless they came, but for the withheld ones.
  Told told(const wire::Control& control, Clock::time_point now = {});

  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }      // wraps around
  [[nodiscard]] std::uint64_t withheld() const noexcept { return withheld_; }  // wraps around
  [[nodiscard]] std::uint64_t duplicates() const noexcept { return duplicates_; }
  [[nodiscard]] std::uint64_t reordered() const noexcept { return reordered_; }
  [[nodiscard]] std::uint64_t sessions() const noexcept { return sessions_; }
  /// The latest senders. Silent are those that used to say more than frames, did not say goodbye, and were not
  /// heard of for `patience`.
  [[nodiscard]] std::vector<wire::WireSender> senders(Clock::time_point now, Clock::duration patience) const;

 private:
  struct Session {
    wire::WireSender sender;
    std::uint64_t last_use = 0;
    Clock::time_point last_heard;
    bool speaks = false;           // of more than frames
    std::vector<IdRange> missing;  // the latest gaps, ascending
    std::uint64_t earliest = 0;    // ids from here to the first one may be on their way yet
  };
  /// The session, begun at `first_id` when it is new.
  Session& session_of(std::uint64_t session, std::uint64_t first_id, Clock::time_point now);
  /// Everything from next_id to `id` is missed.
  IdRange advance(Session& session, std::uint64_t id);
  Session* find(std::uint64_t session) noexcept;
  /// An id before next_id.
  Seen late(Session& session, std::uint64_t id);
  /// The session began earlier than it seemed, with `id`: what lies between is missed.
  IdRange begin_at(Session& session, std::uint64_t id);
  static bool take_missing(Session& session, std::uint64_t id);

  std::vector<Session> recent_;  // bounded: the least recently used one makes room
  std::uint64_t uses_ = 0, missed_ = 0, withheld_ = 0, duplicates_ = 0, reordered_ = 0, sessions_ = 0;
};

}  // namespace lbea::tool
