#include "tools/serve/pipeline/capture_grouping.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace lbea::tool {
namespace {

constexpr std::int64_t another_clock_ns = 1'000'000'000;  // no rig is late by so much

}  // namespace

bool CaptureGrouping::add(const WaitingFrame& frame) {
  Rig& rig = rigs_[frame.rig];
  const bool is_in_step = keeps_step(frame);
  if (rig.has_sent && frame.stamp_ns > rig.latest_stamp_ns) {
    rig.interval_before_ns =
        std::exchange(rig.interval_ns, std::min(frame.stamp_ns - rig.latest_stamp_ns, another_clock_ns));
    if (rig.interval_before_ns == 0) rig.interval_before_ns = rig.interval_ns;
  }
  rig.latest_stamp_ns = frame.stamp_ns;
  rig.latest_receive_ns = frame.receive_ns;
  rig.has_sent = true;
  rig.is_expected = is_in_step;
  if (!is_in_step) return false;
  rig.waiting.insert(std::ranges::upper_bound(rig.waiting, frame.stamp_ns, {}, &WaitingFrame::stamp_ns), frame);
  return true;
}

/// The clock of the first rig that sends is the common one.
bool CaptureGrouping::keeps_step(const WaitingFrame& frame) const noexcept {
  const std::int64_t lag = frame.receive_ns - frame.stamp_ns;
  for (std::uint32_t before = 0; before < frame.rig; ++before) {
    const Rig& rig = rigs_[before];
    if (!rig.has_sent || frame.receive_ns - rig.latest_receive_ns > another_clock_ns) continue;
    if (lag - rig.lag_ns() > another_clock_ns || rig.lag_ns() - lag > config_.wait.count()) return false;
    break;
  }
  if (!matched_until_ns_ || frame.stamp_ns >= *matched_until_ns_) return true;
  return *matched_until_ns_ - frame.stamp_ns > another_clock_ns;  // the clock of an earlier rig, which sends again
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

/// Whether it is in the window, and no later frame of the first one's rig is nearer to it.
bool CaptureGrouping::belongs(const WaitingFrame& frame, const Rig& first) const noexcept {
  const std::int64_t after = frame.stamp_ns - first.waiting.front().stamp_ns;
  if (after > config_.window.count()) return false;
  return first.waiting.size() < 2 || std::abs(first.waiting[1].stamp_ns - frame.stamp_ns) >= after;
}

std::span<const WaitingFrame> CaptureGrouping::next(std::int64_t now_ns, bool at_once) {
  capture_.clear();
  const Rig* const first = oldest();
  if (first == nullptr) return {};
  const bool may_wait = !at_once && now_ns - first->waiting.front().receive_ns < config_.wait.count();
  for (Rig& rig : rigs_) {
    if (!is_due(rig, first->waiting.front())) continue;
    if (may_wait) return {};
    rig.is_expected = at_once && rig.is_expected;
  }
  for (const Rig& rig : rigs_)
    if (!rig.waiting.empty() && (&rig == first || belongs(rig.waiting.front(), *first)))
      capture_.push_back(rig.waiting.front());
  matched_until_ns_ = first->waiting.front().stamp_ns;
  for (const WaitingFrame& frame : capture_) rigs_[frame.rig].waiting.erase(rigs_[frame.rig].waiting.begin());
  return capture_;
}

std::optional<std::int64_t> CaptureGrouping::deadline_ns() const noexcept {
  const Rig* const first = oldest();
  if (first == nullptr) return std::nullopt;
  return first->waiting.front().receive_ns + config_.wait.count();
}

std::size_t CaptureGrouping::most_waiting() const noexcept {
  std::size_t most = 0;
  for (const Rig& rig : rigs_) most = std::max(most, rig.waiting.size());
  return most;
}

void CaptureGrouping::begin_test() noexcept {
  matched_until_ns_.reset();
  for (Rig& rig : rigs_) {
    rig.has_sent = false;
    rig.is_expected = true;
  }
}

}  // namespace lbea::tool
