// Recorded results against new ones, frame by frame.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/recording/recorded_run.hpp"

#include <map>
#include <optional>

namespace lbea::tool {

struct ComparisonTally {
  std::uint64_t same = 0;  // to the last bit, or within the tolerance
  std::uint64_t different = 0;
  std::uint64_t other_match = 0;   // of these: another best sample
  std::uint64_t other_status = 0;  // of these: another status or verdict
  std::uint64_t not_recorded = 0;  // new results to which there is none in the recording
  std::uint64_t not_repeated = 0;  // recorded results of frames to which there is no new one
  std::uint64_t edge_frames =
      0;  // the same two before the first and behind the last frame of a session that is recorded
  std::uint64_t edge_results = 0;     // with its result: where a window begins and ends
  std::uint64_t without_history = 0;  // compared but for what the test adds up, as it began before the recording
  double worst_distance = 0;          // largest relative difference of the best distances
  [[nodiscard]] std::uint64_t compared() const noexcept { return same + different; }
  [[nodiscard]] bool is_same() const noexcept { return different == 0 && not_recorded == 0 && not_repeated == 0; }
};

class Comparison {
 public:
  /// Reads the frames' ids and the results of `run`. With a tolerance of 0 all of a result has to be the same, to the
  /// bit, but for timings, counters and the model's checksum; else status, verdict and best sample, and the best
  /// distance and the coverage within that share.
  Comparison(RecordedRun& run, double tolerance);
  /// A frame that found no place in the queue then, and so has no answer to compare with.
  [[nodiscard]] bool was_dropped(std::uint64_t session, std::uint64_t id) const;
  /// What is different, in a sentence; nothing when all is the same.
  std::optional<std::string> take(const wire::WireResult& result);
  /// Once all new results were taken.
  [[nodiscard]] ComparisonTally tally() const;

 private:
  using Key = std::pair<std::uint64_t, std::uint64_t>;  // session, id
  struct Answers {
    std::vector<wire::WireResult>
        results;  // more than one when an id came twice, in any order; those compared are taken out
    wire::WireStatus first{};
  };
  /// Where frames and results are both recorded, by ids.
  struct Session {
    std::uint64_t first_id = 0, last_id = 0;
    bool began_before = false;  // the first frames of the test are not in the recording
    [[nodiscard]] bool holds(std::uint64_t id) const noexcept { return id >= first_id && id <= last_id; }
  };
  void take_recorded(const wire::WireResult& result);
  /// `frames`: in the order in which they were recorded.
  void note_sessions(const std::vector<Key>& frames);
  void note_lost_history(const std::vector<Key>& frames);
  void note_first_ids(const wire::WireState& state);
  /// Before the first or behind the last frame of its session that is recorded with its result.
  [[nodiscard]] bool is_at_edge(const Key& key) const;
  [[nodiscard]] bool is_same(const wire::WireResult& recorded, const wire::WireResult& now) const;
  double tolerance_;
  std::map<Key, Answers> recorded_;
  std::map<std::uint64_t, Session> sessions_;
  std::map<std::uint64_t, std::uint64_t> first_ids_;  // of each session, as the matcher says
  ComparisonTally tally_;
};

/// The result without what differs from run to run.
[[nodiscard]] wire::WireResult without_timings(wire::WireResult result);

}  // namespace lbea::tool
