// Tracks the frame ids of each sender session: gaps, duplicates, late arrivals.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <chrono>
#include <optional>

namespace lbea::tool {

/// Ids `first`, `first` + 1, ..., `count` of them.
struct IdRange {
  std::uint64_t first = 0, count = 0;
  friend bool operator==(const IdRange&, const IdRange&) = default;
};

class IdTracker {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds default_sender_timeout{3000};
  static constexpr std::size_t max_sessions = 64;                    // remembered, and listed by senders()
  static constexpr std::uint64_t max_jump = std::uint64_t{1} << 32;  // 49 days at 1,000 a second
  /// impossible: the id cannot follow the session's ids. It is not counted, so that one wrong number does not spoil the
  /// session's account.
  enum class Arrival : std::uint8_t { in_order, late, duplicate, impossible };
  struct Observation {
    Arrival arrival = Arrival::in_order;
    IdRange gap;  // ids that are missed as of now
  };
  struct Report {
    IdRange gap, withheld;
    bool is_possible = true;  // otherwise nothing was counted
  };

  /// Counts a frame that arrived. Gaps count from the session's first id on; frames sent before this receiver listened
  /// are not missed. A missed id that arrives after all is late and no longer missed, as long as its gap is among the
  /// session's latest ones. The same holds for the 1,024 ids before the first one that arrived. Impossible are 2^64 -
  /// 1, which has no successor, and ids that are 2^32 or more beyond the session's highest one.
  Observation observe(std::uint64_t session, std::uint64_t id, Clock::time_point now = {});
  /// After observe() of a frame that can be matched: whether it is kept, and so belongs to the running test. False with
  /// one sender, while the test of another one is running.
  bool enter_test(std::uint64_t session, Clock::time_point now = {});
  /// From now on, frames are not kept while another sender has neither said goodbye nor been without a message for
  /// `timeout`. The first frame that can be matched decides whose test is running.
  void allow_one_sender(Clock::duration timeout) { one_sender_timeout_ = timeout; }
  /// Counts a sender's own report: ids below next_id are missed unless they arrived; the last `withheld` of them are
  /// withheld.
  Report report(const wire::Control& control, Clock::time_point now = {});

  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }      // wraps around
  [[nodiscard]] std::uint64_t withheld() const noexcept { return withheld_; }  // wraps around
  [[nodiscard]] std::uint64_t duplicates() const noexcept { return duplicates_; }
  [[nodiscard]] std::uint64_t reordered() const noexcept { return reordered_; }
  [[nodiscard]] std::uint64_t sessions() const noexcept { return sessions_; }
  /// Returns to a sender that had sent frames before another one did, and of which one had not said goodbye: two tests
  /// are mixed.
  [[nodiscard]] std::uint64_t interleaved() const noexcept { return interleaved_; }
  /// The latest senders. A sender is silent when it has sent control messages before, has not said goodbye, and has
  /// sent nothing for longer than `timeout`.
  [[nodiscard]] std::vector<wire::WireSender> senders(Clock::time_point now, Clock::duration timeout) const;

 private:
  struct Session {
    wire::WireSender sender;
    std::uint64_t last_use = 0;
    Clock::time_point last_message;
    bool sends_control = false;
    bool has_test = false;         // a frame was kept
    bool has_ended = false;        // it said goodbye after its last kept frame
    std::vector<IdRange> missing;  // the latest gaps, ascending
    std::uint64_t earliest = 0;    // ids from here to first_id may still arrive
  };
  /// The session; a new one begins at `first_id`.
  Session& session_of(std::uint64_t session, std::uint64_t first_id, Clock::time_point now);
  /// Everything from next_id to `id` is missed.
  IdRange advance(Session& session, std::uint64_t id);
  Session* find(std::uint64_t session) noexcept;
  /// An id below next_id.
  Observation observe_late(Session& session, std::uint64_t id);
  /// The ids in `gap` are missed.
  IdRange add_gap(Session& session, IdRange gap);
  static bool remove_missing(Session& session, std::uint64_t id);

  std::vector<Session> recent_;  // bounded: the least recently used one is replaced
  std::uint64_t uses_ = 0, missed_ = 0, withheld_ = 0, duplicates_ = 0, reordered_ = 0, sessions_ = 0, interleaved_ = 0;
  std::uint64_t test_ = 0;  // the session of the running test
  std::optional<Clock::duration> one_sender_timeout_;
};

/// The status of a frame after its id was observed: an impossible id makes it damaged, a second arrival a duplicate.
[[nodiscard]] wire::WireStatus status_after(IdTracker::Arrival arrival, wire::WireStatus status) noexcept;

}  // namespace lbea::tool
