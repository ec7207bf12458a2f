// The likeliest sample of each frame, given the frames before and after.
#include "runtime/src/track/tracker.hpp"

namespace lbea {
namespace {

/// How badly each simulation explains frames: the excess of its best candidate's squared rank over the least of the
/// frame, relative to the latter. Ranks are the distances of the candidates.
class History {
 public:
  History(std::size_t simulations, float noise)
      : excess_(simulations), best_(simulations), squared_noise_(square<double>(noise)) {}
  void add(std::span<const Match> ranked) noexcept {
    const auto [least, most] = std::ranges::minmax(ranked, {}, &Match::distance);
    std::ranges::fill(best_, square<double>(most.distance));  // of a simulation without a candidate
    for (const Match& m : ranked)
      best_[m.sample.simulation] = std::min(best_[m.sample.simulation], square<double>(m.distance));
    weights_ = decay * weights_ + 1;
    for (std::size_t s = 0; s < excess_.size(); ++s)
      excess_[s] = decay * excess_[s] +
                   (best_[s] - square<double>(least.distance)) / (square<double>(least.distance) + squared_noise_);
  }
  /// The mean over the frames, the last one with weight 1.
  [[nodiscard]] double operator[](std::uint32_t simulation) const noexcept {
    return weights_ > 0 ? excess_[simulation] / weights_ : 0;
  }

 private:
  static constexpr double decay = 0.7;  // per frame
  std::vector<double> excess_, best_;
  double squared_noise_, weights_ = 0;
};

/// The candidate with the least cost: its squared rank plus a share of its simulation's excess in other frames. Ranks
/// contain the earlier frames of their test. So other frames only decide between candidates that are about equal:
/// larger shares made the choice worse.
template <class Excess>
Sample chosen_sample(std::span<const Match> ranked, float noise, const Excess& excess) noexcept {
  constexpr double share = 0.03;
  const float least = std::ranges::min(ranked, {}, &Match::distance).distance;
  const double scale = square<double>(least) + square<double>(noise);
  const auto root_of_cost = [&](const Match& m) {
    const double root = std::sqrt(square<double>(m.distance) + share * scale * excess(m));
    return static_cast<float>(std::min(root, double{std::numeric_limits<float>::max()}));
  };
  return std::ranges::min_element(ranked, {}, root_of_cost)->sample;
}

}  // namespace

std::vector<Match> ranked(std::span<const Match> candidates, std::span<const float> ranks) {
  std::vector<Match> result(candidates.begin(), candidates.end());
  for (std::size_t i = 0; i < std::min(result.size(), ranks.size()); ++i) result[i].distance = ranks[i];
  return result;
}

std::vector<Sample> likeliest_path(const Model& model, std::span<const std::vector<Match>> recorded) {
  std::vector<std::vector<Match>> evidence(recorded.begin(), recorded.end());
  for (std::vector<Match>& frame : evidence) std::erase_if(frame, [&](const Match& m) { return !is_usable(m, model); });
  const float noise = DepthMetric{}.in(model.length_unit()).mesh_noise;
  History past(model.simulations(), noise), future = past;
  std::vector<std::vector<double>> later(evidence.size());  // per candidate: the excess in the frames behind its own
  for (std::size_t i = evidence.size(); i-- > 0;) {
    for (const Match& m : evidence[i]) later[i].push_back(future[m.sample.simulation]);
    if (!evidence[i].empty()) future.add(evidence[i]);
  }
  std::vector<Sample> path;
  const auto first = std::ranges::find_if_not(evidence, &std::vector<Match>::empty);
  for (std::size_t i = 0; i < evidence.size(); ++i) {
    const auto excess = [&](const Match& m) {
      return (past[m.sample.simulation] + later[i][static_cast<std::size_t>(&m - evidence[i].data())]) / 2;
    };
    if (!evidence[i].empty())
      path.push_back(chosen_sample(evidence[i], noise, excess));
    else if (!path.empty())
      path.push_back(path.back());
    else
      path.push_back(first != evidence.end() ? std::ranges::min(*first, {}, &Match::distance).sample : model.sample(0));
    if (!evidence[i].empty()) past.add(evidence[i]);
  }
  return path;
}

}  // namespace lbea
