// How the time of a frame grows with the number of points, and the search with the number of samples.
#pragma once

#include "tools/bench/measurement.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool::bench {

struct GrowthRow {
  std::uint64_t size = 0;  // points or samples
  std::string pipeline;
  Statistics us;  // processor time
};

/// Makes the pipelines to compare, the product first, for a configuration.
using MakePipelines = std::function<std::vector<std::unique_ptr<Pipeline>>(const MatcherConfig&)>;
/// Told what is measured next.
using Announce = std::function<void(const std::string&)>;

/// Whole frames of 1 k to 1 M points: clouds thinned, or repeated with jitter. Checks one answer per size and throws
/// Error{bad_input} when it is wrong.
[[nodiscard]] std::vector<GrowthRow> growth_with_points(const Model& model, const MatcherConfig& config,
                                                        const MakePipelines& make, std::span<const BenchCloud> clouds,
                                                        const Announce& announce);

/// The product's search and a plain loop over 100 to 1,000,000 samples: the model's own, repeated with jitter.
[[nodiscard]] std::vector<GrowthRow> growth_with_samples(const Model& model, const MatcherConfig& config,
                                                         std::span<const BenchCloud> clouds, const Announce& announce);

/// Columns size, pipeline, frames, percentiles in us. Throws Error{write_failed}.
void write_growth(const std::filesystem::path& file, std::string_view size_name, const std::vector<GrowthRow>& rows);

}  // namespace lbea::tool::bench
