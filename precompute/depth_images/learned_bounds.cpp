#include "precompute/depth_images/learned_bounds.hpp"

#include "precompute/depth_images/branches.hpp"
#include "precompute/parallel.hpp"
#include "runtime/src/track/inference.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace lbea::bake {
namespace {

constexpr std::size_t most_values = 128;  // nodes or elements at which shapes or fields are compared

std::map<std::uint32_t, double> frames_by_run(std::span<const FrameErrors> frames) {
  std::map<std::uint32_t, double> counts;
  for (const FrameErrors& frame : frames) ++counts[frame.simulation];
  return counts;
}

/// Node positions, or one field, of the samples.
class Quantity {
 public:
  /// number: 0, or 1 + field.
  Quantity(const SampleSource& source, std::size_t number)
      : source_(source), number_(number), row_(number == 0 ? 3 * source.nodes : source.elements) {}

  [[nodiscard]] std::size_t components() const noexcept { return number_ == 0 ? 3 : 1; }
  [[nodiscard]] std::vector<float> of(std::size_t sample) {
    if (number_ == 0) {
      source_.read_positions(sample, row_);
      return thinned_nodes(row_, most_values);
    }
    source_.read_field(number_ - 1, sample, row_);
    const std::size_t every = (row_.size() + most_values - 1) / most_values;
    std::vector<float> chosen;
    for (std::size_t element = 0; element < row_.size(); element += every) chosen.push_back(row_[element]);
    return chosen;
  }

 private:
  const SampleSource& source_;
  std::size_t number_;
  std::vector<float> row_;
};

/// The rows of weighted samples.
class SampleRows {
 public:
  SampleRows(Quantity& quantity, std::span<const std::pair<std::size_t, float>> samples) {
    for (const auto& [sample, weight] : samples) values_.push_back(quantity.of(sample));
    for (std::size_t i = 0; i < samples.size(); ++i) rows_.push_back({values_[i], samples[i].second});
  }
  [[nodiscard]] std::span<const WeightedRow> rows() const noexcept { return rows_; }

 private:
  std::vector<std::vector<float>> values_;
  std::vector<WeightedRow> rows_;
};

/// Per node or element: the error, and the spread times error_per_spread.
struct ComparedFrame {
  double weight = 0;
  std::vector<double> errors;
  std::vector<float> spreads;
};

ComparedFrame compared(Quantity& quantity, const FrameErrors& frame, double error_per_spread, double weight) {
  const SampleRows estimate(quantity, frame.weights), plausible(quantity, frame.plausible);
  Inferred inferred;
  infer(estimate.rows(), plausible.rows(), quantity.components(), inferred);
  const std::vector<float> truth = quantity.of(frame.sample);
  ComparedFrame result{weight, std::vector<double>(inferred.spread.size()), inferred.spread};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double off = double{inferred.mean[i]} - double{truth[i]};
    double& error = result.errors[i / quantity.components()];
    error = std::hypot(error, off);
  }
  for (float& spread : result.spreads) spread = static_cast<float>(error_per_spread * double{spread});
  return result;
}

struct ComparedFrames {
  std::vector<ComparedFrame> frames;
  double share_to_hold = 1;
};
ComparedFrames compare(const SampleSource& source, std::size_t number, const LeftOutEstimates& estimates,
                       unsigned threads) {
  const std::span<const FrameErrors> frames = estimates.frames;
  const std::vector<double> weights = run_weights(frames);
  ComparedFrames result{std::vector<ComparedFrame>(frames.size()), share_to_hold(frames)};
  work_in_parallel(frames.size(), threads, [&](const auto& next) {
    Quantity quantity(source, number);
    for (std::size_t i = next(); i < frames.size(); i = next())
      result.frames[i] = compared(quantity, frames[i], estimates.error_per_spread, weights[i]);
  });
  return result;
}

/// The bound per spread that holds 90 % of the true values, and the mean of the evened spreads.
struct Ratio {
  double per_spread = 0, mean_spread = 0;
};
Ratio ratio_of(const ComparedFrames& compared, double share) {
  std::vector<WeightedValue> ratios;
  double sum = 0;
  for (const ComparedFrame& frame : compared.frames) {
    std::vector<float> evened = frame.spreads;
    even_out(evened, share);
    const double weight = frame.weight / static_cast<double>(evened.size());
    for (std::size_t i = 0; i < evened.size(); ++i) {
      if (!(evened[i] > 0) || !std::isfinite(evened[i]) || !std::isfinite(frame.errors[i])) continue;
      ratios.push_back({frame.errors[i] / double{evened[i]}, weight});
      sum += weight * double{evened[i]};
    }
  }
  return {weighted_quantile(std::move(ratios), compared.share_to_hold), sum};
}

SpreadBound narrowest_bound(const ComparedFrames& whole, const ComparedFrames& hidden) {
  SpreadBound narrowest;
  double least = std::numeric_limits<double>::infinity();
  for (const double share : {0.0625, 0.125, 0.25, 0.5, 1.0}) {
    const Ratio of_whole = ratio_of(whole, share), of_hidden = ratio_of(hidden, share);
    const double per_spread = std::max(of_whole.per_spread, of_hidden.per_spread);
    const double width = per_spread * (of_whole.mean_spread + of_hidden.mean_spread);
    if (!(width > 0) || width >= least) continue;
    least = width;
    narrowest = {share, per_spread};
  }
  return narrowest;
}

}  // namespace

std::vector<double> run_weights(std::span<const FrameErrors> frames) {
  auto counts = frames_by_run(frames);
  std::vector<double> weights;
  for (const FrameErrors& frame : frames)
    weights.push_back(1 / (counts[frame.simulation] * static_cast<double>(counts.size())));
  return weights;
}

double share_to_hold(std::span<const FrameErrors> frames) {
  const double runs = std::max(static_cast<double>(frames_by_run(frames).size()), 1.0);
  return std::min(0.9 * (runs + 1) / runs, 1.0);
}

double weighted_quantile(std::vector<WeightedValue> values, double share) {
  std::ranges::sort(values, {}, &WeightedValue::value);
  double all = 0, below = 0;
  for (const WeightedValue& one : values) all += one.weight;
  for (const WeightedValue& one : values)
    if ((below += one.weight) >= share * all) return one.value;
  return 0;
}

std::vector<SpreadBound> learn_bounds(const SampleSource& source, const LeftOutEstimates& whole,
                                      const LeftOutEstimates& hidden, unsigned threads) {
  std::vector<SpreadBound> bounds;
  for (std::size_t number = 0; number <= source.fields; ++number)
    bounds.push_back(
        narrowest_bound(compare(source, number, whole, threads), compare(source, number, hidden, threads)));
  return bounds;
}

}  // namespace lbea::bake
