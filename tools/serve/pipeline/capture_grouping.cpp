#include "tools/serve/pipeline/capture_grouping.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <utility>

namespace lbea::tool {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

}  // namespace

std::int64_t RigLag::at(std::int64_t now_ns) const noexcept {
  return now_ns / half_second_ns == half_second_ ? std::min(least_ns_, least_before_ns_) : least_ns_;
}

bool RigLag::add(const WaitingFrame& frame, std::int64_t most_ns) noexcept {
  constexpr std::int64_t until_believed_ns = second_ns / 10;
  const std::int64_t lag_ns = frame.receive_ns - frame.stamp_ns, now = frame.receive_ns / half_second_ns;
  if (is_known_ && at(frame.receive_ns) - lag_ns > most_ns) {
    if (!ahead_since_ns_) ahead_since_ns_ = frame.receive_ns;
    if (frame.receive_ns - *ahead_since_ns_ < until_believed_ns) return false;
    is_known_ = false;
  }
  ahead_since_ns_.reset();
  if (!is_known_ || now > half_second_ + 1)
    least_ns_ = least_before_ns_ = lag_ns;
  else if (now > half_second_)
    least_before_ns_ = std::exchange(least_ns_, lag_ns);
  is_known_ = true;
  half_second_ = now;
  least_ns_ = std::min(least_ns_, lag_ns);
  return true;
}

void CaptureGrouping::add(WaitingFrame frame) {
  Rig& rig = rigs_[frame.rig];
  if (!rig.lag.add(frame, config_.wait.count())) return refused_.push_back(frame);
  frame.stamp_ns += rig.shift_ns;
  note(rig, frame);
  rig.is_expected = keeps_step(rig, frame.receive_ns);
  if (!rig.is_expected)
    for (const WaitingFrame& waiting : std::exchange(rig.waiting, {})) refused_.push_back(waiting);
  if (!rig.is_expected || was_overtaken(frame)) return refused_.push_back(frame);
  rig.waiting.insert(std::ranges::upper_bound(rig.waiting, frame.stamp_ns, {}, &WaitingFrame::stamp_ns), frame);
}

/// Not if the rig's clock was set back.
bool CaptureGrouping::was_overtaken(const WaitingFrame& frame) const noexcept {
  if (!matched_until_ns_ || frame.stamp_ns >= *matched_until_ns_) return false;
  const Rig& rig = rigs_[frame.rig];
  const std::int64_t late_ns = frame.receive_ns - (frame.stamp_ns - rig.shift_ns) - rig.lag.at(frame.receive_ns);
  return *matched_until_ns_ - frame.stamp_ns < second_ns || late_ns > config_.wait.count();
}

bool CaptureGrouping::has_better_clock(const WaitingFrame& frame) const noexcept {
  if (!matched_until_ns_) return false;
  const std::int64_t lag_ns = frame.receive_ns - frame.stamp_ns, former_ns = frame.receive_ns - *matched_until_ns_;
  return *matched_until_ns_ - frame.stamp_ns >= second_ns && std::abs(lag_ns) + second_ns <= std::abs(former_ns);
}

void CaptureGrouping::note(Rig& rig, const WaitingFrame& frame) noexcept {
  if (rig.has_sent && frame.stamp_ns > rig.latest_stamp_ns) {
    const std::int64_t interval_ns = std::min(frame.stamp_ns - rig.latest_stamp_ns, second_ns);
    rig.interval_before_ns = rig.interval_ns == 0 ? interval_ns : rig.interval_ns;
    rig.interval_ns = interval_ns;
  }
  rig.latest_stamp_ns = frame.stamp_ns;
  rig.latest_receive_ns = frame.receive_ns;
  rig.has_sent = true;
}

/// Of the rigs that are sending, the one with the most captures in this test, so that a rig that joins does not put it
/// out of step; at the beginning the one with the least lag. None whose clock differs by a second more from this
/// machine's than another's.
const CaptureGrouping::Rig* CaptureGrouping::leading(std::int64_t now_ns) const noexcept {
  const auto is_sending = [&](const Rig& rig) { return rig.has_sent && now_ns - rig.latest_receive_ns <= second_ns; };
  std::int64_t least_ns = std::numeric_limits<std::int64_t>::max();
  for (const Rig& rig : rigs_)
    if (is_sending(rig)) least_ns = std::min(least_ns, std::abs(rig.lag.at(now_ns)));
  constexpr std::uint64_t beginning = 8;  // captures
  const auto leads = [now_ns](const Rig& a, const Rig& b) {
    const std::uint64_t of_a = a.captures / beginning, of_b = b.captures / beginning;
    return of_a != of_b ? of_a > of_b : std::abs(a.lag.at(now_ns)) < std::abs(b.lag.at(now_ns));
  };
  const Rig* first = nullptr;
  for (const Rig& rig : rigs_)
    if (is_sending(rig) && std::abs(rig.lag.at(now_ns)) - least_ns <= second_ns &&
        (first == nullptr || leads(rig, *first)))
      first = &rig;
  return first;
}

bool CaptureGrouping::keeps_step(const Rig& rig, std::int64_t now_ns) const noexcept {
  const Rig* const leader = leading(now_ns);
  if (leader == nullptr || leader == &rig) return true;
  return std::abs(rig.lag.at(now_ns) - leader->lag.at(now_ns)) <= config_.wait.count();
}

bool CaptureGrouping::is_crowded() const noexcept {
  return std::ranges::any_of(rigs_, [this](const Rig& rig) { return 4 * rig.waiting.size() >= 3 * queue_slots_; });
}

const CaptureGrouping::Rig* CaptureGrouping::oldest() const noexcept {
  const Rig* first = nullptr;
  for (const Rig& rig : rigs_)
    if (!rig.waiting.empty() && (first == nullptr || rig.waiting.front().stamp_ns < first->waiting.front().stamp_ns))
      first = &rig;
  return first;
}

/// Whether a frame of the rig should come for the capture that begins with `first`.
bool CaptureGrouping::is_due(const Rig& rig, const WaitingFrame& first) const noexcept {
  if (!rig.waiting.empty() || !rig.is_expected) return false;
  const std::int64_t interval_ns = std::min(rig.interval_ns, rig.interval_before_ns);  // one frame may be missing
  return !rig.has_sent || rig.latest_stamp_ns + interval_ns <= first.stamp_ns + config_.window.count();
}

/// Whether it is in the window, and no later frame of the first one's rig, which may not have arrived yet, is nearer to
/// it.
bool CaptureGrouping::belongs(const WaitingFrame& frame, const Rig& first) const noexcept {
  const std::int64_t begin = first.waiting.front().stamp_ns, after = frame.stamp_ns - begin;
  if (after > config_.window.count()) return false;
  const std::int64_t interval_ns = std::min(first.interval_ns, first.interval_before_ns);
  if (first.waiting.size() < 2 && (interval_ns == 0 || !first.is_expected)) return true;
  const std::int64_t later = first.waiting.size() < 2 ? begin + interval_ns : first.waiting[1].stamp_ns;
  return std::abs(later - frame.stamp_ns) >= after;
}

std::span<const WaitingFrame> CaptureGrouping::next(std::int64_t now_ns, bool at_once) {
  capture_.clear();
  const Rig* const first = oldest();
  if (first == nullptr) return {};
  const bool may_wait = !at_once && !is_crowded() && now_ns < *deadline_ns();
  for (Rig& rig : rigs_) {
    if (!is_due(rig, first->waiting.front())) continue;
    if (may_wait) return {};
    rig.is_expected = at_once && rig.is_expected;
  }
  for (const Rig& rig : rigs_)
    if (!rig.waiting.empty() && (&rig == first || belongs(rig.waiting.front(), *first)))
      capture_.push_back(rig.waiting.front());
  matched_until_ns_ = first->waiting.front().stamp_ns;
  for (const WaitingFrame& frame : capture_) {
    Rig& rig = rigs_[frame.rig];
    rig.waiting.erase(rig.waiting.begin());
    ++rig.captures;
  }
  return capture_;
}

std::optional<std::int64_t> CaptureGrouping::deadline_ns() const noexcept {
  std::optional<std::int64_t> first;
  for (const Rig& rig : rigs_)
    for (const WaitingFrame& frame : rig.waiting)
      first =
          std::min(first.value_or(std::numeric_limits<std::int64_t>::max()), frame.receive_ns + config_.wait.count());
  return first;
}

void CaptureGrouping::correct_clocks(std::span<const std::int64_t> corrections_ns) noexcept {
  const std::int64_t least_ns = std::ranges::min(corrections_ns);
  for (std::size_t i = 0; i < rigs_.size(); ++i) {
    Rig& rig = rigs_[i];
    const std::int64_t change_ns = corrections_ns[i] - least_ns - rig.shift_ns;
    rig.shift_ns += change_ns;
    rig.latest_stamp_ns += change_ns;
    for (WaitingFrame& frame : rig.waiting) frame.stamp_ns += change_ns;
  }
}

void CaptureGrouping::begin_test() noexcept {
  matched_until_ns_.reset();
  for (Rig& rig : rigs_) rig = {};
}

}  // namespace lbea::tool
