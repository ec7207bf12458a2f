#include "tools/replay/comparison.hpp"

#include "adapters/wire/codec/codec.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

/// Without everything that differs between runs.
std::vector<std::byte> bytes_of(wire::WireResult result) {
  result.sequence = 0;
  result.elapsed_ns = {};
  result.counters = {};
  result.publish_ns = result.receive_ns = 0;
  result.model_checksum = 0;  // a comparison may use another model
  wire::Encoder encoder;
  const auto bytes = encoder.result(result);
  return {bytes.begin(), bytes.end()};
}

/// Neither the end of the stream nor a capture without a frame.
bool is_of_a_frame(wire::WireStatus status) {
  return wire::fate_of(status) != wire::Fate::not_a_capture && status != wire::WireStatus::missed &&
         status != wire::WireStatus::withheld;
}

double relative_difference(double a, double b) {
  if (a == b) return 0;
  const double scale = std::max(std::abs(a), std::abs(b));
  return std::isfinite(scale) ? std::abs(a - b) / scale : 1;
}

double best_distance_difference(const wire::WireResult& a, const wire::WireResult& b) {
  if (a.matches.empty() || b.matches.empty()) return a.matches.empty() == b.matches.empty() ? 0 : 1;
  return relative_difference(a.matches[0].distance, b.matches[0].distance);
}

// Compares simulation names, because another model may have other numbers.
bool has_same_match(const wire::WireResult& a, const wire::WireResult& b) {
  if (a.matches.empty() || b.matches.empty()) return a.matches.empty() == b.matches.empty();
  return a.matches[0].simulation_name == b.matches[0].simulation_name &&
         a.matches[0].sample.time_step == b.matches[0].sample.time_step;
}

std::string text(const wire::WireResult& result) {
  std::string words(wire::to_string(result.status));
  words += ", " + std::string(wire::to_string(result.verdict));
  if (result.matches.empty()) return words;
  const wire::WireMatch& best = result.matches[0];
  return words + ", " + best.simulation_name + " step " + std::to_string(best.sample.time_step) + " at " +
         std::to_string(best.distance);
}

}  // namespace

ResultComparison::ResultComparison(RecordedRun& run, double tolerance) : tolerance_(tolerance) {
  std::vector<Key> frames;
  wire::WireResult result;
  wire::WireState state;
  while (const auto message = run.next()) {
    if (message->kind == RecordedMessage::Kind::state &&
        wire::decode_state(message->data, state) == wire::WireStatus::ok)
      for (const wire::WireSender& sender : state.senders) first_ids_[sender.session] = sender.first_id;
    if (message->kind == RecordedMessage::Kind::frame) frames.emplace_back(message->session, message->id);
    if (message->kind != RecordedMessage::Kind::result) continue;
    if (wire::decode_result(message->data, result) != wire::WireStatus::ok)
      throw Error(Status::bad_input, "a recorded result cannot be decoded; it may be from another version");
    if (!is_of_a_frame(result.status)) continue;
    Answers& answers = recorded_[{result.session, result.frame_id}];
    if (answers.results.empty()) answers.first = result.status;
    answers.results.push_back(result);
  }
  find_sessions(frames);
  find_lost_history(frames);
}

namespace {

/// What depends on earlier frames: with fit, the state of the test and every match.
void leave_out_history(wire::WireResult& result) {
  result.test = {};
  result.fit = {};
  result.matches.clear();
  result.coverage = 0;
  result.leading_coordinates = {};
  result.points = {.received = result.points.received};
  result.verdict = {};
  result.status = wire::WireStatus::ok;
}

}  // namespace

void ResultComparison::find_sessions(const std::vector<Key>& frames) {
  for (const Key& frame : frames) {
    if (!recorded_.contains(frame)) continue;
    Session& session = sessions_.try_emplace(frame.first, Session{frame.second, frame.second, false}).first->second;
    session.first_id = std::min(session.first_id, frame.second);
    session.last_id = std::max(session.last_id, frame.second);
  }
}

// Either the matcher had earlier frames of the session, or a result sums up more frames than are recorded since the
// start of the test.
void ResultComparison::find_lost_history(const std::vector<Key>& frames) {
  for (auto& [number, session] : sessions_)
    if (const auto first = first_ids_.find(number); first != first_ids_.end() && first->second < session.first_id)
      session.began_before = true;
  std::uint64_t session = 0, frames_of_test = 0;
  for (const Key& frame : frames) {
    if (std::exchange(session, frame.first) != frame.first) frames_of_test = 0;
    if (!was_dropped(frame.first, frame.second)) ++frames_of_test;
    const auto found = recorded_.find(frame);
    if (found == recorded_.end()) continue;
    for (const wire::WireResult& result : found->second.results)
      if (result.test.frames > frames_of_test) sessions_.at(frame.first).began_before = true;
  }
}

bool ResultComparison::is_at_edge(const Key& key) const {
  const auto session = sessions_.find(key.first);
  return session == sessions_.end() || !session->second.holds(key.second);
}

bool ResultComparison::was_dropped(std::uint64_t session, std::uint64_t id) const {
  const auto found = recorded_.find({session, id});
  return found != recorded_.end() && wire::fate_of(found->second.first) == wire::Fate::dropped;
}

bool ResultComparison::is_same(const wire::WireResult& recorded, const wire::WireResult& now) const {
  if (tolerance_ == 0) return bytes_of(recorded) == bytes_of(now);
  return recorded.status == now.status && recorded.verdict == now.verdict && has_same_match(recorded, now) &&
         best_distance_difference(recorded, now) <= tolerance_ &&
         relative_difference(recorded.coverage, now.coverage) <= tolerance_;
}

std::optional<std::string> ResultComparison::compare(const wire::WireResult& result) {
  const std::string name = "frame " + std::to_string(result.frame_id) + ": ";
  const Key key{result.session, result.frame_id};
  const auto found = recorded_.find(key);
  if (found == recorded_.end() && is_at_edge(key)) {
    ++tally_.edge_frames;
    return std::nullopt;
  }
  if (found == recorded_.end() || found->second.results.empty()) {
    ++tally_.not_recorded;
    return name + "no result is recorded; now " + text(result);
  }
  wire::WireResult now = result;
  auto& results = found->second.results;
  if (const auto session = sessions_.find(key.first);
      session->second.began_before && (now.test.frames > 0 || results.front().test.frames > 0)) {
    leave_out_history(now);
    for (wire::WireResult& then : results) leave_out_history(then);
    ++tally_.without_history;
  }
  auto place = std::ranges::find_if(results, [&](const wire::WireResult& then) { return is_same(then, now); });
  if (place == results.end()) place = results.begin();
  const wire::WireResult then = *place;
  results.erase(place);
  tally_.worst_distance = std::max(tally_.worst_distance, best_distance_difference(then, now));
  if (is_same(then, now)) {
    ++tally_.same;
    return std::nullopt;
  }
  ++tally_.different;
  if (!has_same_match(then, now)) ++tally_.other_match;
  if (then.status != now.status || then.verdict != now.verdict) ++tally_.other_status;
  return name + "then " + text(then) + "; now " + text(now);
}

ComparisonTally ResultComparison::tally() const {
  ComparisonTally tally = tally_;
  for (const auto& [key, answers] : recorded_) {
    // Dropped frames are not matched again, and rejected ones may have no cloud.
    (is_at_edge(key) ? tally.edge_results : tally.not_repeated) += static_cast<std::uint64_t>(
        std::ranges::count(answers.results, wire::Fate::matched,
                           [](const wire::WireResult& result) { return wire::fate_of(result.status); }));
  }
  return tally;
}

}  // namespace lbea::tool
