// The results of a running test, compared with the truth, as a table, JSON and CSV.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/answer/test_answer.hpp"

#include <lbea/lbea.hpp>

#include <optional>
#include <set>

namespace lbea::tool {

struct LiveRow {
  wire::WireResult result;
  double match_ms = 0;  // time in the matcher
  double total_ms = 0;  // from receiving the frame to publishing the result
  std::string warning;  // of the answer, at the first frame that gives a reason for it
  // After the test: the sample of its most likely path at this frame; none in frames of another sender.
  std::optional<Sample> on_path;
  std::string path_simulation;
  // With a truth, EE in the length unit:
  std::optional<double> error, oracle_error;         // of the best match; of the oracle
  std::optional<double> estimate_error, path_error;  // of the estimate by fit; of the sample on the path
};

/// The senders whose frames are evaluated: more than one when the sender was restarted.
class LiveSessions {
 public:
  /// Adds the result of a frame.
  void add(const wire::WireResult& result);
  /// Whether it is of the latest of these senders.
  [[nodiscard]] bool has_latest(const wire::WireResult& result) const noexcept { return latest_ == result.session; }
  /// Of which frames were matched.
  [[nodiscard]] std::size_t count() const noexcept { return matched_.size(); }

 private:
  std::optional<std::uint64_t> latest_;
  std::set<std::uint64_t> matched_;
};

struct LiveSummary {
  std::vector<LiveRow> rows;
  bool complete = false;  // the sender ended the stream
  LiveSessions sessions;
  TestAnswer answer;
  wire::Counters counters;  // by status
  /// Mean over the rows that have this error.
  [[nodiscard]] std::optional<double> mean(std::optional<double> LiveRow::*error) const;
  [[nodiscard]] double median_match_ms() const;
  /// From the first row's capture to that of this row, s.
  [[nodiscard]] double seconds_since_first(const LiveRow& row) const noexcept;
  /// The last sample of the path; none without evidence.
  [[nodiscard]] std::optional<Sample> end_of_path() const;
};

/// Finds the most likely path of the whole test, of the latest sender.
void find_path(LiveSummary& summary, const Model& model);

[[nodiscard]] std::string table_header(const Model& model);
[[nodiscard]] std::string table_line(const LiveRow& row);
[[nodiscard]] std::string table_summary(const LiveSummary& summary, const Model& model);
[[nodiscard]] std::string to_json(const LiveSummary& summary, const Model& model);

/// One line per frame. Throws Error{write_failed}.
void write_csv(const std::filesystem::path& file, const LiveSummary& summary);

}  // namespace lbea::tool
