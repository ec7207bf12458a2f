// Measures the time of a frame by number of points, and the time of the search by number of samples.
#pragma once

#include "tools/bench/measurement.hpp"

#include <functional>

namespace lbea::tool::bench {

/// Makes the pipelines to compare for a configuration, the product first.
using MakePipelines = std::function<std::vector<std::unique_ptr<Pipeline>>(const MatcherConfig&)>;
/// Writes two tables into `folder`: size, pipeline, frames, percentiles of the processor time in us. growth_points.csv:
/// whole frames of 1 k to 1 M points, from thinned clouds or clouds repeated with jitter; one answer per size is
/// checked. growth_samples.csv: the search of the product and a simple loop over 100 to 1,000,000 samples, those of the
/// model repeated with jitter. Throws Error{bad_input} for a wrong answer, Error{write_failed}.
void measure_growth(const std::filesystem::path& folder, const Model& model, const MatcherConfig& config,
                    const MakePipelines& make, std::span<const BenchCloud> clouds);

}  // namespace lbea::tool::bench
