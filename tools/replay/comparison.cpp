#include "tools/replay/comparison.hpp"

#include "adapters/wire/codec.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {

namespace {

std::vector<std::byte> bytes_of(const WireResult& result) {
  Encoder encoder;
  WireResult bare = without_timings(result);
  bare.receive_ns = 0;
  bare.model_checksum = 0;  // another model is what comparisons are for
  const auto bytes = encoder.result(bare);
  return {bytes.begin(), bytes.end()};
}

/// Not of the stream's end, nor of a capture of which no frame came.
bool is_of_a_frame(WireStatus status) {
  return fate_of(status) != Fate::not_a_capture && status != WireStatus::missed && status != WireStatus::withheld;
}

double relative_difference(double a, double b) {
  if (a == b) return 0;
  const double scale = std::max(std::abs(a), std::abs(b));
  return std::isfinite(scale) ? std::abs(a - b) / scale : 1;
}

double best_distance_difference(const WireResult& a, const WireResult& b) {
  if (a.matches.empty() || b.matches.empty()) return a.matches.empty() == b.matches.empty() ? 0 : 1;
  return relative_difference(a.matches[0].distance, b.matches[0].distance);
}

// Simulations are told by their names: another model may number them in another way.
bool has_same_match(const WireResult& a, const WireResult& b) {
  if (a.matches.empty() || b.matches.empty()) return a.matches.empty() == b.matches.empty();
  return a.matches[0].simulation_name == b.matches[0].simulation_name &&
         a.matches[0].sample.time_step == b.matches[0].sample.time_step;
}

std::string text(const WireResult& result) {
  std::string words(to_string(result.status));
  words += ", " + std::string(to_string(result.verdict));
  if (result.matches.empty()) return words;
  const WireMatch& best = result.matches[0];
  return words + ", " + best.simulation_name + " step " + std::to_string(best.sample.time_step) + " at " + std::to_string(best.distance);
}

}  // namespace

WireResult without_timings(WireResult result) {
  result.sequence = 0;
  result.elapsed_ns = {};
  result.counters = {};
  result.publish_ns = 0;
  return result;
}

Comparison::Comparison(RecordedRun& run, double tolerance) : tolerance_(tolerance) {
  WireResult result;
  while (const auto message = run.next()) {
    if (message->kind != RecordedMessage::Kind::result) continue;
    if (decode_result(message->data, result) != WireStatus::ok)
      throw Error(Status::bad_input, "a recorded result cannot be decoded; it may be of another version");
    if (!is_of_a_frame(result.status)) continue;
    Answers& answers = recorded_[{result.session, result.frame_id}];
    if (answers.results.empty()) answers.first = result.status;
    answers.results.push_back(result);
  }
}

bool Comparison::was_dropped(std::uint64_t session, std::uint64_t id) const {
  const auto found = recorded_.find({session, id});
  return found != recorded_.end() && fate_of(found->second.first) == Fate::dropped;
}

bool Comparison::is_same(const WireResult& recorded, const WireResult& now) const {
  if (tolerance_ == 0) return bytes_of(recorded) == bytes_of(now);
  return recorded.status == now.status && recorded.verdict == now.verdict && has_same_match(recorded, now) &&
         best_distance_difference(recorded, now) <= tolerance_ && relative_difference(recorded.coverage, now.coverage) <= tolerance_;
}

std::optional<std::string> Comparison::take(const WireResult& now) {
  const std::string name = "frame " + std::to_string(now.frame_id) + ": ";
  const auto found = recorded_.find({now.session, now.frame_id});
  if (found == recorded_.end() || found->second.results.empty()) {
    ++tally_.not_recorded;
    return name + "no result is recorded; now " + text(now);
  }
  auto& results = found->second.results;
  auto place = std::ranges::find_if(results, [&](const WireResult& then) { return is_same(then, now); });
  if (place == results.end()) place = results.begin();
  const WireResult then = *place;
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

ComparisonTally Comparison::tally() const {
  ComparisonTally tally = tally_;
  for (const auto& [key, answers] : recorded_) {
    // Frames that were dropped then are not asked again, and of rejected ones there may be no cloud.
    tally.not_repeated += static_cast<std::uint64_t>(
        std::ranges::count(answers.results, Fate::matched, [](const WireResult& result) { return fate_of(result.status); }));
  }
  return tally;
}

}  // namespace lbea
