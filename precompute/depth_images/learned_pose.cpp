#include "precompute/depth_images/learned_pose.hpp"

#include "precompute/left_out/left_out_fitter.hpp"
#include "precompute/rig/counter_random.hpp"
#include "runtime/src/model/run_samples.hpp"
#include "runtime/src/pose/pose_filter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lbea::bake {
namespace {

constexpr std::size_t most_runs = 24, most_states = 12;  // that are left out, and of each
constexpr std::uint32_t no_run = std::numeric_limits<std::uint32_t>::max();

/// Part i of `count` parts, from the first to the last of `all`.
std::size_t spread(std::size_t i, std::size_t count, std::size_t all) {
  return count > 1 ? i * (all - 1) / (count - 1) : 0;
}

/// Samples of runs spread over the ensemble, and of each the states from the first to the last.
std::vector<std::size_t> whole_runs(std::span<const Sample> samples) {
  const std::vector<RunSamples> all = samples_of_runs(samples);
  const std::size_t runs = std::min(most_runs, all.size());
  std::vector<std::size_t> chosen;
  for (std::size_t r = 0; r < runs; ++r) {
    const RunSamples& run = all[spread(r, runs, all.size())];
    const std::size_t count = std::min(most_states, run.count);
    for (std::size_t i = 0; i < count; ++i) chosen.push_back(run.first + spread(i, count, run.count));
  }
  return chosen;
}

/// By one way, one per frame; nothing: the frame has no points.
using Measured = std::vector<std::optional<PoseMeasurement>>;

class LeftOutRuns {
 public:
  LeftOutRuns(const SampleSource& source, const FitCosts& costs, const Workers& workers)
      : source_(source),
        costs_(costs),
        workers_(workers),
        frames_(source, whole_runs(source.samples), 0),
        best_(best_of_others(source, frames_, std::span(&costs_.metric, 1), FitSettings{}.candidates, workers)),
        duration_(std::max(std::ranges::max(source.samples, {}, &Sample::time_step).time_step, 1u)),
        calibration_(
            calibration_variances(LeftOutFitter(source, costs, 1).center(), units_per_mm(source.length_unit))) {}

  /// variance: learned before; 0: not known, and points are not measured.
  [[nodiscard]] std::vector<ApparentMotion> motions(double variance) const {
    std::vector<ApparentMotion> motions(frames_.size());
    work_in_parallel(frames_.size(), workers_, [&](const auto& next) {
      LeftOutFitter fitter(source_, costs_, FitSettings{}.candidates, {}, variance);
      for (std::size_t i = next(); i < frames_.size(); i = next())
        motions[i] = fitter.motion({frames_, i, best_[i], false}, calibration_, variance > 0);
    });
    return motions;
  }

  [[nodiscard]] Measured by_image(std::span<const ApparentMotion> motions) const {
    const PoseBelief prior = PoseBelief::with(calibration_);
    Measured measured;
    for (const ApparentMotion& motion : motions)
      measured.emplace_back(PoseMeasurement::between(prior, motion.posterior, calibration_));
    return measured;
  }
  [[nodiscard]] static Measured by_points(std::span<const ApparentMotion> motions) {
    Measured measured;
    for (const ApparentMotion& motion : motions) measured.push_back(motion.by_points);
    return measured;
  }

  /// Of frames whose poses are right, without those of one run. Few frames count little against the unit matrix.
  [[nodiscard]] PoseSpreads spreads(const Measured& measured, std::uint32_t left_out = no_run) const {
    constexpr double frames_of_unit_matrix = 6;
    constexpr std::size_t last = PoseSpreads::times - 1;
    PoseSpreads learned;
    std::array<double, PoseSpreads::times> frames{};
    frames.fill(frames_of_unit_matrix);
    for (PoseMatrix& sum : learned.at_times)
      for (double& entry : sum) entry *= frames_of_unit_matrix;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      if (source_.samples[frames_.sample(i)].simulation == left_out || !measured[i]) continue;
      const PoseMotion moved = PoseFactor(measured[i]->covariance).forward(measured[i]->motion);
      const double place = static_cast<double>(last) * source_.samples[frames_.sample(i)].time_step / duration_;
      for (std::size_t time = 0; time <= last; ++time) {
        const double weight = std::max(1 - std::abs(place - static_cast<double>(time)), 0.0);
        frames[time] += weight;
        for (std::size_t k = 0; k < 36; ++k) learned.at_times[time][k] += weight * moved[k / 6] * moved[k % 6];
      }
    }
    for (std::size_t time = 0; time <= last; ++time)
      for (double& entry : learned.at_times[time]) entry /= frames[time];
    return learned;
  }

  /// What this share of the runs does not reach; 0 unless three quarters of them reach it when they drift. ways: of
  /// measuring, together.
  [[nodiscard]] double drift_evidence(std::span<const Measured* const> ways, double share) const {
    constexpr double least = 6;  // a likelihood ratio of 400
    const auto right = most_evidence(ways, 0), drifting = most_evidence(ways, usual_drift_rate);
    const double enough = std::max(least, right[static_cast<std::size_t>(share * static_cast<double>(right.size()))]);
    return drifting[drifting.size() / 4] > 2 * enough ? enough : 0;
  }

 private:
  /// The most of each run, in ascending order, after it was moved at this rate.
  [[nodiscard]] std::vector<double> most_evidence(std::span<const Measured* const> ways, double rate) const {
    const DriftTest calibrated(calibration_, std::numeric_limits<double>::infinity());
    std::vector<double> most;
    DriftTest test = calibrated;
    std::vector<PoseSpreads> of_others(ways.size());
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const Sample sample = source_.samples[frames_.sample(i)];
      const Sample before = i > 0 ? source_.samples[frames_.sample(i - 1)] : sample;
      if (i == 0 || sample.simulation != before.simulation) {
        test = calibrated;
        std::ranges::transform(ways, of_others.begin(),
                               [&](const Measured* way) { return spreads(*way, sample.simulation); });
        most.push_back(0);
      } else {
        test.advance((sample.time_step - before.time_step) / duration_);
      }
      if (std::ranges::any_of(ways, [&](const Measured* way) { return !(*way)[i]; })) continue;  // no evidence
      PoseMeasurement measured = in_test(ways, of_others, i);
      for (std::size_t k = 0; k < 6; ++k) {
        const double sign = splitmix(6 * sample.simulation + k) % 2 == 0 ? 1 : -1;
        measured.motion[k] += sign * rate * std::sqrt(calibration_[k]) * sample.time_step / duration_;
      }
      test.update(measured);
      most.back() = std::max(most.back(), test.evidence());
    }
    std::ranges::sort(most);
    return most;
  }

  [[nodiscard]] PoseMeasurement in_test(std::span<const Measured* const> ways, std::span<const PoseSpreads> spreads,
                                        std::size_t frame) const {
    const double time = source_.samples[frames_.sample(frame)].time_step / duration_;
    std::optional<PoseMeasurement> all;
    for (std::size_t way = 0; way < ways.size(); ++way) {
      PoseMeasurement measured = *(*ways[way])[frame];
      measured.covariance = measured.covariance_with(spreads[way].at(time));
      all = all ? all->together_with(measured) : measured;
    }
    return *all;
  }

  const SampleSource& source_;
  FitCosts costs_;
  Workers workers_;
  LeftOutFrames frames_;
  std::vector<BestSamples> best_;
  double duration_;  // time steps
  PoseMotion calibration_;
};

/// Whether the frames seem to be moved much farther than the estimates are wrong: then a pose error cannot be told from
/// a difference of shape. Frames that another run shows exactly tell nothing.
bool is_ambiguous(std::span<const ApparentMotion> motions) {
  constexpr double most = 4;  // times the error; the frames of a test together are less wrong than each
  const auto median = [&](const auto& value_of) {
    std::vector<double> values;
    for (const ApparentMotion& motion : motions)
      if (motion.estimate_error > 0) values.push_back(value_of(motion));
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + std::ssize(values) / 2;
    std::ranges::nth_element(values, middle);
    return *middle;
  };
  const double moved = median([](const ApparentMotion& motion) { return length_of(motion.posterior.mean); });
  return moved > most * median([](const ApparentMotion& motion) { return motion.estimate_error; });
}

}  // namespace

LearnedPose learn_pose(const SampleSource& source, const FitCosts& costs, const Workers& workers) {
  const LeftOutRuns runs(source, costs, workers);
  const std::vector<ApparentMotion> motions = runs.motions(0);
  if (is_ambiguous(motions)) return {};
  LearnedPose learned;
  for (const ApparentMotion& motion : motions)
    learned.variance += motion.variance / static_cast<double>(motions.size());
  const std::vector<ApparentMotion> scaled = runs.motions(learned.variance);
  const Measured by_image = runs.by_image(scaled), by_points = runs.by_points(scaled);
  // By the image alone, a false drift costs much; with points, one that is found late does (docs/evaluation.md).
  constexpr double few_false = 0.95, more_false = 0.75;
  learned.by_image = {runs.spreads(by_image), runs.drift_evidence(std::array{&by_image}, few_false)};
  const auto with_points = std::ranges::count_if(by_points, [](const auto& one) { return one.has_value(); });
  if (2 * with_points > std::ssize(by_points))
    learned.by_points = {runs.spreads(by_points), runs.drift_evidence(std::array{&by_image, &by_points}, more_false)};
  return learned;
}

}  // namespace lbea::bake
