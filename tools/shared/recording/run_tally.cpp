#include "tools/shared/recording/run_tally.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

namespace lbea::tool {
namespace {

using Kind = RecordedMessage::Kind;
constexpr std::uint64_t no_id = std::numeric_limits<std::uint64_t>::max();  // has no next one

template <class Item>
void sort_and_unite(std::vector<Item>& items) {
  std::ranges::sort(items);
  items.erase(std::unique(items.begin(), items.end()), items.end());
}

template <class Item>
std::vector<Item> merged(const std::vector<Item>& a, const std::vector<Item>& b) {
  std::vector<Item> both;
  std::ranges::merge(a, b, std::back_inserter(both));
  return both;
}

template <class Item>
std::vector<Item> in_first_only(const std::vector<Item>& first, const std::vector<Item>& second) {
  std::vector<Item> difference;
  std::ranges::set_difference(first, second, std::back_inserter(difference));
  return difference;
}

/// Captures from the first to before the last, widened by what it is given.
struct Range {
  std::uint64_t first = no_id, past_last = 0;
  void widen(std::uint64_t from, std::uint64_t past) {
    if (from >= past || is_too_far(past)) return;
    first = std::min(first, from);
    past_last = std::max(past_last, past);
  }
  void widen(const std::vector<std::uint64_t>& sorted_ids) {
    if (!sorted_ids.empty()) widen(sorted_ids.front(), sorted_ids.back() + 1);
  }
  [[nodiscard]] bool is_too_far(std::uint64_t past) const {
    return past_last != 0 && past > past_last && past - past_last >= IdTracker::max_jump;
  }
};

/// Numbers that are no sender's next id are nobody's captures, whatever came with them.
void drop_impossible(std::vector<std::uint64_t>& sorted_ids) {
  const auto is_jump = [](std::uint64_t id, std::uint64_t next) { return next - id >= IdTracker::max_jump; };
  const auto last_possible = std::ranges::adjacent_find(sorted_ids, is_jump);
  if (last_possible != sorted_ids.end()) sorted_ids.erase(last_possible + 1, sorted_ids.end());
  if (!sorted_ids.empty() && sorted_ids.back() == no_id) sorted_ids.pop_back();
}

}  // namespace

void RunTally::take(const mcap::Message& message, const mcap::Channel* channel) {
  if (channel == nullptr) return;
  const auto carried = channel_of(*channel);
  if (!carried) {
    ++audit_.undecodable;
    return;
  }
  const RecordedMessage recorded = recorded_message(message, *carried);
  if (recorded.kind == Kind::frame) take_frame(recorded);
  if (recorded.kind == Kind::result) take_result(recorded);
  if (recorded.kind == Kind::state) take_state(recorded);
}

void RunTally::take_frame(const RecordedMessage& frame) {
  audit_.start_ns = audit_.frames == 0 ? frame.log_time_ns : std::min(audit_.start_ns, frame.log_time_ns);
  audit_.end_ns = std::max(audit_.end_ns, frame.log_time_ns);
  ++audit_.frames;
  sessions_[frame.session].frames.push_back(frame.id);
  frames_.push_back({frame.session, frame.id, frame.log_time_ns});
}

void RunTally::take_result(const RecordedMessage& message) {
  ++audit_.results;
  if (wire::decode_result(message.data, result_) != wire::WireStatus::ok) {
    ++audit_.undecodable;
    return;
  }
  ++audit_.results_by_status[std::string(wire::to_string(result_.status))];
  take_counters(result_.sequence, result_.counters);
  const Named named{result_.session, result_.frame_id, result_.receive_ns};
  const wire::Fate fate = wire::fate_of(result_.status);
  Captures& captures = sessions_[named.session];
  if (fate == wire::Fate::not_a_capture) captures.end = named.id;
  if (fate == wire::Fate::matched) matched_.push_back(named);
  if (result_.status == wire::WireStatus::queue_full) dropped_.push_back(named);
  if (result_.status == wire::WireStatus::missed || result_.status == wire::WireStatus::withheld)
    captures.absent.push_back(named.id);
  if (fate != wire::Fate::rejected) return;
  refused_.push_back(named);
  captures.refused.push_back(named.id);
}

void RunTally::take_state(const RecordedMessage& message) {
  ++audit_.states;
  if (wire::decode_state(message.data, state_) != wire::WireStatus::ok) {
    ++audit_.undecodable;
    return;
  }
  take_counters(state_.sequence, state_.counters);
  for (const wire::WireSender& sender : state_.senders) sessions_[sender.session].account = sender;
  if (matcher_ || state_.model.checksum == 0) return;
  matcher_.emplace();
  matcher_->model_file = state_.model.file;
  matcher_->model_checksum = state_.model.checksum;
  matcher_->method = state_.method;
}

void RunTally::take_counters(std::uint64_t sequence, const wire::Counters& counters) {
  if (audit_.counters && sequence < last_sequence_) return;
  last_sequence_ = sequence;
  audit_.counters = counters;
}

void RunTally::close() {
  if (matcher_ &&
      audit_.settings.model_checksum == 0) {  // recorded beside a matcher, of which nothing was known at the start
    audit_.settings.model_file = matcher_->model_file;
    audit_.settings.model_checksum = matcher_->model_checksum;
    audit_.settings.method = matcher_->method;
  }
  if (audit_.is_replayed) audit_.counters.reset();
  for (auto& [session, captures] : sessions_) close_session(session, captures);
  for (auto* list : {&frames_, &matched_, &dropped_, &refused_}) std::ranges::sort(*list);
  match_answers();
}

/// What came but held no cloud is in no frame, and not missing either. What was sent before a recorder that is not the
/// matcher listened is nobody's loss.
void RunTally::close_session(std::uint64_t id, Captures& captures) {
  const std::uint64_t frames = captures.frames.size();
  sort_and_unite(captures.frames);
  sort_and_unite(captures.absent);
  const std::uint64_t distinct = captures.frames.size();
  std::optional<wire::WireSender> account = audit_.is_matchers_own() ? captures.account : std::nullopt;
  if (captures.recorders_account && !audit_.window) account = captures.recorders_account;
  const bool is_known = account.has_value();
  if (frames == 0 && captures.absent.empty() && !is_known) return;
  sort_and_unite(captures.refused);
  std::vector<std::uint64_t> came = merged(captures.frames, captures.refused);
  came.erase(std::unique(came.begin(), came.end()), came.end());
  drop_impossible(came);
  Range range;
  range.widen(came);
  range.widen(captures.absent);
  if (captures.end) range.widen(range.first, *captures.end);
  if (is_known) range.widen(account->first_id, account->next_id);
  if (range.past_last == 0) return;
  const bool silent = is_known && account->condition == wire::SenderCondition::silent;
  const bool ended = captures.end.has_value() || (is_known && account->condition == wire::SenderCondition::ended);
  audit_.sessions[id] = {
      range.first, range.past_last - 1, frames, range.past_last - range.first - came.size(), frames - distinct, ended,
      silent};
}

void RunTally::match_answers() {
  if (audit_.is_replayed) return;
  const auto answers = merged(matched_, dropped_);
  const auto unanswered = in_first_only(frames_, merged(answers, refused_)), alone = in_first_only(answers, frames_);
  const auto is_before_window = [&](const Named& answer) {
    return audit_.window && answer.received_ns < audit_.window->begin_ns;
  };
  const std::int64_t last_ns = audit_.window ? last_matched_ns() : 0;
  const auto is_cut_off = [&](const Named& frame) { return audit_.window && frame.received_ns > last_ns; };
  const auto before = static_cast<std::uint64_t>(std::ranges::count_if(alone, is_before_window));
  const auto behind = static_cast<std::uint64_t>(std::ranges::count_if(unanswered, is_cut_off));
  audit_.answers_alone = alone.size() - before;
  if (audit_.results == 0) return;
  audit_.unanswered = unanswered.size() - behind;
  audit_.cut_apart = before + behind;
}

/// Frames are matched in the order in which they came: the results of those behind this one were published later.
std::int64_t RunTally::last_matched_ns() const {
  std::int64_t last = std::numeric_limits<std::int64_t>::min();
  for (const Named& frame : frames_)
    if (std::ranges::binary_search(matched_, frame)) last = std::max(last, frame.received_ns);
  return last;
}

}  // namespace lbea::tool
