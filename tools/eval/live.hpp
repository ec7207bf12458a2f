// Watches the results of a running test and holds each against the truth.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/codec/messages.hpp"
#include "tools/eval/truth.hpp"

#include <lbea/lbea.hpp>

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

struct LiveRow {
  wire::WireResult result;
  double match_ms = 0;  // in the matcher
  double total_ms = 0;  // from receiving the frame to publishing the result
  // After the test: where its likeliest path through the ensemble is at this frame.
  Sample on_path;
  std::string path_simulation;
  // with a truth, EE in the length unit:
  std::optional<double> error, oracle_error;         // of the best sample and of the best possible one
  std::optional<double> estimate_error, path_error;  // of fit's shape between the samples; of the sample on the path
};

struct LiveSummary {
  std::vector<LiveRow> rows;
  bool complete = false;  // the sender said that the stream has ended
  bool has_path = false;
  /// Of the rows that have it.
  [[nodiscard]] std::optional<double> mean(std::optional<double> LiveRow::*error) const;
  [[nodiscard]] double median_match_ms() const;
};

struct LiveOptions {
  std::string results_endpoint;
  wire::ClientAccess access;
  std::chrono::milliseconds silence{10'000};  // give up when nothing at all arrives for so long
};

/// Receives until the end of the stream, silence, or `stop()`; then finds the test's path. `ready` is called once
/// results can no longer be missed, `row` for every result.
LiveSummary watch(const LiveOptions& options, const Model& model, Truth* truth, const std::function<void()>& ready,
                  const std::function<void(const LiveRow&)>& row, const std::function<bool()>& stop);

}  // namespace lbea::tool
