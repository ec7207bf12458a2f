#include "precompute/depth_images/learned_bounds.hpp"

#include "precompute/left_out/branches.hpp"
#include "runtime/src/numbers/elementary.hpp"
#include "runtime/src/track/inference.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace lbea::bake {
namespace {

constexpr std::size_t most_values = 128;  // nodes or elements at which shapes or fields are compared

std::map<std::uint32_t, double> frames_by_run(std::span<const FrameErrors> frames) {
  std::map<std::uint32_t, double> counts;
  for (const FrameErrors& frame : frames) ++counts[frame.simulation];
  return counts;
}

/// Node positions, or one field, of some samples.
class SampleTable {
 public:
  /// number: 0, or 1 + field. samples: ascending. Reads each of them once.
  SampleTable(const SampleSource& source, std::size_t number, std::vector<std::size_t> samples, const Workers& workers)
      : source_(source), number_(number), samples_(std::move(samples)), rows_(samples_.size()) {
    work_in_parallel(samples_.size(), workers, [&](const auto& next) {
      std::vector<float> row(number_ == 0 ? 3 * source_.nodes : source_.elements);
      for (std::size_t i = next(); i < samples_.size(); i = next()) rows_[i] = read(samples_[i], row);
    });
  }
  [[nodiscard]] std::size_t components() const noexcept { return number_ == 0 ? 3 : 1; }
  [[nodiscard]] const std::vector<float>& of(std::size_t sample) const {
    return rows_[static_cast<std::size_t>(std::ranges::lower_bound(samples_, sample) - samples_.begin())];
  }

 private:
  [[nodiscard]] std::vector<float> read(std::size_t sample, std::vector<float>& row) const {
    if (number_ == 0) {
      source_.read_positions(sample, row);
      return thinned_rows(row, 3, most_values);
    }
    source_.read_field(number_ - 1, sample, row);
    return thinned_rows(row, 1, most_values);
  }

  const SampleSource& source_;
  std::size_t number_;
  std::vector<std::size_t> samples_;
  std::vector<std::vector<float>> rows_;
};

std::vector<std::size_t> samples_of(std::initializer_list<std::span<const FrameErrors>> kinds) {
  std::vector<std::size_t> samples;
  for (const std::span<const FrameErrors> frames : kinds)
    for (const FrameErrors& frame : frames) {
      samples.push_back(frame.sample);
      for (const auto& weighted : {&frame.weights, &frame.plausible})
        for (const auto& [sample, weight] : *weighted) samples.push_back(sample);
    }
  std::ranges::sort(samples);
  samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
  return samples;
}

std::vector<WeightedRow> rows_of(const SampleTable& table, std::span<const std::pair<std::size_t, float>> samples) {
  std::vector<WeightedRow> rows;
  for (const auto& [sample, weight] : samples) rows.push_back({table.of(sample), weight});
  return rows;
}

/// Per node or element: the error, and the spread times the frame's bound per spread.
struct ComparedFrame {
  double weight = 0;
  std::vector<double> errors;
  std::vector<float> spreads;
};

ComparedFrame compared(const SampleTable& table, const FrameErrors& frame, const ErrorBound& bound, double weight) {
  Inferred inferred;
  infer(rows_of(table, frame.weights), rows_of(table, frame.plausible), table.components(), inferred);
  const std::vector<float>& truth = table.of(frame.sample);
  ComparedFrame result{weight, std::vector<double>(inferred.spread.size()), inferred.spread};
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double off = double{inferred.mean[i]} - double{truth[i]};
    double& error = result.errors[i / table.components()];
    error = std::hypot(error, off);
  }
  const double per_spread = bound.per_spread_at(frame.spread);
  for (float& spread : result.spreads) spread = static_cast<float>(per_spread * double{spread});
  return result;
}

struct ComparedFrames {
  std::vector<ComparedFrame> frames;
  double share_to_hold = 1;
};
ComparedFrames compare(const SampleTable& table, const LeftOutEstimates& estimates) {
  const std::span<const FrameErrors> frames = estimates.frames;
  const std::vector<double> weights = run_weights(frames);
  ComparedFrames result{{}, share_to_hold(frames)};
  for (std::size_t i = 0; i < frames.size(); ++i)
    result.frames.push_back(compared(table, frames[i], estimates.error_bound, weights[i]));
  return result;
}

/// Leaves out frames whose plausible samples hardly differ: their ratios are those of rounding errors.
void remove_constant(std::vector<ComparedFrame>& frames) {
  constexpr double least_share = 1e-3;  // of the mean
  double mean = 0, all = 0;
  for (const ComparedFrame& frame : frames) {
    mean += frame.weight * root_mean_square(frame.spreads);
    all += frame.weight;
  }
  std::erase_if(frames, [&](const ComparedFrame& frame) {
    return !(root_mean_square(frame.spreads) * all > least_share * mean);
  });
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
    if (!(width > 0) || width >= least || per_spread > format::largest_measure) continue;
    least = width;
    narrowest = {share, per_spread};
  }
  return narrowest;
}

/// The mean error of a frame.
struct SpreadError {
  double spread = 0, error = 0, weight = 0;
};

/// Of the 90 % quantile.
double quantile_loss(const ErrorBound& bound, std::span<const SpreadError> errors) {
  double sum = 0;
  for (const auto& [spread, error, weight] : errors) {
    const double above = error - bound.per_spread_at(spread) * spread;
    sum += weight * std::max(0.9 * above, -0.1 * above);
  }
  return sum;
}

/// The bound of this growth that holds a share of the errors.
ErrorBound bound_with(double growth, double typical, std::span<const SpreadError> errors, double share) {
  ErrorBound bound{1, growth, typical};
  std::vector<WeightedValue> ratios;
  for (const auto& [spread, error, weight] : errors)
    ratios.push_back({error / (bound.per_spread_at(spread) * spread), weight});
  bound.per_spread = weighted_quantile(std::move(ratios), share);
  return bound;
}

}  // namespace

ErrorBound learn_error_bound(std::span<const FrameErrors> frames, double least) {
  const std::vector<double> weights = run_weights(frames);
  std::vector<SpreadError> errors;
  double logarithms = 0, all = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (!(frames[i].spread > least)) continue;
    errors.push_back({frames[i].spread, frames[i].estimate, weights[i]});
    logarithms += weights[i] * logarithm(frames[i].spread);
    all += weights[i];
  }
  ErrorBound learned;
  if (errors.empty()) return learned;
  const double typical = exponential(logarithms / all), share = share_to_hold(frames);
  double least_loss = std::numeric_limits<double>::infinity();
  for (double growth = -0.5; growth <= 0.5; growth += 0.125) {
    const ErrorBound tried = bound_with(growth, typical, errors, share);
    const double loss = quantile_loss(tried, errors);
    if (loss < least_loss) least_loss = loss, learned = tried;
  }
  return learned;
}

std::vector<double> run_weights(std::span<const FrameErrors> frames) {
  auto counts = frames_by_run(frames);
  std::vector<double> weights;
  for (const FrameErrors& frame : frames)
    weights.push_back(1 / (counts[frame.simulation] * static_cast<double>(counts.size())));
  return weights;
}

double share_to_hold(std::size_t runs) {
  const double count = std::max(static_cast<double>(runs), 1.0);
  return std::min(0.9 * (count + 1) / count, 1.0);
}
double share_to_hold(std::span<const FrameErrors> frames) { return share_to_hold(frames_by_run(frames).size()); }

double weighted_quantile(std::vector<WeightedValue> values, double share) {
  std::ranges::sort(values, {}, &WeightedValue::value);
  double all = 0, below = 0;
  for (const WeightedValue& one : values) all += one.weight;
  for (const WeightedValue& one : values)
    if ((below += one.weight) >= share * all) return one.value;
  return 0;
}

std::vector<SpreadBound> learn_bounds(const SampleSource& source, const LeftOutEstimates& whole,
                                      const LeftOutEstimates& hidden, const Workers& workers) {
  std::vector<SpreadBound> bounds;
  for (std::size_t number = 0; number <= source.fields; ++number) {
    const SampleTable table(source, number, samples_of({whole.frames, hidden.frames}), workers);
    ComparedFrames of_whole = compare(table, whole), of_hidden = compare(table, hidden);
    for (ComparedFrames* kind : {&of_whole, &of_hidden}) remove_constant(kind->frames);
    bounds.push_back(narrowest_bound(of_whole, of_hidden));
  }
  return bounds;
}

}  // namespace lbea::bake
