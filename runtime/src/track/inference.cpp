#include "runtime/src/track/inference.hpp"

#include "runtime/src/track/tracker.hpp"

#include <lbea/inference.hpp>

#include <algorithm>
#include <cmath>

namespace lbea {
namespace {

/// Rows of a model. `read` holds those that are decoded.
struct Rows {
  std::vector<WeightedRow> rows;
  std::vector<std::vector<float>> read;
};

template <class Values>
Rows rows_of(const Model& model, std::span<const WeightedSample> samples, const Values& values) {
  Rows result;
  for (const WeightedSample& sample : samples) {
    const std::uint32_t row = model.sample_index(sample.sample);
    if (row == model.samples())
      throw Error(Status::bad_input,
                  "the estimate names a sample that is not in this model; give the model that the matcher uses");
    result.rows.push_back({values(row, result.read), sample.weight});
  }
  return result;
}

/// Limits each value to the range of the rows: an extrapolated strain, for example, could be negative.
void keep_within(std::span<const WeightedRow> rows, std::vector<float>& mean) {
  for (std::size_t i = 0; i < mean.size(); ++i) {
    float low = rows.front().values[i], high = low;
    for (const WeightedRow& row : rows) {
      low = std::min(low, row.values[i]);
      high = std::max(high, row.values[i]);
    }
    mean[i] = std::clamp(mean[i], low, high);
  }
}

}  // namespace

void weighted_mean(std::span<const WeightedRow> rows, std::vector<float>& into) {
  into.assign(rows.empty() ? 0 : rows.front().values.size(), 0.0f);
  for (const WeightedRow& row : rows)
    for (std::size_t i = 0; i < into.size(); ++i) into[i] += row.weight * row.values[i];
}

void weighted_spread(std::span<const WeightedRow> rows, std::span<const float> about, std::size_t components,
                     std::vector<float>& into) {
  into.assign(about.size() / components, 0.0f);
  float all = 0;
  for (const WeightedRow& row : rows) {
    all += row.weight;
    for (std::size_t i = 0; i < into.size() * components; ++i) {
      const float off = row.values[i] - about[i];
      into[i / components] += row.weight * off * off;
    }
  }
  for (float& value : into) value = all > 0 ? std::sqrt(value / all) : 0;
}

std::vector<WeightedSample> plausible_samples(const Model& model, std::span<const Match> candidates,
                                              const TrackerConfig& config) {
  std::vector<WeightedSample> weighted;
  if (candidates.empty()) return weighted;
  const Likelihood likelihood(std::ranges::min_element(candidates, {}, &Match::distance)->distance,
                              completed(config, model));
  float all = 0;
  for (const Match& candidate : candidates) {
    weighted.push_back({candidate.sample, static_cast<float>(likelihood(candidate.distance))});
    all += weighted.back().weight;
  }
  for (WeightedSample& sample : weighted) sample.weight /= all;
  return weighted;
}

void infer_field(const Model& model, std::uint32_t field, std::span<const WeightedSample> estimate,
                 std::span<const WeightedSample> plausible, Inferred& into) {
  const auto values = [&](std::uint32_t sample, std::vector<std::vector<float>>& read) {
    const auto stored = model.field_values(field, sample);
    if (!stored.empty()) return stored;
    model.read_field(field, sample, read.emplace_back(model.field_size(field)));
    return std::span<const float>(read.back());
  };
  const Rows rows = rows_of(model, estimate, values);
  weighted_mean(rows.rows, into.mean);
  if (std::ranges::any_of(estimate, [](const WeightedSample& s) { return s.weight < 0; }))
    keep_within(rows.rows, into.mean);
  weighted_spread(rows_of(model, plausible, values).rows, into.mean, 1, into.spread);
}

void infer_positions(const Model& model, std::span<const WeightedSample> estimate,
                     std::span<const WeightedSample> plausible, Inferred& into) {
  const auto values = [&](std::uint32_t sample, auto&) { return model.node_positions(sample); };
  weighted_mean(rows_of(model, estimate, values).rows, into.mean);
  weighted_spread(rows_of(model, plausible, values).rows, into.mean, 3, into.spread);
}

}  // namespace lbea
