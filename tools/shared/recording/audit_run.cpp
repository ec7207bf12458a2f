#include "tools/shared/recording/run_audit.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/recording/recording_file.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <iterator>

namespace lbea::tool {
namespace {

using Kind = RecordedMessage::Kind;
constexpr std::uint64_t no_id = std::numeric_limits<std::uint64_t>::max();  // not an id, as it has no successor

template <class Item>
void sort_unique(std::vector<Item>& items) {
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

/// Captures from `first` to before `past_last`.
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

/// Removes ids that no sender can have reached.
void drop_impossible(std::vector<std::uint64_t>& sorted_ids) {
  const auto is_jump = [](std::uint64_t id, std::uint64_t next) { return next - id >= IdTracker::max_jump; };
  const auto last_possible = std::ranges::adjacent_find(sorted_ids, is_jump);
  if (last_possible != sorted_ids.end()) sorted_ids.erase(last_possible + 1, sorted_ids.end());
  if (!sorted_ids.empty() && sorted_ids.back() == no_id) sorted_ids.pop_back();
}

/// A capture. Lists of them are sorted later; a million frames are 24 MB.
struct Capture {
  std::uint64_t session = 0, id = 0;
  std::int64_t received_ns = 0;
  [[nodiscard]] auto key() const noexcept { return std::tie(session, id); }
  friend auto operator<=>(const Capture& a, const Capture& b) noexcept { return a.key() <=> b.key(); }
  friend bool operator==(const Capture& a, const Capture& b) noexcept { return a.key() == b.key(); }
};

/// Counts captures, frames and results, and compares them.
class RunAuditor {
 public:
  RunAuditor(RunAudit& audit, const RecordedMessageVisitor& visit) : audit_(audit), visit_(visit) {}
  /// `channel` is null for a message whose channel is not defined.
  void add(const mcap::Message& message, const mcap::Channel* channel) {
    if (channel == nullptr) return;
    const auto carried = channel_of(*channel);
    if (!carried) {
      ++audit_.undecodable;
      return;
    }
    const RecordedMessage recorded = recorded_message(message, *carried);
    if (recorded.kind == Kind::frame) add_frame(recorded);
    if (recorded.kind == Kind::result) add_result(recorded);
    if (recorded.kind == Kind::state) add_state(recorded);
    if (visit_) visit_(recorded);
  }
  /// A sender at the end of a recording without a matcher.
  void add_sender(const wire::WireSender& sender) { sessions_[sender.session].at_recorder = sender; }
  /// After the last message, when the rest of the audit is complete.
  void close() {
    if (matcher_ && audit_.settings.model_checksum == 0) {  // recorded beside a matcher that was not known at the start
      audit_.settings.model_file = matcher_->model.file;
      audit_.settings.model_checksum = matcher_->model.checksum;
      audit_.settings.method = matcher_->method;
      audit_.settings.components = components_of(*matcher_);
    }
    close_components();
    if (audit_.is_replayed) audit_.counters.reset();
    if (audit_.is_matchers_own() && audit_.counters) audit_.interleaved = audit_.counters->interleaved;
    for (auto& [session, captures] : sessions_) close_session(session, captures);
    for (auto* list : {&frames_, &matched_, &dropped_, &refused_}) std::ranges::sort(*list);
    match_answers();
  }

 private:
  struct Captures {
    std::vector<std::uint64_t> frames, refused, absent;  // ids; absent: missed or withheld, as the matcher reports
    std::optional<std::uint64_t> end;                    // the first id that the sender did not use
    std::optional<wire::WireSender> at_matcher;          // from its latest state
    std::optional<wire::WireSender> at_recorder;
  };

  void add_frame(const RecordedMessage& frame) {
    audit_.start_ns = audit_.frames == 0 ? frame.log_time_ns : std::min(audit_.start_ns, frame.log_time_ns);
    audit_.end_ns = std::max(audit_.end_ns, frame.log_time_ns);
    ++audit_.frames;
    sessions_[frame.session].frames.push_back(frame.id);
    frames_.push_back({frame.session, frame.id, frame.log_time_ns});
  }

  void add_result(const RecordedMessage& message) {
    ++audit_.results;
    if (wire::decode_result(message.data, result_) != wire::WireStatus::ok) {
      ++audit_.undecodable;
      return;
    }
    ++audit_.results_by_status[std::string(wire::to_string(result_.status))];
    update_counters(result_.sequence, result_.counters);
    if (!result_.component.empty()) return add_of_component();
    wire::for_each_frame(result_, [this](std::uint64_t session, std::uint64_t id, wire::WireStatus status) {
      add_answer({session, id, result_.receive_ns}, status);
    });
  }

  /// The results of a frame's components are one answer: it is matched if any component is.
  void add_of_component() {
    const Capture capture{result_.session, result_.frame_id, result_.receive_ns};
    if (!of_components_ || of_components_->first != capture) {
      close_components();
      of_components_ = {capture, result_.status};
    } else if (wire::fate_of(result_.status) == wire::Fate::matched) {
      of_components_->second = result_.status;
    }
  }
  void close_components() {
    if (of_components_) add_answer(of_components_->first, of_components_->second);
    of_components_.reset();
  }

  void add_answer(const Capture& capture, wire::WireStatus status) {
    const wire::Fate fate = wire::fate_of(status);
    Captures& captures = sessions_[capture.session];
    const bool is_absent = status == wire::WireStatus::missed || status == wire::WireStatus::withheld;
    if (fate == wire::Fate::not_a_capture) captures.end = capture.id;
    if (fate == wire::Fate::matched) matched_.push_back(capture);
    if (fate == wire::Fate::dropped && !is_absent) dropped_.push_back(capture);
    if (is_absent) captures.absent.push_back(capture.id);
    if (fate != wire::Fate::rejected) return;
    refused_.push_back(capture);
    captures.refused.push_back(capture.id);
  }

  void add_state(const RecordedMessage& message) {
    ++audit_.states;
    if (wire::decode_state(message.data, state_) != wire::WireStatus::ok) {
      ++audit_.undecodable;
      return;
    }
    update_counters(state_.sequence, state_.counters);
    for (const wire::WireSender& sender : state_.senders) sessions_[sender.session].at_matcher = sender;
    if (!matcher_ && state_.model.checksum != 0) matcher_ = state_;
  }

  void update_counters(std::uint64_t sequence, const wire::Counters& counters) {
    if (audit_.counters && sequence < last_sequence_) return;
    last_sequence_ = sequence;
    audit_.counters = counters;
  }

  /// A message without a cloud has no frame and is not missing either. Captures from before the start of a recorder
  /// that is not the matcher are not counted as missing.
  void close_session(std::uint64_t id, Captures& captures) {
    const std::uint64_t frames = captures.frames.size();
    sort_unique(captures.frames);
    sort_unique(captures.absent);
    const std::uint64_t distinct = captures.frames.size();
    std::optional<wire::WireSender> sender = audit_.is_matchers_own() ? captures.at_matcher : std::nullopt;
    if (captures.at_recorder && !audit_.window) sender = captures.at_recorder;
    const bool is_known = sender.has_value();
    if (frames == 0 && captures.absent.empty() && !is_known) return;
    sort_unique(captures.refused);
    std::vector<std::uint64_t> came;
    std::ranges::set_union(captures.frames, captures.refused, std::back_inserter(came));
    drop_impossible(came);
    Range range;
    range.widen(came);
    range.widen(captures.absent);
    if (captures.end) range.widen(range.first, *captures.end);
    if (is_known) range.widen(sender->first_id, sender->next_id);
    if (range.past_last == 0) return;
    const bool silent = is_known && sender->condition == wire::SenderCondition::silent;
    const bool ended = captures.end.has_value() || (is_known && sender->condition == wire::SenderCondition::ended);
    audit_.sessions[id] = {
        range.first, range.past_last - 1, frames, range.past_last - range.first - came.size(), frames - distinct, ended,
        silent};
  }

  void match_answers() {
    if (audit_.is_replayed) return;
    const auto answers = merged(matched_, dropped_);
    const auto unanswered = in_first_only(frames_, merged(answers, refused_)), alone = in_first_only(answers, frames_);
    const auto is_before_window = [&](const Capture& answer) {
      return audit_.window && answer.received_ns < audit_.window->begin_ns;
    };
    const std::int64_t last_ns = audit_.window ? last_matched_ns() : 0;
    const auto is_cut_off = [&](const Capture& frame) { return audit_.window && frame.received_ns > last_ns; };
    const auto before = static_cast<std::uint64_t>(std::ranges::count_if(alone, is_before_window));
    const auto after = static_cast<std::uint64_t>(std::ranges::count_if(unanswered, is_cut_off));
    audit_.answers_alone = alone.size() - before;
    if (audit_.results == 0) return;
    audit_.unanswered = unanswered.size() - after;
    audit_.cut_apart = before + after;
  }

  /// The last frame with a result. Frames are matched in order, so results of later frames were published later.
  std::int64_t last_matched_ns() const {
    std::int64_t last = std::numeric_limits<std::int64_t>::min();
    for (const Capture& frame : frames_)
      if (std::ranges::binary_search(matched_, frame)) last = std::max(last, frame.received_ns);
    return last;
  }

  RunAudit& audit_;
  const RecordedMessageVisitor& visit_;
  std::map<std::uint64_t, Captures> sessions_;
  std::vector<Capture> frames_, matched_, dropped_, refused_;
  std::optional<std::pair<Capture, wire::WireStatus>> of_components_;  // of the latest frame
  std::uint64_t last_sequence_ = 0;
  std::optional<wire::WireState> matcher_;  // the first state of a matcher
  wire::WireResult result_;
  wire::WireState state_;
};

template <class Number>
Number number_in(const mcap::Texts& texts, std::string_view key) {
  const auto found = texts.find(std::string(key));
  return found == texts.end() ? 0 : parsed<Number>(found->second).value_or(0);
}

void read_closing(RunAudit& audit, const mcap::Texts& texts) {
  audit.has_closing_metadata = true;
  for (const auto& [key, text] : texts)
    if (key.find("lost") != std::string::npos || key == "failed_syncs")
      audit.lost += number_in<std::uint64_t>(texts, key);
  const auto triggered = texts.find(std::string(triggered_key));
  if (triggered == texts.end()) return;
  audit.window = {triggered->second == "yes", number_in<std::int64_t>(texts, window_begin_key),
                  number_in<std::uint64_t>(texts, frames_outside_key)};
}

void read_metadata(RunAudit& audit, const std::string& file) {
  audit.is_run = audit.file.header.profile == recording_profile;
  audit.is_replayed = audit.file.header.profile == results_profile;
  for (const mcap::Metadata& metadata : audit.file.metadata) read(metadata, audit.settings, file);
  if (audit.is_run && !audit.settings.record_window.empty())
    audit.window.emplace(RunAudit::Window{true});  // unless the closing metadata differ
  for (const mcap::Metadata& metadata : audit.file.metadata)
    if (metadata.name == closing_metadata_name) read_closing(audit, metadata.texts);
}

}  // namespace

RunAudit audit_run(const std::filesystem::path& file, const RecordedMessageVisitor& visit) {
  RunAudit audit;
  RunAuditor auditor(audit, visit);
  const mcap::FileSource source(file);
  audit.file = mcap::check_file(
      source, [&](const mcap::Message& message, const mcap::Channel* channel) { auditor.add(message, channel); });
  read_metadata(audit, source.name());
  for (const mcap::Metadata& metadata : audit.file.metadata)
    if (metadata.name == senders_metadata_name) {
      audit.interleaved = number_in<std::uint64_t>(metadata.texts, interleaved_key);
      for (const wire::WireSender& sender : senders_from(metadata)) auditor.add_sender(sender);
    }
  auditor.close();
  return audit;
}

}  // namespace lbea::tool
