#include "runtime/src/track/inference.hpp"

#include "runtime/src/model/model_view.hpp"
#include "runtime/src/track/tracker.hpp"

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

/// Of the values, or their squared distances from `about`: a value that is not a number, as that of an eroded element,
/// counts as the mean of the others by the amounts of their weights, which regression makes negative for some. Not a
/// number unless the others have more than this share of the amounts.
float mean_of_numbers(std::span<const WeightedRow> rows, std::size_t i, const float* about, float share) {
  float sum = 0, amounts = 0, others = 0, all = 0, lost = 0;
  for (const WeightedRow& row : rows) {
    const float value = row.values[i], amount = std::abs(row.weight);
    all += amount;
    if (std::isnan(value)) {
      lost += row.weight;
      continue;
    }
    const float term = about == nullptr ? value : square<float>(value - *about);
    sum += row.weight * term;
    amounts += amount * term;
    others += amount;
  }
  return others > share * all ? sum + lost * amounts / others : std::numeric_limits<float>::quiet_NaN();
}

/// Limits each value to the range of the rows: an extrapolated strain, for example, could be negative.
void keep_within(std::span<const WeightedRow> rows, std::vector<float>& mean) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  std::vector<float> low(mean.size(), infinity), high(mean.size(), -infinity);
  for (const WeightedRow& row : rows)
    for (std::size_t i = 0; i < mean.size(); ++i) {
      low[i] = std::min(low[i], row.values[i]);
      high[i] = std::max(high[i], row.values[i]);
    }
  for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = std::min(std::max(mean[i], low[i]), high[i]);  // NaN stays
}

[[gnu::cold]]  // compiled for size
Rows positions_of(const Model& model, std::span<const WeightedSample> samples) {
  return rows_of(model, samples, [&](std::uint32_t sample, auto&) { return model.node_positions(sample); });
}

[[gnu::cold]]  // compiled for size
Rows fields_of(const Model& model, std::uint32_t field, std::span<const WeightedSample> samples) {
  return rows_of(model, samples, [&](std::uint32_t sample, std::vector<std::vector<float>>& read) {
    const auto stored = model.field_values(field, sample);
    if (!stored.empty()) return stored;
    model.read_field(field, sample, read.emplace_back(model.field_size(field)));
    return std::span<const float>(read.back());
  });
}

/// quantity: 0, or 1 + field. The errors of single values grow with the error of the whole estimate.
[[gnu::cold]]  // compiled for size
void bound(const Model& model, std::size_t quantity, const SurfaceFit& fit, Inferred& into) {
  const auto& images = model.view().depth_images;
  if (images == nullptr || images->bounds.empty() || !(fit.spread > 0) || !(fit.error_90 > 0)) return;
  const auto [share, per_spread] = images->bounds[quantity];
  if (!(per_spread > 0)) return;
  into.bound_90 = into.spread;
  even_out(into.bound_90, share);
  const double scale = per_spread * double{fit.error_90} / double{fit.spread};
  for (float& value : into.bound_90) value = static_cast<float>(scale * double{value});
}

}  // namespace

void weighted_mean(std::span<const WeightedRow> rows, std::vector<float>& into) {
  into.assign(rows.empty() ? 0 : rows.front().values.size(), 0.0f);
  for (const WeightedRow& row : rows)
    for (std::size_t i = 0; i < into.size(); ++i) into[i] += row.weight * row.values[i];
  for (std::size_t i = 0; i < into.size(); ++i)
    if (std::isnan(into[i])) into[i] = mean_of_numbers(rows, i, nullptr, 0.5f);
}

void weighted_spread(std::span<const WeightedRow> rows, std::span<const float> about, std::size_t components,
                     std::vector<float>& into) {
  into.assign(about.size() / components, 0.0f);
  float all = 0;
  for (const WeightedRow& row : rows) {
    all += row.weight;
    for (std::size_t i = 0; i < into.size(); ++i)
      for (std::size_t k = components * i; k < components * (i + 1); ++k) {
        const float off = row.values[k] - about[k];
        into[i] += row.weight * off * off;
      }
  }
  for (std::size_t i = 0; i < into.size(); ++i)
    into[i] = std::sqrt(components == 1 && std::isnan(into[i]) ? mean_of_numbers(rows, i, &about[i], 0)
                        : all > 0                              ? into[i] / all
                                                               : 0);
}

void infer(std::span<const WeightedRow> estimate, std::span<const WeightedRow> plausible, std::size_t components,
           Inferred& into) {
  weighted_mean(estimate, into.mean);
  if (components == 1 && std::ranges::any_of(estimate, [](const WeightedRow& row) { return row.weight < 0; }))
    keep_within(estimate, into.mean);
  weighted_spread(plausible, into.mean, components, into.spread);
  for (std::size_t i = 0; components == 1 && i < into.mean.size(); ++i)
    if (std::isnan(into.spread[i])) into.mean[i] = into.spread[i];
  into.bound_90.clear();
}

double root_mean_square(std::span<const float> values) noexcept {
  double squares = 0, count = 0;
  for (const float value : values)
    if (std::isfinite(value)) squares += square<double>(value), ++count;
  return std::sqrt(squares / std::max(count, 1.0));
}

void even_out(std::span<float> spread, double share) noexcept {
  const double common = share * root_mean_square(spread);
  for (float& value : spread) value = static_cast<float>(std::sqrt(square<double>(value) + common * common));
}

std::vector<WeightedSample> plausible_samples(std::span<const Match> candidates, const TrackerConfig& config) {
  std::vector<WeightedSample> weighted;
  if (candidates.empty()) return weighted;
  const Likelihood likelihood(std::ranges::min_element(candidates, {}, &Match::distance)->distance, config);
  float all = 0;
  for (const Match& candidate : candidates) {
    weighted.push_back({candidate.sample, static_cast<float>(likelihood(candidate.distance))});
    all += weighted.back().weight;
  }
  for (WeightedSample& sample : weighted) sample.weight /= all;
  return weighted;
}

std::vector<WeightedSample> plausible_samples(const Model& model, std::span<const Match> candidates,
                                              const TrackerConfig& config) {
  return plausible_samples(candidates, completed(config, model));
}

void infer_field(const Model& model, std::uint32_t field, std::span<const WeightedSample> estimate,
                 std::span<const WeightedSample> plausible, Inferred& into) {
  const Rows of_estimate = fields_of(model, field, estimate), of_plausible = fields_of(model, field, plausible);
  infer(of_estimate.rows, of_plausible.rows, 1, into);
}

void infer_positions(const Model& model, std::span<const WeightedSample> estimate,
                     std::span<const WeightedSample> plausible, Inferred& into) {
  infer(positions_of(model, estimate).rows, positions_of(model, plausible).rows, 3, into);
}

void infer_field(const Model& model, std::uint32_t field, const SurfaceFit& fit, Inferred& into) {
  infer_field(model, field, fit.estimate, plausible_samples(model, fit.candidates), into);
  bound(model, std::size_t{1} + field, fit, into);
}

void infer_positions(const Model& model, const SurfaceFit& fit, Inferred& into) {
  infer_positions(model, fit.estimate, plausible_samples(model, fit.candidates), into);
  bound(model, 0, fit, into);
}

}  // namespace lbea
