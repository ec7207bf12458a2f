// Viterbi's algorithm on the tracker's model: forward within a simulation, now and then a change to another.
#include "runtime/src/track/evidence.hpp"

#include <lbea/tracker.hpp>

#include <cmath>
#include <limits>
#include <vector>

namespace lbea {
namespace {

constexpr double never = -std::numeric_limits<double>::infinity();

struct Trellis {
  const Model& model;
  double log_stop, log_step, log_stay, log_change;
  std::vector<double> score;                       // per sample: of the best path that ends there
  std::vector<std::vector<std::uint32_t>> before;  // per frame but the first, per sample: where that path came from

  Trellis(const Model& m, const TrackerConfig& config)
      : model(m),
        log_stop(std::log(1 - double{config.persistence})),
        log_step(std::log(double{config.persistence})),
        log_stay(std::log(1 - double{config.change})),
        log_change(std::log(double{config.change} / m.samples())),
        score(m.samples(), 0.0) {}

  void weigh(std::span<const Match> evidence, const TrackerConfig& config) {
    const Plausibility plausibility(evidence.front().distance, config);
    std::vector<double> likelihood(score.size(), std::log(plausibility(evidence.back().distance)));
    for (const Match& candidate : evidence)
      likelihood[model.sample_index(candidate.sample)] = std::log(plausibility(candidate.distance));
    for (std::size_t s = 0; s < score.size(); ++s) score[s] += likelihood[s];
  }

  void advance() {
    const auto best = static_cast<std::uint32_t>(std::ranges::max_element(score) - score.begin());
    std::vector<std::uint32_t> from(score.size(), best);
    std::vector<double> next(score.size(), never);
    double carried = never;
    std::uint32_t carrier = 0;
    for (std::uint32_t s = 0; s < score.size(); ++s) {
      if (s == 0 || model.sample(s).simulation != model.sample(s - 1).simulation) carried = never;
      carried += log_step;
      if (score[s] + log_stop >= carried) {
        carried = score[s] + log_stop;
        carrier = s;
      }
      next[s] = log_stay + carried;
      from[s] = carrier;
      const bool later = model.sample(s).time_step >= model.sample(best).time_step;
      if (later && score[best] + log_change > next[s]) {
        next[s] = score[best] + log_change;
        from[s] = best;
      }
    }
    score = std::move(next);
    before.push_back(std::move(from));
  }
};

}  // namespace

std::vector<Sample> likeliest_path(const Model& model, std::span<const std::vector<Match>> evidence,
                                   const TrackerConfig& config) {
  Trellis trellis(model, config);
  for (std::size_t frame = 0; frame < evidence.size(); ++frame) {
    if (frame > 0) trellis.advance();
    if (!evidence[frame].empty()) trellis.weigh(evidence[frame], config);
  }
  std::vector<Sample> path(evidence.size());
  auto at = static_cast<std::uint32_t>(std::ranges::max_element(trellis.score) - trellis.score.begin());
  for (std::size_t frame = evidence.size(); frame-- > 0;) {
    path[frame] = model.sample(at);
    if (frame > 0) at = trellis.before[frame - 1][at];
  }
  return path;
}

}  // namespace lbea
