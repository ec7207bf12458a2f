// lbea-eval live: receives the results of a running test, compares them with the truth and writes them to files.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/codec/messages.hpp"
#include "tools/eval/truth.hpp"
#include "tools/shared/intake/test_answer.hpp"

#include <lbea/lbea.hpp>

#include <chrono>
#include <functional>
#include <optional>

namespace lbea::tool {

struct LiveRow {
  wire::WireResult result;
  double match_ms = 0;  // time in the matcher
  double total_ms = 0;  // from receiving the frame to publishing the result
  std::string warning;  // that the pose is probably wrong, at the first frame that shows it
  // After the test: the sample of its most likely path at this frame.
  Sample on_path;
  std::string path_simulation;
  // With a truth, EE in the length unit:
  std::optional<double> error, oracle_error;         // of the best match; of the oracle
  std::optional<double> estimate_error, path_error;  // of the estimate by fit; of the sample on the path
};

struct LiveSummary {
  std::vector<LiveRow> rows;
  bool complete = false;  // the sender ended the stream
  bool has_path = false;
  TestAnswer answer;
  wire::Counters counters;  // by status
  /// Mean over the rows that have this error.
  [[nodiscard]] std::optional<double> mean(std::optional<double> LiveRow::*error) const;
  [[nodiscard]] double median_match_ms() const;
};

struct LiveOptions {
  std::string results_endpoint;
  wire::ClientAccess access;
  std::chrono::milliseconds silence{10'000};  // stop after this time without a message
};

/// Receives results until the end of the stream, a timeout, or `stop()`; then computes the most likely path of the
/// test. `ready` is called at the first message, from which on no result can be missed; `row` for every result.
LiveSummary watch(const LiveOptions& options, const Model& model, Truth* truth, const std::function<void()>& ready,
                  const std::function<void(const LiveRow&)>& row, const std::function<bool()>& stop);

[[nodiscard]] std::string table_header(const Model& model);
[[nodiscard]] std::string table_line(const LiveRow& row);
[[nodiscard]] std::string table_summary(const LiveSummary& summary, const Model& model);
[[nodiscard]] std::string to_json(const LiveSummary& summary, const Model& model);

/// One line per frame. Throws Error{write_failed}.
void write_csv(const std::filesystem::path& file, const LiveSummary& summary);

/// Writes the whole mesh of each matched sample with all fields as FOLDER/matched_<frame>.vtu, and their series as
/// matched.pvd. For results of fit also the estimate with inferred fields and their spread: estimate_<frame>.vtu and
/// estimate.pvd. With a truth also each cloud in reference coordinates: frame_<frame>.ply; `columns` as in
/// read_point_cloud(). Throws Error{write_failed}.
void write_meshes(const std::filesystem::path& folder, const LiveSummary& summary, const Model& model,
                  const Truth* truth, const RigidTransform& T_reference_sensor, const std::string& columns);

}  // namespace lbea::tool
