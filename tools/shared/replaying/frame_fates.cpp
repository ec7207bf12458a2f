#include "tools/shared/replaying/frame_fates.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <algorithm>

namespace lbea::tool {

FrameFates::FrameFates(RecordedRun& run) {
  std::vector<FrameKey> frames;  // in the order of the recording
  wire::WireResult result;
  wire::WireState state;
  run.rewind();
  while (const auto message = run.next()) {
    if (message->kind == RecordedMessage::Kind::frame) {
      frames.emplace_back(message->session, message->id);
      fates_[frames.back()].has_frame = true;
      ++frames_[message->session];
      most_bytes_ = std::max(most_bytes_, message->data.size());
    } else if (message->kind == RecordedMessage::Kind::result) {
      if (wire::decode_result(message->data, result) == wire::WireStatus::ok) add(result);
    } else if (message->kind == RecordedMessage::Kind::state) {
      if (wire::decode_state(message->data, state) == wire::WireStatus::ok) add(state);
    }
  }
  for (const RecordedCapture& capture : captures_) {
    fates_[capture.key].has_frame =
        std::ranges::all_of(capture.frames, [this](const FrameKey& frame) { return has_frame(frame); });
    if (has_frame(capture.key)) frames.push_back(capture.key);
  }
  find_sessions();
  find_series(frames);
}

void FrameFates::add(const wire::WireResult& result) {
  if (!result.rigs.empty()) add_capture(result);
  wire::for_each_frame(result, [&](std::uint64_t session, std::uint64_t id, wire::WireStatus status) {
    add({session, id}, status, result);
  });
}

void FrameFates::add_capture(const wire::WireResult& result) {
  RecordedCapture& capture = captures_.emplace_back();
  capture.key = {result.session, result.frame_id};
  capture.receive_ns = result.receive_ns;
  for (const wire::WireRigFrame& frame : result.rigs) {
    capture.frames.emplace_back(frame.session, frame.frame_id);
    capture.rigs.push_back(frame.rig);
  }
  add(capture.key, result.status, result);
}

void FrameFates::add(const FrameKey& frame, wire::WireStatus status, const wire::WireResult& result) {
  const wire::Fate fate_now = wire::fate_of(status);
  if (fate_now == wire::Fate::not_a_capture)
    return void(ends_[frame.first].push_back({frame.second, result.receive_ns}));
  Fate& fate = fates_[frame];
  const bool is_absent = status == wire::WireStatus::missed || status == wire::WireStatus::withheld;
  fate.is_absent |= is_absent;
  fate.is_dropped |= fate_now == wire::Fate::dropped && !is_absent;
  const bool is_searched = fate_now == wire::Fate::matched || status == wire::WireStatus::empty_frame;
  fate.is_rejected |= fate_now == wire::Fate::rejected && !is_searched;
  if (!is_searched) return;
  fate.is_searched = true;
  fate.receive_ns = result.receive_ns;
  const bool is_alone = frame == FrameKey{result.session, result.frame_id};  // or a capture
  if (is_alone) fate.frames_of_test = std::max(fate.frames_of_test, result.test.frames);
}

void FrameFates::add(const wire::WireState& state) {
  for (const wire::WireSender& sender : state.senders) senders_.try_emplace(sender.session, sender);
}

void FrameFates::find_sessions() {
  for (const auto& [key, fate] : fates_) {
    if (!fate.has_frame || !fate.is_answered()) continue;
    Session& session = sessions_.try_emplace(key.first, Session{key.second, key.second}).first->second;
    session.last_id = key.second;  // ascending
  }
  for (const auto& [number, sender] : senders_)
    if (const auto session = sessions_.find(number);
        session != sessions_.end() &&
        sender.received <= count(sender, [](const FrameKey&, const Fate& fate) { return fate.is_answered(); }))
      first_arrived_id_[number] = session->second.first_id;
}

template <class Property>
std::uint64_t FrameFates::count(const wire::WireSender& sender, const Property& has) const {
  const auto begin = fates_.lower_bound({sender.session, 0}),
             end = fates_.lower_bound({sender.session, sender.next_id});
  return static_cast<std::uint64_t>(
      std::count_if(begin, end, [&](const auto& item) { return has(item.first, item.second); }));
}

// A frame that lbea-record recorded before there was a matcher has no result.
bool FrameFates::never_arrived(const FrameKey& key, const Fate& fate) const {
  if (fate.is_answered()) return false;
  if (fate.is_absent) return true;
  const auto first = first_arrived_id_.find(key.first);
  return first != first_arrived_id_.end() && key.second < first->second;
}

bool FrameFates::has_frame(const FrameKey& frame) const {
  const auto found = fates_.find(frame);
  return found != fates_.end() && found->second.has_frame;
}

bool FrameFates::was_dropped(const FrameKey& frame) const {
  const auto found = fates_.find(frame);
  if (found == fates_.end() || found->second.is_searched) return false;
  return found->second.is_dropped || never_arrived(frame, found->second);
}

// The matcher's clock tells the order of a frame and an end; without it, the ids do.
TestKey FrameFates::test_of(const FrameKey& frame) const {
  const auto ends = ends_.find(frame.first);
  if (ends == ends_.end()) return {frame.first, 0};
  const auto found = fates_.find(frame);
  const bool is_searched = found != fates_.end() && found->second.is_searched;
  const auto is_before = [&](const End& end) {
    return is_searched ? end.receive_ns < found->second.receive_ns : end.next_id <= frame.second;
  };
  return {frame.first, static_cast<std::uint64_t>(std::ranges::count_if(ends->second, is_before))};
}

std::uint64_t FrameFates::ends_before(std::uint64_t session, const FrameKey& frame) const {
  const auto ends = ends_.find(session);
  const auto found = fates_.find(frame);
  if (ends == ends_.end() || found == fates_.end() || !found->second.is_searched) return 0;
  return static_cast<std::uint64_t>(
      std::ranges::count_if(ends->second, [&](const End& end) { return end.receive_ns < found->second.receive_ns; }));
}

std::uint64_t FrameFates::frames_of(std::uint64_t session) const {
  const auto found = frames_.find(session);
  return found == frames_.end() ? 0 : found->second;
}

bool FrameFates::is_at_edge(const FrameKey& frame) const {
  const auto session = sessions_.find(frame.first);
  return session == sessions_.end() || frame.second < session->second.first_id ||
         frame.second > session->second.last_id;
}

bool FrameFates::lacks_history(const FrameKey& frame) const {
  const auto found = fates_.find(frame);
  return found != fates_.end() && found->second.series && series_[*found->second.series].lacks_history;
}

// A result that sums up more frames than are recorded tells that some are not.
void FrameFates::find_series(const std::vector<FrameKey>& frames) {
  for (const FrameKey& frame : frames) {
    Fate& fate = fates_.at(frame);
    if (fate.series || was_dropped(frame) || (fate.is_rejected && !fate.is_searched)) continue;
    const TestKey test = test_of(frame);
    if (series_.empty() || series_.back().test != test) series_.push_back({test, frame.second});
    fate.series = series_.size() - 1;
    Series& series = series_.back();
    series.lacks_history |= fate.frames_of_test > ++series.frames;
  }
  if (!series_.empty()) series_.front().lacks_history |= has_begun_before(series_.front());
}

// Only the first test: each later one begins within the recording.
bool FrameFates::has_begun_before(const Series& first) const {
  if (first.test.second > 0) return false;
  if (const auto sender = senders_.find(first.test.first); sender != senders_.end())
    if (had_unrecorded_frames(sender->second)) return true;
  return std::ranges::any_of(fates_, [&](const auto& item) {
    const auto& [key, fate] = item;
    return key.first == first.test.first && fate.is_searched && !fate.has_frame && key.second < first.first_id &&
           test_of(key) == first.test;
  });
}

// Frames that were rejected or dropped leave no trace in a test.
bool FrameFates::had_unrecorded_frames(const wire::WireSender& sender) const {
  return sender.received > count(sender, [&](const FrameKey& key, const Fate& fate) {
           return fate.is_rejected || fate.is_dropped || (fate.has_frame && !never_arrived(key, fate));
         });
}

}  // namespace lbea::tool
