// What became of each sender's captures, as far as its ids and words tell. Whatever changes is counted and shown to
// others, and what never came is announced.
#pragma once

#include "tools/serve/announcer.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <chrono>

namespace lbea::tool {

/// The receiving thread's.
class SenderAccounts {
 public:
  /// Without a word for `patience` a sender is silent.
  SenderAccounts(std::chrono::milliseconds patience, Announcer& announcer, Handover& handover)
      : patience_(patience), announcer_(announcer), handover_(handover) {}
  /// A frame arrived.
  IdTracker::Arrival observe(std::uint64_t session, std::uint64_t id, std::int64_t receive_ns) noexcept;
  /// A sender spoke of its ids; false when they cannot be.
  bool report(const wire::Control& control, std::int64_t receive_ns) noexcept;
  /// Shows who the senders are and how they do. At the end no patience is left for those who are gone.
  void show_at_end(bool everyone_is_gone) noexcept {
    show(Clock::now(), everyone_is_gone ? Clock::duration(-1) : patience_);
  }
  /// The same, unless it was done a moment ago.
  void show_when_due() noexcept;

 private:
  using Clock = IdTracker::Clock;
  void show(Clock::time_point now, Clock::duration patience) noexcept;

  std::chrono::milliseconds patience_;
  IdTracker ids_;
  Clock::time_point next_show_{};
  Announcer& announcer_;
  Handover& handover_;
};

}  // namespace lbea::tool
