#include "runtime/src/track/tracker.hpp"

namespace lbea {
namespace {

void require(bool holds, const char* name, float value, const char* range) {
  if (!holds)
    throw Error(Status::bad_config,
                std::string("tracker configuration: ") + name + " is " + std::to_string(value) + "; give " + range);
}

void check(const TrackerConfig& config) {
  require(config.sharpness > 0 && std::isfinite(config.sharpness), "sharpness", config.sharpness, "a positive number");
  require(config.noise >= 0 && std::isfinite(config.noise), "noise", config.noise, "a length, or 0 for the default");
  require(config.persistence >= 0 && config.persistence < 1, "persistence", config.persistence,
          "a share from 0 to below 1");
  require(config.change >= 0 && config.change <= 1, "change", config.change, "a share from 0 to 1");
}

constexpr double never = -std::numeric_limits<double>::infinity();

// Viterbi's algorithm on the tracker's model: forward in time within a simulation, sometimes a change to another one.
struct Trellis {
  const Model& model;
  double log_stop, log_step, log_stay, log_change;
  std::vector<double> score;                       // per sample: score of the best path that ends there
  std::vector<std::vector<std::uint32_t>> before;  // per frame after the first, per sample: predecessor on that path

  Trellis(const Model& m, const TrackerConfig& config)
      : model(m),
        log_stop(std::log(1 - double{config.persistence})),
        log_step(std::log(double{config.persistence})),
        log_stay(std::log(1 - double{config.change})),
        log_change(std::log(double{config.change} / m.samples())),
        score(m.samples(), 0.0) {}

  void weigh(std::span<const Match> evidence, const TrackerConfig& config) {
    const Likelihood likelihood(evidence.front().distance, config);
    std::vector<double> logs(score.size(), std::log(likelihood(evidence.back().distance)));
    for (const Match& candidate : evidence)
      logs[model.sample_index(candidate.sample)] = std::log(likelihood(candidate.distance));
    for (std::size_t s = 0; s < score.size(); ++s) score[s] += logs[s];
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

struct Tracker::State {
  State(Model m, const TrackerConfig& c, const SensorViews& views)
      : model(std::move(m)),
        config(completed(c, model)),
        mesh_noise(double{DepthMetric{}.in(model.length_unit()).mesh_noise}),
        misfit_limit(views.test_misfit_limit()),
        probability(model.samples()),
        likelihood(model.samples()),
        first(model.simulations() + 1),
        simulations(model.simulations()),
        branches(model.branches()) {
    for (std::uint32_t s = 0; s < model.samples(); ++s) ++first[model.sample(s).simulation + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    reset();
  }

  void reset() noexcept;
  void predict() noexcept;
  void weigh(std::span<const Match> evidence) noexcept;
  void publish() noexcept;
  void judge(const SurfaceFit& fit) noexcept;

  Model model;
  TrackerConfig config;
  double mesh_noise;
  float misfit_limit;  // 0: no depth images, so no verdict
  double log_misfits = 0, weights = 0;
  std::uint64_t judged = 0;                     // frames
  std::vector<double> probability, likelihood;  // per sample
  std::vector<std::uint32_t> first;             // per simulation: its first sample
  std::vector<float> simulations, branches;
  TestState state;
};

void Tracker::State::reset() noexcept {
  std::ranges::fill(probability, 1.0 / static_cast<double>(probability.size()));
  state = {};
  log_misfits = weights = 0;
  judged = 0;
  publish();
}

// Within a simulation, probability moves forward by a geometrically distributed number of time steps. A share of it
// changes to any simulation, at most one time step before the mean time step reached.
void Tracker::State::predict() noexcept {
  const double stay = 1 - double{config.change};
  double reached = 0;  // mean time step
  for (std::uint32_t s = 0; s < model.samples(); ++s) reached += probability[s] * model.sample(s).time_step;
  double newcomers = 0;
  for (std::uint32_t s = 0; s < model.samples(); ++s) newcomers += model.sample(s).time_step + 1 >= reached ? 1 : 0;
  for (std::size_t simulation = 0; simulation + 1 < first.size(); ++simulation) {
    double carried = 0;
    for (std::uint32_t s = first[simulation]; s < first[simulation + 1]; ++s) {
      carried = double{config.persistence} * carried + (1 - double{config.persistence}) * probability[s];
      const bool newcomer = model.sample(s).time_step + 1 >= reached;
      probability[s] = stay * carried + (newcomer ? double{config.change} / std::max(newcomers, 1.0) : 0);
    }
    if (first[simulation] < first[simulation + 1])
      probability[first[simulation + 1] - 1] +=
          stay * double{config.persistence} * carried;  // no state follows the last one
  }
}

// A sample that is no candidate is as likely as the worst candidate: it may rank just below it.
void Tracker::State::weigh(std::span<const Match> evidence) noexcept {
  const Likelihood likelihood_of(evidence.front().distance, config);
  std::ranges::fill(likelihood, likelihood_of(evidence.back().distance));
  for (const Match& candidate : evidence)
    likelihood[model.sample_index(candidate.sample)] = likelihood_of(candidate.distance);
  double all = 0;
  for (std::size_t s = 0; s < probability.size(); ++s) all += probability[s] *= likelihood[s];
  for (double& p : probability) p /= all;
}

void Tracker::State::publish() noexcept {
  std::ranges::fill(simulations, 0.0f);
  std::ranges::fill(branches, 0.0f);
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    simulations[model.sample(s).simulation] += static_cast<float>(probability[s]);
  for (std::uint32_t i = 0; i < model.simulations(); ++i) branches[model.branch_of(i)] += simulations[i];
  const auto likeliest = static_cast<std::uint32_t>(std::ranges::max_element(probability) - probability.begin());
  state.sample = model.sample(likeliest);
  state.sample_probability = static_cast<float>(probability[likeliest]);
  state.simulation = static_cast<std::uint32_t>(std::ranges::max_element(simulations) - simulations.begin());
  state.simulation_probabilities = simulations;
  state.branch_probabilities = branches;
}

// Misfits scatter from frame to frame. Over a test their mean distinguishes a run of an unknown branch from one of a
// known branch. The weight of a frame is one over the square of its expected residual.
void Tracker::State::judge(const SurfaceFit& fit) noexcept {
  if (!(fit.misfit > 0) || !(misfit_limit > 0)) return;
  constexpr std::uint64_t least_frames = 4;
  constexpr float sure = 0.9f;
  const double residual = double{fit.residual}, misfit = double{fit.misfit};
  const double weight = misfit * misfit / (residual * residual + mesh_noise * mesh_noise);
  log_misfits += weight * std::log(misfit);
  weights += weight;
  state.misfit = static_cast<float>(std::exp(log_misfits / weights));
  if (++judged < least_frames) return;
  const bool one_branch = *std::ranges::max_element(branches) >= sure;
  state.verdict = state.misfit > misfit_limit ? Verdict::no_simulation_fits
                  : one_branch                ? Verdict::matched
                                              : Verdict::ambiguous;
}

Tracker::Tracker(Model model, const TrackerConfig& config, SensorViews views) {
  check(config);
  if (views.empty()) views = SensorViews::baked_into(model);
  state_ = std::make_unique<State>(std::move(model), config, views);
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
const TestState& Tracker::state() const noexcept { return state_->state; }
void Tracker::reset() noexcept { state_->reset(); }

const TestState& Tracker::update(const MatchResult& result) noexcept {
  const auto evidence = result.fit.candidates.empty() ? result.matches : result.fit.candidates;
  if (result.status == Status::low_coverage)
    state_->judge(result.fit);  // too little for a sample, but the misfit counts
  if (result.status != Status::ok || evidence.empty()) return state_->state;
  if (state_->state.frames++ > 0) state_->predict();
  state_->weigh(evidence);
  state_->publish();
  state_->judge(result.fit);
  return state_->state;
}

std::vector<Sample> likeliest_path(const Model& model, std::span<const std::vector<Match>> evidence,
                                   const TrackerConfig& wanted) {
  const TrackerConfig config = completed(wanted, model);
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
