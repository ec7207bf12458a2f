#include "tools/eval/trial.hpp"

#include "precompute/rig/counter_random.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/depth/pose.hpp"
#include "tools/eval/mesh_series.hpp"

#include <lbea/inference.hpp>
#include <lbea/rigs.hpp>
#include <lbea/test_history.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace lbea::tool {
namespace {

std::uint32_t simulation_named(const Model& model, const std::string& name) {
  std::uint32_t simulation = 0;
  while (simulation < model.simulations() && model.simulation_name(simulation) != name) ++simulation;
  return simulation;
}

Point middle(std::span<const float> positions) {
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < positions.size(); ++i) sum[i % 3] += double{positions[i]};
  const double count = static_cast<double>(positions.size() / 3);
  return {static_cast<float>(sum[0] / count), static_cast<float>(sum[1] / count), static_cast<float>(sum[2] / count)};
}

std::int64_t nanoseconds(double seconds) { return std::llround(seconds * 1e9); }
double seconds(std::int64_t nanoseconds) { return 1e-9 * static_cast<double>(nanoseconds); }

struct Matchers {
  Matcher vtp, lbea, fit;
};

/// A rig of the test.
struct TestRig {
  bake::VirtualSensor sensor;
  bake::SensingNoise noise;
  RigidTransform T_reference_sensor;
  std::optional<Point> hidden_place{};
  std::vector<Point> points{};  // of the current frame
  std::int64_t stamp_ns = 0;    // the same
};

class Test {
 public:
  Test(const TestSetup& setup, const Experiment& experiment, const TrialSettings& settings)
      : setup_(setup),
        name_(experiment.name),
        model_(setup.model),
        settings_(settings),
        reader_(setup.opened(experiment)),
        mesh_(reader_->mesh(), model_, settings.mapping),
        own_simulation_(simulation_named(model_, experiment.name)),
        observed_(model_.nodes(), 0),
        history_(model_),
        box_(box_of_samples(model_)) {
    config_.T_reference_sensor = settings.sensor.sensor.T_reference_sensor;
    add_rig(settings.sensor, settings.disturbance);
    for (const io::SensorDescription& rig : settings.more_rigs)
      add_rig(rig, settings.disturbs_first_rig_alone ? Disturbance{} : settings.disturbance);
    for (const std::uint32_t node : model_.vertex_nodes(0)) observed_[node] = 1;
    find_field();
    if (settings.meshes.empty()) return;
    std::filesystem::create_directories(settings.meshes / experiment.name);
    meshes_.emplace(model_, settings.meshes / experiment.name);
  }

  TestTrial run(const FrameDone& done) {
    TestTrial trial;
    trial.contained = own_simulation_ < model_.simulations();
    Matchers matchers{matcher(Method::vtp), matcher(Method::lbea), matcher(Method::fit)};
    Tracker tracker(model_);
    history_.reset();
    judge_forecasts();
    judge_channels();
    if (!settings_.estimate_pose) history_.fix_pose();
    if (settings_.knows_impact) history_.set_impact(0);
    prepare_rigs();
    for (std::uint32_t step = settings_.first_step; step < reader_->states(); step += settings_.every) {
      for (std::size_t rig = 0; rig < rigs_.size(); ++rig) sense(rig, step);
      read_truth(step);
      const std::span<const Point> points = rigs_.front().points;
      trial.frames.push_back(frame(step, points, matchers, tracker));
      keep_if_worst(trial.worst, trial.frames.back(), points);
      if (done()) break;
    }
    if (meshes_) meshes_->finish();
    if (judge_) trial.forecast = judge_->take();
    trial.named = model_.simulation_name(tracker.state().simulation);
    score_path(trial);
    return trial;
  }

 private:
  void add_rig(const io::SensorDescription& rig, const Disturbance& disturbance) {
    const std::uint32_t pixels = rig.sensor.width_px * rig.sensor.height_px;
    config_.max_points = rigs_.empty() ? pixels : std::max(config_.max_points, pixels);
    rigs_.push_back({bake::VirtualSensor(rig.sensor, reader_->mesh().nodes(), reader_->mesh().elements),
                     tool::disturbed(rig.noise, disturbance), rig.sensor.T_reference_sensor});
  }
  void prepare_rigs() {
    if (settings_.more_rigs.empty()) return;
    std::vector<Rig> rigs{{.T_reference_sensor = config_.T_reference_sensor}};
    for (std::size_t i = 0; i < settings_.more_rigs.size(); ++i)
      rigs.push_back({settings_.more_rigs[i].sensor.T_reference_sensor, setup_.more_views[i]});
    rig_matcher_.emplace(model_, config_, rigs);
    if (!settings_.estimate_pose) rig_matcher_->fix_poses();
    if (settings_.knows_impact) rig_matcher_->set_impact(0);
  }
  /// Sets state_.
  void read(std::uint32_t step) {
    if (std::exchange(read_step_, step) != step) reader_->read(step, state_);
  }
  /// The same and truth_.
  void read_truth(std::uint32_t step) {
    read(step);
    std::vector<float> positions = state_.positions;
    hide_free_nodes(reader_->mesh(), state_.alive, positions);
    mesh_.positions(positions, truth_);
  }
  /// Seconds since the impact.
  [[nodiscard]] double time_s(std::uint32_t step) const {
    return (reader_->time_s(step) - reader_->time_s(settings_.impact_step)) * settings_.time_factor;
  }
  /// What a rig sees in the capture of a state. The frames of rigs with other clocks are chosen by what the matcher
  /// knows of these.
  void sense(std::size_t number, std::uint32_t step) {
    TestRig& rig = rigs_[number];
    rig.stamp_ns = nanoseconds(time_s(step));
    if (number > 0 && settings_.clock_offset_ms != 0) {
      const std::int64_t behind_ns = nanoseconds(settings_.clock_offset_ms / 1000);
      step = nearest_state(seconds(rig.stamp_ns + behind_ns - rig_matcher_->rigs()[number].clock_correction_ns));
      rig.stamp_ns = nanoseconds(time_s(step)) - behind_ns;
    }
    read(step);
    const std::uint64_t seed = bake::frame_seed(settings_.seed + number, step);
    rig.points = rig.sensor.sense({state_.positions, exposed_elements(reader_->mesh(), state_.alive)}, rig.noise, seed);
    if (number > 0 && settings_.disturbs_first_rig_alone) return;
    if (settings_.disturbance.window > 0)
      rig.points = tool::smeared(std::move(rig.points), rig.sensor.sensor(), settings_.disturbance.window);
    if (settings_.disturbance.same_place && !rig.hidden_place && !rig.points.empty())
      rig.hidden_place = any_of_them(rig.points, seed);
    rig.points = tool::disturbed(std::move(rig.points), settings_.disturbance, seed, rig.hidden_place);
    const Disturbance& disturbance = settings_.disturbance;
    if (disturbance.pose_error_deg > 0 || disturbance.pose_error > 0)
      rig.points = tool::misplaced(std::move(rig.points), disturbance, share_of_pose_error(step),
                                   rig.T_reference_sensor, middle(model_.node_positions(0)), pose_seed() + number);
  }
  [[nodiscard]] std::uint32_t nearest_state(double time) const {
    std::uint32_t step = 0;
    while (step + 1 < reader_->states() && time_s(step) + time_s(step + 1) < 2 * time) ++step;
    return step;
  }
  [[nodiscard]] MatchResult match_rigs(const Frame& first) {
    std::vector<Frame> frames(rigs_.size(), first);
    for (std::size_t rig = 1; rig < rigs_.size(); ++rig) {
      frames[rig].points = rigs_[rig].points;
      frames[rig].stamp_ns = rigs_[rig].stamp_ns;
    }
    return rig_matcher_->match(frames);
  }
  [[nodiscard]] RigidTransform pose_correction() const {
    return rig_matcher_ ? rig_matcher_->pose_correction(0) : history_.pose_correction();
  }
  [[nodiscard]] double share_of_pose_error(std::uint32_t step) const {
    const double last = std::max(reader_->states(), 2u) - 1;
    return settings_.disturbance.is_drifting ? step / last : 1;
  }
  [[nodiscard]] std::uint64_t pose_seed() const { return settings_.seed ^ std::hash<std::string>{}(name_); }
  /// The frame of the current state.
  FrameTrial frame(std::uint32_t step, std::span<const Point> points, Matchers& matchers, Tracker& tracker) {
    FrameTrial row;
    row.step = step;
    row.time_s = time_s(step);
    row.points = points.size();
    row.errors.fill(not_measured);
    row.samples.fill(model_.samples());
    row.best = oracle(model_, truth_);
    row.own = model_.sample_index({own_simulation_, step});
    const Frame frame{step, nanoseconds(row.time_s), points};
    const MatchResult by_vtp = matchers.vtp.match(frame), by_lbea = matchers.lbea.match(frame),
                      by_fit = rig_matcher_             ? match_rigs(frame)
                               : settings_.frames_alone ? matchers.fit.match(frame)
                                                        : matchers.fit.match(frame, history_);
    score_first(row, EvaluatedMethod::vtp, by_vtp.matches);
    score_first(row, EvaluatedMethod::lbea, by_lbea.matches);
    score_fit(row, by_fit);
    score_tracked(row, tracker.update(by_fit));
    if (judge_) judge_->add(by_fit, row.time_s);
    if (channel_judge_) {
      row.channels = channel_judge_->scores(by_fit, judge_ ? &judge_->state() : nullptr, step);
      row.channels_ns = channel_judge_->evaluation_ns(by_fit);
    }
    if (setup_.icp) score_icp(row, points);
    row.leading_coordinates = by_lbea.leading_coordinates;
    const PoseError left = left_over(pose_correction(), settings_.disturbance, share_of_pose_error(step),
                                     middle(model_.node_positions(0)), pose_seed());
    row.pose_deg = left.turn_deg;
    row.pose_error = left.shift;
    if (rig_matcher_)
      row.clock_error_ms = settings_.clock_offset_ms - 1000 * seconds(rig_matcher_->rigs()[1].clock_correction_ns);
    row.vtp_ns = by_vtp.elapsed_ns;
    row.lbea_ns = by_lbea.elapsed_ns;
    return row;
  }

  void keep_if_worst(WorstFrame& worst, const FrameTrial& row, std::span<const Point> points) const {
    const auto fit = static_cast<std::size_t>(EvaluatedMethod::fit);
    const double excess = row.errors[fit] - row.best.error, before = worst.columns > 0 ? worst.fit - worst.oracle : 0;
    const SensorViews views = SensorViews::baked_into(model_);
    if (views.empty() || !(excess > before)) return;
    worst = {row.step,
             row.best.error,
             row.errors[fit],
             views.columns(),
             {depth_image(points, views), views.depth_image(row.samples[fit]), views.depth_image(row.best.sample)}};
  }
  /// The frame as fit compares it with the images of the samples.
  [[nodiscard]] std::vector<float> depth_image(std::span<const Point> points, const SensorViews& views) const {
    CloudIndex index(envelope_grid(model_.view().envelope), static_cast<std::uint32_t>(points.size()));
    index.build(points, product(pose_correction(), config_.T_reference_sensor));
    const DepthCamera& camera = views.data()->camera;
    FrameDepthImage image(camera);
    image.build(index);
    std::vector<float> depths;
    for (const float cell : image.cells().first(camera.cells()))
      depths.push_back(cell < 0 ? std::numeric_limits<float>::quiet_NaN()
                                : camera.depth_origin + camera.depth_step * cell);
    return depths;
  }

  void score_fit(FrameTrial& row, const MatchResult& result) {
    score_first(row, EvaluatedMethod::look_alike, result.fit.candidates);
    score_first(row, EvaluatedMethod::fit, result.matches);
    if (!result.fit.estimate.empty()) {
      infer_positions(model_, result.fit, inferred_);
      const double error = experiment_error(truth_, inferred_.mean);
      row.errors[static_cast<std::size_t>(EvaluatedMethod::estimate)] = error;
      if (const double bound = double{result.fit.error_90}; bound > 0)
        row.of(Bounded::estimate) = {error <= bound ? 1.0 : 0.0, bound};
      row.of(Bounded::positions) = check_bounds(truth_, 3);
      score_field(row, result);
      if (meshes_) {
        const std::string number = std::to_string(1000 + row.step).substr(1);
        meshes_->add_estimate(number, result.fit, row.time_s);
        meshes_->add_match(number, model_.sample_index(result.matches.front().sample), row.time_s);
      }
    }
    evidence_.push_back(ranked(result.fit.candidates, result.fit.ranks));
    row.status = result.status;
    row.verdict = result.verdict;
    row.fit = result.fit;
    row.fit.candidates = {};
    row.fit.ranks = {};
    row.fit.estimate = {};
    static_cast<FrameNumbers&>(row) = result;
    row.fit_ns = result.elapsed_ns;
  }

  void score_tracked(FrameTrial& row, const TestState& state) const {
    row.test_verdict = state.verdict;
    if (state.frames > 0) score(row, EvaluatedMethod::tracked, model_.sample_index(state.sample));
    row.simulation = state.simulation;
    row.simulation_probability = state.simulation_probabilities[state.simulation];
    row.branch_probability = state.branch_probabilities[model_.branch_of(state.simulation)];
  }
  void score_icp(FrameTrial& row, std::span<const Point> points) const {
    const auto start = std::chrono::steady_clock::now();
    const auto spread = spread_points(points, config_.T_reference_sensor, box_, IcpSettings{}.points);
    if (spread.size() >= 3) score(row, EvaluatedMethod::icp, setup_.icp->match(spread).sample);
    row.icp_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  void judge_forecasts() {
    if (!Forecast::is_in(model_) || reader_->states() == 0) return;
    read_truth(reader_->states() - 1);
    judge_.emplace(model_, truth_);
  }
  void judge_channels() {
    if (model_.channels() == 0) return;
    const auto read_state = [&](std::uint32_t state) -> ChannelJudge::TrueState {
      read_truth(state);
      return {truth_, true_fields(mesh_, *reader_, state_, model_)};
    };
    channel_judge_.emplace(model_, setup_.channels, *reader_, settings_.time_factor, read_state, name_);
  }
  void find_field() {
    if (model_.fields() == 0 || !mesh_.same_mesh() || model_.field(0).location != FieldInfo::Location::element) return;
    const auto found = std::ranges::find(reader_->fields(), model_.field(0).name, &bake::SimulationField::name);
    has_field_ = found != reader_->fields().end();
    run_field_ = static_cast<std::size_t>(found - reader_->fields().begin());
  }
  void score_path(TestTrial& trial) {
    const auto path = likeliest_path(model_, evidence_);
    for (std::size_t i = 0; i < path.size(); ++i) {
      read_truth(trial.frames[i].step);
      score(trial.frames[i], EvaluatedMethod::path, model_.sample_index(path[i]));
    }
  }
  void score_field(FrameTrial& row, const MatchResult& result) {
    if (!has_field_) return;
    infer_field(model_, 0, result.fit, inferred_);
    std::vector<float> matched(model_.field_size(0)), truth;
    model_.read_field(0, model_.sample_index(result.matches.front().sample), matched);
    for (const std::uint32_t element : mesh_.elements())
      truth.push_back(state_.alive[element] != 0 ? state_.fields[run_field_][element]
                                                 : std::numeric_limits<float>::quiet_NaN());
    double magnitude = 0, of_matched = 0, of_inferred = 0, of_hidden = 0;
    std::size_t hidden = 0, all_compared = 0;
    for (std::size_t e = 0; e < model_.elements(); ++e) {
      const double value = double{truth[e]}, off = std::abs(double{inferred_.mean[e]} - value);
      const double off_matched = std::abs(double{matched[e]} - value);
      if (std::isnan(off + off_matched)) continue;  // eroded in one of the three
      ++all_compared;
      magnitude += std::abs(value);
      of_matched += off_matched;
      of_inferred += off;
      const auto nodes = model_.element_nodes().subspan(4 * e, 4);
      if (std::ranges::all_of(nodes, [&](std::uint32_t node) { return observed_[node] != 0; })) continue;
      of_hidden += off;
      ++hidden;
    }
    const auto all = static_cast<double>(all_compared);
    row.field = {magnitude / all, of_matched / all, of_inferred / all};
    if (hidden > 0) row.field.hidden = of_hidden / static_cast<double>(hidden);
    row.of(Bounded::field) = check_bounds(truth, 1);
  }
  /// Of inferred_. A group of `components` values has one bound.
  [[nodiscard]] BoundCheck check_bounds(std::span<const float> truth, std::size_t components) const {
    if (inferred_.bound_90.empty()) return {};
    BoundCheck check{0, 0};
    const auto is_known = [&](std::size_t i) {
      return !std::isnan(inferred_.mean[i * components] - truth[i * components]) && !std::isnan(inferred_.bound_90[i]);
    };
    double count = 0;
    for (std::size_t i = 0; i < inferred_.bound_90.size(); ++i) count += is_known(i) ? 1 : 0;
    for (std::size_t i = 0; i < inferred_.bound_90.size(); ++i) {
      if (!is_known(i)) continue;  // eroded in the run or in the estimate
      double error = 0;
      for (std::size_t c = i * components; c < (i + 1) * components; ++c)
        error = std::hypot(error, double{inferred_.mean[c]} - double{truth[c]});
      const double bound = double{inferred_.bound_90[i]};
      check.within += (error <= bound ? 1 : 0) / count;
      check.mean += bound / count;
    }
    return check;
  }

  [[nodiscard]] Matcher matcher(Method method) const {
    MatcherConfig config = config_;
    config.method = method;
    return Matcher(model_, config);
  }
  void score(FrameTrial& row, EvaluatedMethod method, std::uint32_t sample) const {
    row.samples[static_cast<std::size_t>(method)] = sample;
    row.errors[static_cast<std::size_t>(method)] = experiment_error(truth_, model_.node_positions(sample));
  }
  void score_first(FrameTrial& row, EvaluatedMethod method, std::span<const Match> matches) const {
    if (!matches.empty()) score(row, method, model_.sample_index(matches.front().sample));
  }

  const TestSetup& setup_;
  const std::string name_;
  const Model& model_;
  const TrialSettings& settings_;
  std::unique_ptr<bake::SimulationReader> reader_;
  TrueMesh mesh_;
  std::vector<TestRig> rigs_;
  std::optional<RigMatcher> rig_matcher_;  // with more than one rig
  MatcherConfig config_;
  std::uint32_t own_simulation_;
  std::vector<std::uint8_t> observed_;  // per node of the model
  TestHistory history_;
  SampleBox box_;
  std::size_t run_field_ = 0;
  bool has_field_ = false;
  bake::SimulationState state_;
  std::optional<std::uint32_t> read_step_;  // that state_ is of
  std::vector<float> truth_;
  std::vector<std::vector<Match>> evidence_;  // per frame
  Inferred inferred_;
  std::optional<MeshSeries> meshes_;
  std::optional<ForecastJudge> judge_;
  std::optional<ChannelJudge> channel_judge_;
};

}  // namespace

TestTrial run_test(const TestSetup& setup, const Experiment& experiment, const TrialSettings& settings,
                   const FrameDone& done) {
  TestTrial trial = Test(setup, experiment, settings).run(done);
  trial.experiment = experiment.name;
  return trial;
}

}  // namespace lbea::tool
