// Measures the time of a frame by number of points, and the time of the search by number of samples.
#pragma once

#include "tools/bench/measurement.hpp"

#include <functional>

namespace lbea::tool::bench {

struct GrowthRow {
  std::uint64_t size = 0;  // points or samples
  std::string pipeline;
  Statistics us;  // processor time
};

/// Makes the pipelines to compare for a configuration, the product first.
using MakePipelines = std::function<std::vector<std::unique_ptr<Pipeline>>(const MatcherConfig&)>;
/// Receives a description of the next measurement.
using StepStarted = std::function<void(const std::string&)>;

/// Whole frames of 1 k to 1 M points: thinned clouds, or clouds repeated with jitter. Checks one answer per size;
/// throws Error{bad_input} when it is wrong.
[[nodiscard]] std::vector<GrowthRow> growth_with_points(const Model& model, const MatcherConfig& config,
                                                        const MakePipelines& make, std::span<const BenchCloud> clouds,
                                                        const StepStarted& step_started);

/// The search of the product and a simple loop over 100 to 1,000,000 samples: those of the model, repeated with jitter.
[[nodiscard]] std::vector<GrowthRow> growth_with_samples(const Model& model, const MatcherConfig& config,
                                                         std::span<const BenchCloud> clouds,
                                                         const StepStarted& step_started);

/// Columns size, pipeline, frames, percentiles in us. Throws Error{write_failed}.
void write_growth(const std::filesystem::path& file, std::string_view size_name, const std::vector<GrowthRow>& rows);

}  // namespace lbea::tool::bench
