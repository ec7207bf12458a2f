#include <lbea/forecast.hpp>

#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/forecast/channel_forecaster.hpp"
#include "runtime/src/model/model_view.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {
namespace {

constexpr std::size_t nodes = LearnedForecast::nodes, scores = LearnedForecast::shape_scores;

float between(float a, float b, float share) noexcept { return a + share * (b - a); }

}  // namespace

/// A line over time through the deviations from the mean shape of the frames around a node. Frames may lie on one side
/// of it alone: those after it are still to come.
struct NodeEvidence {
  float nearest = 1;                                   // distance of the nearest frame, in nodes
  float weight = 0, times = 0, squared_times = 0;      // sums over frames; times: since the node, in nodes
  std::array<float, scores> deviations{}, by_times{};  // the same, of deviations, and of deviations times times

  void add(float frame_weight, float time, std::span<const float> deviation) noexcept {
    const float by = frame_weight * (1 - std::abs(time));
    nearest = std::min(nearest, std::abs(time));
    weight += by;
    times += by * time;
    squared_times += by * time * time;
    for (std::size_t i = 0; i < scores; ++i) {
      deviations[i] += by * deviation[i];
      by_times[i] += by * time * deviation[i];
    }
  }
  /// At the node. Frames in quick succession do not determine the slope of the line.
  void write(std::span<float> into) const noexcept {
    constexpr float least_variance = 0.02f;  // of the times
    const float time = times / weight, variance = squared_times / weight - time * time + least_variance;
    for (std::size_t i = 0; i < scores; ++i) {
      const float mean = deviations[i] / weight, slope = (by_times[i] / weight - time * mean) / variance;
      into[i] = mean - slope * time;
    }
  }
};

struct Forecast::State {
  explicit State(Model of);

  void reset() noexcept;
  [[nodiscard]] bool add(const MatchResult& result) noexcept;
  [[nodiscard]] bool has_hidden_part(const FitNumbers& fit) const noexcept;
  void forecast() noexcept;
  [[nodiscard]] std::size_t first_seen() const noexcept;
  void fill_history(std::size_t first) noexcept;
  void add_window(ForecastWindow window, float share) noexcept;
  [[nodiscard]] std::size_t row_of(std::size_t row) const noexcept;
  void add_bounds(std::size_t row, float share) noexcept;
  void divide(double ridge, const float* variances) noexcept;
  [[nodiscard]] bool is_over() const noexcept;
  void sum_branches() noexcept;

  Model model;
  const ModelView& view;
  const LearnedForecast& learned;
  std::span<const float> shapes;  // s x scores
  const Kernels& code;
  ForecastTimes times;
  std::uint32_t runs;  // trained
  std::vector<float> mean_parameters;
  std::array<NodeEvidence, nodes> evidence{};  // nodes are numbered from 1
  float latest = 0;                            // in nodes
  std::uint64_t hidden_frames = 0;
  std::array<float, scores> shape{};  // deviation of the frame's shape
  std::vector<float> history, components, divided, of_runs;
  std::vector<float> run_weights, branches;
  std::vector<ParameterForecast> parameters;
  ChannelForecaster channels;
  TestForecast state;
};

[[gnu::cold]] Forecast::State::State(Model of)
    : model(std::move(of)),
      view(model.view()),
      learned(*view.forecast),
      shapes(view.depth_images->regression.shapes),
      code(kernels()),
      times(view.sample_times),
      runs(LearnedForecast::trained_runs(view.info.simulations)),
      history(LearnedForecast::features),
      components(LearnedForecast::most_components),
      divided(LearnedForecast::most_components),
      of_runs(runs),
      run_weights(view.info.simulations),
      branches(view.branches),
      parameters(view.info.parameters),
      channels(view) {
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    double sum = 0, given = 0;
    for (std::uint32_t run = 0; run < view.info.simulations; ++run)
      if (const double value = model.parameter(run, static_cast<std::uint32_t>(p)); std::isfinite(value))
        sum += value, ++given;
    mean_parameters.push_back(static_cast<float>(sum / std::max(given, 1.0)));
  }
  state.run_weights = run_weights;
  state.branch_probabilities = branches;
  state.parameters = parameters;
  state.channels = channels.all();
  reset();
}

void Forecast::State::reset() noexcept {
  evidence = {};
  latest = 0;
  hidden_frames = 0;
  state.frames = 0;
  state.test_time_s = 0;
  forecast();
}

/// Frames between two nodes count for both. Of many frames, where they lie counts, not their number.
bool Forecast::State::add(const MatchResult& result) noexcept {
  const float time = result.fit.test_time;
  const bool is_explained = result.verdict == Verdict::matched || result.verdict == Verdict::ambiguous;
  if (result.status != Status::ok || !is_explained || !(time >= 0) || !(times.duration_s > 0)) return false;
  const float at = std::min(static_cast<float>(static_cast<double>(time) / times.duration_s) * nodes, float{nodes});
  const float place = at * LearnedForecast::means_per_node;
  const auto before = std::min(static_cast<std::size_t>(place), nodes * LearnedForecast::means_per_node - 1);
  const float* mean = &learned.means[before * scores];
  for (std::size_t i = 0; i < scores; ++i)
    shape[i] = -between(mean[i], mean[scores + i], place - static_cast<float>(before));
  for (const WeightedSample& sample : result.fit.estimate) {
    const std::uint32_t row = model.sample_index(sample.sample);
    if (row == view.info.samples) return false;
    for (std::size_t i = 0; i < scores; ++i) shape[i] += sample.weight * shapes[row * scores + i];
  }
  const float error = std::isfinite(result.fit.error_90) ? result.fit.error_90 : 2 * result.fit.spread;
  const float weight = 1 / std::max(error * error, std::numeric_limits<float>::min());
  const auto node = static_cast<std::size_t>(at);  // the one before the frame
  const float share = at - static_cast<float>(node);
  if (node > 0) evidence[node - 1].add(weight, share, shape);
  if (node < nodes && share > 0) evidence[node].add(weight, share - 1, shape);
  latest = std::max(latest, at);
  if (has_hidden_part(result.fit)) ++hidden_frames;
  state.test_time_s = std::max(state.test_time_s, double{time});
  ++state.frames;
  return true;
}

/// The bake has learned other bounds for frames with a hidden part, and none where most is hidden.
bool Forecast::State::has_hidden_part(const FitNumbers& fit) const noexcept {
  const DepthImages& images = *view.depth_images;
  const double spread = double{fit.spread}, per_spread = double{fit.error_90} / spread;
  const auto difference = [&](const ErrorBound& bound) { return std::abs(per_spread - bound.per_spread_at(spread)); };
  return std::isnan(fit.error_90) || difference(images.hidden_error_bound) < difference(images.error_bound);
}

/// The first node with a frame in its half of the way to its neighbors, or else node 1.
std::size_t Forecast::State::first_seen() const noexcept {
  constexpr float near = 0.5f;
  std::size_t first = 1;
  while (first < nodes && !(evidence[first - 1].nearest <= near)) ++first;
  return evidence[first - 1].nearest <= near ? first : 1;
}

/// A node without frames has the deviations of the one before.
void Forecast::State::fill_history(std::size_t first) noexcept {
  std::size_t last = first - 1;
  for (std::size_t node = last; node < nodes; ++node) {
    if (evidence[node].weight > 0) last = node;
    if (evidence[last].weight > 0) evidence[last].write(std::span(history).subspan(node * scores, scores));
  }
}

/// Of the numbers: 0 before anything is seen, 1 + the number of a window.
std::size_t Forecast::State::row_of(std::size_t row) const noexcept {
  return hidden_frames > state.frames / 2 ? row + 1 + ForecastWindow::count : row;
}

void Forecast::State::add_bounds(std::size_t row, float share) noexcept {
  const double* numbers = &learned.numbers[row * LearnedForecast::numbers_per_window(parameters.size())];
  state.error_90 += share * static_cast<float>(numbers[0]);
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    parameters[p].r2 += share * static_cast<float>(numbers[2 + 3 * p]);
    parameters[p].bound_90 += share * static_cast<float>(numbers[3 + 3 * p]);
  }
  channels.add_bounds(row, share);
}

/// What a ridge leaves of the components.
void Forecast::State::divide(double ridge, const float* variances) noexcept {
  for (std::size_t c = 0; c < components.size(); ++c) {
    const float by = variances[c] + static_cast<float>(ridge);
    divided[c] = by > 0 ? components[c] / by : 0;
  }
}

/// Adds the forecast of this window with this share.
void Forecast::State::add_window(ForecastWindow window, float share) noexcept {
  if (!(share > 0)) return;
  const std::size_t row = row_of(1 + window.number());
  const double* numbers = &learned.numbers[row * LearnedForecast::numbers_per_window(parameters.size())];
  add_bounds(row, share);
  constexpr std::size_t most = LearnedForecast::most_components;
  const float* variances = &learned.variances[window.number() * most];
  code.project(&learned.components[window.sizes_before() * most * scores], most, window.size() * scores,
               &history[(window.first - 1) * scores], components.data());
  divide(numbers[1], variances);
  code.project(&learned.runs[window.number() * runs * most], runs, most, divided.data(), of_runs.data());
  for (std::size_t i = 0; i < runs; ++i)
    run_weights[LearnedForecast::trained_run(i, view.info.simulations)] += share * of_runs[i];
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    float off = 0;  // from the mean
    divide(numbers[4 + 3 * p], variances);
    code.project(&learned.parameters[(window.number() * parameters.size() + p) * most], 1, most, divided.data(), &off);
    parameters[p].value += share * off;
  }
  channels.add(window.number(), row, components, share);
}

/// Between two nodes, a mean of theirs. A test that was seen from its beginning starts with what all runs share.
void Forecast::State::forecast() noexcept {
  const std::size_t first = first_seen();
  fill_history(first);
  std::ranges::fill(run_weights, 0.0f);
  for (std::size_t i = 0; i < runs; ++i)
    run_weights[LearnedForecast::trained_run(i, view.info.simulations)] = 1 / static_cast<float>(runs);
  for (std::size_t p = 0; p < parameters.size(); ++p) parameters[p] = {mean_parameters[p], 0, 0};
  state.error_90 = 0;
  const float at = evidence[first - 1].weight > 0 ? latest : 0;
  channels.begin(at);
  const auto node = std::min(static_cast<std::size_t>(at), nodes - 1);
  const float share = at - static_cast<float>(node);  // of the later node
  if (node >= first)
    add_window({first, node}, 1 - share);
  else if (first == 1)
    add_bounds(row_of(0), 1 - share);
  add_window({first, std::max(node + 1, first)}, node >= first || first == 1 ? share : 1);
  if (state.frames == 0 || is_over()) channels.forget_time();
  sum_branches();
}

/// Whether the test lasts longer than the simulations, by more than half of the interval between their states.
bool Forecast::State::is_over() const noexcept {
  const double interval_s = times.duration_s * view.info.simulations / view.info.samples;
  return state.test_time_s > times.duration_s + 0.5 * interval_s;
}

void Forecast::State::sum_branches() noexcept {
  std::ranges::fill(branches, 0.0f);
  for (std::uint32_t run = 0; run < view.info.simulations; ++run)
    branches[view.simulation_branches[run]] += run_weights[run];
  float all = 0;
  for (float& probability : branches) all += probability = std::clamp(probability, 0.0f, 1.0f);
  for (float& probability : branches) probability /= all;  // of weights that add up to 1, one is positive
}

[[gnu::cold]] Forecast::Forecast(Model model) {
  if (!is_in(model))
    throw Error(Status::bad_config, "the model has no forecast; bake it again with views and several runs");
  state_ = std::make_unique<State>(std::move(model));
}
Forecast::~Forecast() = default;
Forecast::Forecast(Forecast&&) noexcept = default;
Forecast& Forecast::operator=(Forecast&&) noexcept = default;
bool Forecast::is_in(const Model& model) noexcept { return model.view().forecast != nullptr; }

const TestForecast& Forecast::update(const MatchResult& result) noexcept {
  if (state_->add(result)) state_->forecast();
  return state_->state;
}
const TestForecast& Forecast::state() const noexcept { return state_->state; }
void Forecast::reset() noexcept { state_->reset(); }

void replace_rates(const Model& model, const TestForecast& forecast, const FitNumbers& frame,
                   std::span<ChannelValue> channels) noexcept {
  if (forecast.frames == 0 || double{frame.test_time} != forecast.test_time_s) return;
  for (std::uint32_t c = 0; c < std::min(channels.size(), forecast.channels.size()); ++c) {
    if (!is_rate(model.channel(c).kind)) continue;
    channels[c].value = forecast.channels[c].value;
    if (!std::isnan(channels[c].bound_90)) channels[c].bound_90 = forecast.channels[c].bound_90;
  }
}

[[gnu::cold]] std::vector<float> final_positions(const Model& model, const TestForecast& forecast) {
  std::vector<float> positions(std::size_t{3} * model.nodes(), 0.0f);
  for (std::uint32_t sample = 0; sample < model.samples(); ++sample) {
    const std::uint32_t run = model.sample(sample).simulation;
    const bool is_last = sample + 1 == model.samples() || model.sample(sample + 1).simulation != run;
    if (!is_last || forecast.run_weights[run] == 0) continue;
    const auto of_run = model.node_positions(sample);
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] += forecast.run_weights[run] * of_run[i];
  }
  return positions;
}

}  // namespace lbea
