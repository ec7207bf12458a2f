// Compares recorded results with new ones, frame by frame.
#pragma once

#include "tools/shared/replaying/frame_fates.hpp"

namespace lbea::tool {

struct ComparisonTally {
  std::uint64_t same = 0;  // equal in every bit, or within the tolerance
  std::uint64_t different = 0;
  std::uint64_t other_match = 0;     // of these: another best sample
  std::uint64_t other_status = 0;    // of these: another status or verdict
  std::uint64_t other_channels = 0;  // of these: other quantities of interest
  std::uint64_t not_recorded = 0;    // new results without a recorded one
  std::uint64_t not_repeated = 0;    // recorded results without a new one
  // The same two, but before the first or after the last frame that is recorded with its result in a session: the edges
  // of a window.
  std::uint64_t edge_frames = 0, edge_results = 0;
  std::uint64_t without_history = 0;  // not compared: they depend on earlier frames that are not recorded
  double worst_distance = 0;          // largest relative difference of the best distances
  [[nodiscard]] std::uint64_t compared() const noexcept { return same + different; }
  [[nodiscard]] bool is_same() const noexcept { return different == 0 && not_recorded == 0 && not_repeated == 0; }
};

class ResultComparison {
 public:
  /// Reads the results of `run`. With tolerance 0, results must be equal in every bit except timings, counters and the
  /// model's checksum. Otherwise status, verdict, best sample, and names and units of channels must be equal; the best
  /// distance and the coverage may differ by this share, channels by this share of their largest recorded magnitude.
  /// `has_history`: the new results depend on the earlier frames of their test. `fates` must remain.
  ResultComparison(RecordedRun& run, const FrameFates& fates, double tolerance, bool has_history);
  /// A sentence about the difference, if there is one.
  std::optional<std::string> compare(const wire::WireResult& result);
  /// After the last new result.
  [[nodiscard]] ComparisonTally tally() const;

 private:
  [[nodiscard]] bool is_same(const wire::WireResult& recorded, const wire::WireResult& now) const;
  /// Removes the recorded result that is the same as `now`, or else the first. There must be one.
  wire::WireResult take(std::vector<wire::WireResult>& results, const wire::WireResult& now) const;
  std::optional<std::string> compare(const wire::WireResult& then, const wire::WireResult& now);
  /// The first channel that differs, as words; empty: none.
  [[nodiscard]] std::string different_channel(const wire::WireResult& then, const wire::WireResult& now) const;
  const FrameFates& fates_;
  double tolerance_;
  bool has_history_;
  std::map<std::string, double> channel_scales_;                 // by name: the largest recorded magnitude
  using ResultKey = std::pair<FrameKey, std::string>;            // the latter: component
  std::map<ResultKey, std::vector<wire::WireResult>> recorded_;  // several for a repeated id; compared ones are removed
  ComparisonTally tally_;
};

}  // namespace lbea::tool
