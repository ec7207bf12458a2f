// Measures the time of a frame by number of points, and the time of the search by number of samples.
#pragma once

#include "tools/bench/selection.hpp"

namespace lbea::tool::bench {

struct GrowthRow {
  std::uint64_t size = 0;
  std::string pipeline;
  Statistics us;  // processor time
};

template <typename Work>
double processor_us(const Work& work) {
  const std::uint64_t begin = processor_time_ns();
  work();
  return static_cast<double>(processor_time_ns() - begin) * 1e-3;
}

/// Writes a table: size, pipeline, frames, percentiles of the processor time in us. Throws Error{write_failed}.
void write_growth(const std::filesystem::path& file, std::string_view size_name, const std::vector<GrowthRow>& rows);

/// Writes tables into `folder` and returns their names. growth_points.csv: whole frames of 1 k to 1 M points, from
/// thinned clouds or clouds repeated with jitter; one answer per size is checked. growth_samples.csv: the search by
/// eq. 3 of the product and a simple loop over 100 to 1,000,000 samples, those of the model repeated with jitter. With
/// Method::fit also growth_cells.csv and growth_candidates.csv; see fit_growth.hpp. Throws Error{bad_input} for a wrong
/// answer, Error{write_failed}.
std::vector<std::filesystem::path> measure_growth(const std::filesystem::path& folder, const Model& model,
                                                  const Selection& selection, std::span<const BenchCloud> clouds);

}  // namespace lbea::tool::bench
