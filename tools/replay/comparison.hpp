// Compares recorded results with new ones, frame by frame.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <map>
#include <optional>

namespace lbea::tool {

struct ComparisonTally {
  std::uint64_t same = 0;  // equal in every bit, or within the tolerance
  std::uint64_t different = 0;
  std::uint64_t other_match = 0;   // of these: another best sample
  std::uint64_t other_status = 0;  // of these: another status or verdict
  std::uint64_t not_recorded = 0;  // new results without a recorded one
  std::uint64_t not_repeated = 0;  // recorded results without a new one
  // The same two, but before the first or after the last frame that is recorded with its result in a session: the edges
  // of a window.
  std::uint64_t edge_frames = 0, edge_results = 0;
  std::uint64_t without_history = 0;  // compared without what the test sums up, because it began before the recording
  double worst_distance = 0;          // largest relative difference of the best distances
  [[nodiscard]] std::uint64_t compared() const noexcept { return same + different; }
  [[nodiscard]] bool is_same() const noexcept { return different == 0 && not_recorded == 0 && not_repeated == 0; }
};

class ResultComparison {
 public:
  /// Reads the frames' ids and the results of `run`. With tolerance 0, results must be equal in every bit except
  /// timings, counters and the model's checksum. Otherwise status, verdict and best sample must be equal, and the best
  /// distance and the coverage may differ by this share.
  ResultComparison(RecordedRun& run, double tolerance);
  /// Whether a frame was dropped because the queue was full, so that it has no result to compare with.
  [[nodiscard]] bool was_dropped(std::uint64_t session, std::uint64_t id) const;
  /// A sentence about the difference, if there is one.
  std::optional<std::string> compare(const wire::WireResult& result);
  /// After the last new result.
  [[nodiscard]] ComparisonTally tally() const;

 private:
  using Key = std::pair<std::uint64_t, std::uint64_t>;  // session, id
  struct Answers {
    std::vector<wire::WireResult> results;  // several for a repeated id, in any order; compared ones are removed
    wire::WireStatus first{};
  };
  /// The ids for which both frame and result are recorded.
  struct Session {
    std::uint64_t first_id = 0, last_id = 0;
    bool began_before = false;  // the first frames of the test are not recorded
    [[nodiscard]] bool holds(std::uint64_t id) const noexcept { return id >= first_id && id <= last_id; }
  };
  /// `frames`: in the order of the recording.
  void find_sessions(const std::vector<Key>& frames);
  void find_lost_history(const std::vector<Key>& frames);
  /// Before the first or after the last frame of its session that is recorded with its result.
  [[nodiscard]] bool is_at_edge(const Key& key) const;
  [[nodiscard]] bool is_same(const wire::WireResult& recorded, const wire::WireResult& now) const;
  double tolerance_;
  std::map<Key, Answers> recorded_;
  std::map<std::uint64_t, Session> sessions_;
  std::map<std::uint64_t, std::uint64_t> first_ids_;  // of each session, from the matcher's states
  ComparisonTally tally_;
};

}  // namespace lbea::tool
