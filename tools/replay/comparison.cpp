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

bool is_close(double a, double b, double largest_difference) {
  return a == b || (std::isnan(a) && std::isnan(b)) || std::abs(a - b) <= largest_difference;
}

bool is_close(const ChannelValue& a, const ChannelValue& b, double largest_difference) {
  return is_close(double{a.value}, double{b.value}, largest_difference) &&
         is_close(double{a.bound_90}, double{b.bound_90}, largest_difference);
}

std::string text(const wire::WireChannel& channel) {
  const auto words = [](const ChannelValue& value) {
    return std::to_string(value.value) + " +- " + std::to_string(value.bound_90);
  };
  return words(channel) + " " + channel.unit +
         (std::isnan(channel.end.value) ? "" : ", at the end " + words(channel.end));
}

std::string name_of(const wire::WireResult& result) {
  return "frame " + std::to_string(result.frame_id) + (result.component.empty() ? "" : ", " + result.component) + ": ";
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

ResultComparison::ResultComparison(RecordedRun& run, const FrameFates& fates, double tolerance, bool has_history)
    : fates_(fates), tolerance_(tolerance), has_history_(has_history) {
  wire::WireResult result;
  run.rewind();
  while (const auto message = run.next()) {
    if (message->kind != RecordedMessage::Kind::result) continue;
    if (wire::decode_result(message->data, result) != wire::WireStatus::ok)
      throw Error(Status::bad_input, "a recorded result cannot be decoded; it may be from another version");
    // Versions up to 0.1 gave the verdict `matched` to every match by lbea and vtp.
    if (result.fit.candidates.empty() && result.verdict == wire::WireVerdict::matched)
      result.verdict = wire::WireVerdict::unknown;
    for (const wire::WireChannel& channel : result.channels)
      if (std::isfinite(channel.value))
        channel_scales_[channel.name] = std::max(channel_scales_[channel.name], std::abs(double{channel.value}));
    if (is_of_a_frame(result.status))
      recorded_[{{result.session, result.frame_id}, result.component}].push_back(result);
  }
}

bool ResultComparison::is_same(const wire::WireResult& recorded, const wire::WireResult& now) const {
  if (tolerance_ == 0) return bytes_of(recorded) == bytes_of(now);
  return recorded.status == now.status && recorded.verdict == now.verdict && has_same_match(recorded, now) &&
         best_distance_difference(recorded, now) <= tolerance_ &&
         relative_difference(recorded.coverage, now.coverage) <= tolerance_ && different_channel(recorded, now).empty();
}

std::string ResultComparison::different_channel(const wire::WireResult& then, const wire::WireResult& now) const {
  for (const wire::WireChannel& channel : now.channels)
    if (std::ranges::find(then.channels, channel.name, &wire::WireChannel::name) == then.channels.end())
      return "channel \"" + channel.name + "\" is not recorded";
  for (const wire::WireChannel& a : then.channels) {
    const auto found = std::ranges::find(now.channels, a.name, &wire::WireChannel::name);
    if (found == now.channels.end()) return "channel \"" + a.name + "\" is missing now";
    const auto scale = channel_scales_.find(a.name);
    const double most = scale == channel_scales_.end() ? 0 : tolerance_ * scale->second;
    if (a.unit != found->unit || !is_close(a, *found, most) || !is_close(a.end, found->end, most))
      return "channel \"" + a.name + "\" then " + text(a) + ", now " + text(*found);
  }
  return "";
}

wire::WireResult ResultComparison::take(std::vector<wire::WireResult>& results, const wire::WireResult& now) const {
  auto place = std::ranges::find_if(results, [&](const wire::WireResult& then) { return is_same(then, now); });
  if (place == results.end()) place = results.begin();
  wire::WireResult then = std::move(*place);
  results.erase(place);
  return then;
}

std::optional<std::string> ResultComparison::compare(const wire::WireResult& result) {
  const FrameKey key{result.session, result.frame_id};
  const auto found = recorded_.find({key, result.component});
  if (found == recorded_.end() && fates_.is_at_edge(key)) {
    ++tally_.edge_frames;
    return std::nullopt;
  }
  if (found == recorded_.end() || found->second.empty()) {
    ++tally_.not_recorded;
    return name_of(result) + "no result is recorded; now " + text(result);
  }
  const wire::WireResult then = take(found->second, result);
  if (has_history_ && fates_.lacks_history(key)) {
    ++tally_.without_history;
    return std::nullopt;
  }
  return compare(then, result);
}

std::optional<std::string> ResultComparison::compare(const wire::WireResult& then, const wire::WireResult& now) {
  tally_.worst_distance = std::max(tally_.worst_distance, best_distance_difference(then, now));
  if (is_same(then, now)) {
    ++tally_.same;
    return std::nullopt;
  }
  ++tally_.different;
  if (!has_same_match(then, now)) ++tally_.other_match;
  if (then.status != now.status || then.verdict != now.verdict) ++tally_.other_status;
  const std::string channel = different_channel(then, now);
  if (!channel.empty()) ++tally_.other_channels;
  return name_of(now) + "then " + text(then) + "; now " + text(now) + (channel.empty() ? "" : "; " + channel);
}

ComparisonTally ResultComparison::tally() const {
  ComparisonTally tally = tally_;
  for (const auto& [key, results] : recorded_) {
    // Dropped frames are not matched again, and rejected ones may have no cloud.
    (fates_.is_at_edge(key.first) ? tally.edge_results : tally.not_repeated) +=
        static_cast<std::uint64_t>(std::ranges::count(
            results, wire::Fate::matched, [](const wire::WireResult& result) { return wire::fate_of(result.status); }));
  }
  return tally;
}

}  // namespace lbea::tool
