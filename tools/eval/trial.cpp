#include "tools/eval/trial.hpp"

#include "adapters/export/vtu.hpp"
#include "precompute/rig/counter_random.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "tools/eval/mesh_series.hpp"
#include "tools/eval/true_mesh.hpp"

#include <lbea/inference.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>

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

std::array<std::array<double, 3>, 2> box_of_samples(const Model& model) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::array<std::array<double, 3>, 2> box{{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}}};
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const auto positions = model.node_positions(s);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      box[0][i % 3] = std::min(box[0][i % 3], double{positions[i]});
      box[1][i % 3] = std::max(box[1][i % 3], double{positions[i]});
    }
  }
  return box;
}

class Test {
 public:
  Test(const Arena& arena, const Experiment& experiment, const TrialSettings& settings)
      : arena_(arena),
        model_(arena.model),
        settings_(settings),
        reader_(experiment.open()),
        mesh_(reader_->mesh(), model_),
        sensor_(settings.sensor.sensor, reader_->mesh().nodes(), reader_->mesh().elements, 1),
        noise_(disturbed(settings.sensor.noise, settings.disturbance)),
        own_simulation_(simulation_named(model_, experiment.name)),
        observed_(model_.nodes(), 0),
        box_(box_of_samples(model_)) {
    config_.T_reference_sensor = settings.sensor.sensor.T_reference_sensor;
    if (settings.disturbance.pose_error_deg > 0)
      config_.T_reference_sensor = turned(config_.T_reference_sensor, settings.disturbance.pose_error_deg,
                                          middle(model_.node_positions(0)), settings.seed);
    config_.max_points = settings.sensor.sensor.width_px * settings.sensor.sensor.height_px;
    for (const std::uint32_t node : model_.vertex_nodes(0)) observed_[node] = 1;
    find_field();
    if (settings.meshes.empty()) return;
    folder_ = settings.meshes / experiment.name;
    std::filesystem::create_directories(folder_);
  }

  TestTrial run(const FrameDone& done);

 private:
  FrameTrial frame(std::uint32_t step, Matcher& vtp, Matcher& lbea, Matcher& fit, Tracker& tracker);
  void find_field();
  void score_path(TestTrial& trial);
  void write_meshes(const FrameTrial& row, const MatchResult& result);
  [[nodiscard]] FieldError field_error(const MatchResult& result);
  [[nodiscard]] Matcher matcher(Method method) const {
    MatcherConfig config = config_;
    config.method = method;
    return Matcher(model_, config, method == Method::fit ? arena_.views : SensorViews());
  }
  void score(FrameTrial& row, Contender contender, std::uint32_t sample) const {
    row.samples[static_cast<std::size_t>(contender)] = sample;
    row.errors[static_cast<std::size_t>(contender)] = experiment_error(truth_, model_.node_positions(sample));
  }
  void score_first(FrameTrial& row, Contender contender, std::span<const Match> matches) const {
    if (!matches.empty()) score(row, contender, model_.sample_index(matches.front().sample));
  }

  const Arena& arena_;
  const Model& model_;
  const TrialSettings& settings_;
  std::unique_ptr<bake::SimulationReader> reader_;
  TrueMesh mesh_;
  bake::VirtualSensor sensor_;
  bake::SensingNoise noise_;
  MatcherConfig config_;
  std::uint32_t own_simulation_;
  std::vector<std::uint8_t> observed_;  // per node of the model
  std::array<std::array<double, 3>, 2> box_;
  std::size_t run_field_ = 0;
  bool has_field_ = false;
  bake::SimulationState state_;
  std::vector<float> truth_;
  std::vector<std::vector<Match>> evidence_;  // per frame
  Inferred inferred_;
  std::filesystem::path folder_;  // of the meshes
  std::vector<io::PvdEntry> estimates_, matches_;
};

void Test::find_field() {
  if (model_.fields() == 0 || !mesh_.same_mesh() || model_.field(0).location != FieldInfo::Location::element) return;
  const auto found = std::ranges::find(reader_->fields(), model_.field(0).name, &bake::SimulationField::name);
  has_field_ = found != reader_->fields().end();
  run_field_ = static_cast<std::size_t>(found - reader_->fields().begin());
}

TestTrial Test::run(const FrameDone& done) {
  TestTrial trial;
  trial.contained = own_simulation_ < model_.simulations();
  Matcher vtp = matcher(Method::vtp), lbea = matcher(Method::lbea), fit = matcher(Method::fit);
  Tracker tracker(model_);
  for (std::uint32_t step = settings_.first_step; step < reader_->states(); step += settings_.every) {
    trial.frames.push_back(frame(step, vtp, lbea, fit, tracker));
    if (done()) break;
  }
  if (!folder_.empty()) {
    io::write_pvd(folder_ / "estimate.pvd", estimates_);
    io::write_pvd(folder_ / "matched.pvd", matches_);
  }
  trial.named = model_.simulation_name(tracker.state().simulation);
  score_path(trial);
  return trial;
}

void Test::score_path(TestTrial& trial) {
  const auto path = likeliest_path(model_, evidence_);
  for (std::size_t i = 0; i < path.size(); ++i) {
    reader_->read(trial.frames[i].step, state_);
    mesh_.positions(state_.positions, truth_);
    score(trial.frames[i], Contender::path, model_.sample_index(path[i]));
  }
}

FrameTrial Test::frame(std::uint32_t step, Matcher& vtp, Matcher& lbea, Matcher& fit, Tracker& tracker) {
  reader_->read(step, state_);
  mesh_.positions(state_.positions, truth_);
  const std::uint64_t seed = bake::frame_seed(settings_.seed, step);
  const auto points =
      disturbed(sensor_.sense({state_.positions, state_.alive}, noise_, seed), settings_.disturbance, seed);
  FrameTrial row;
  row.step = step;
  row.time_s = (reader_->time_s(step) - reader_->time_s(settings_.impact_step)) * settings_.time_factor;
  row.points = points.size();
  row.errors.fill(not_measured);
  row.samples.fill(model_.samples());
  row.best = oracle(model_, truth_);
  row.own = model_.sample_index({own_simulation_, step});
  const Frame frame{step, static_cast<std::int64_t>(std::llround(row.time_s * 1e9)), points};

  const MatchResult by_vtp = vtp.match(frame), by_lbea = lbea.match(frame), by_fit = fit.match(frame);
  score_first(row, Contender::vtp, by_vtp.matches);
  score_first(row, Contender::lbea, by_lbea.matches);
  score_first(row, Contender::look_alike, by_fit.fit.candidates);
  score_first(row, Contender::fit, by_fit.matches);
  if (!by_fit.fit.estimate.empty()) {
    infer_positions(model_, by_fit.fit.estimate, {}, inferred_);
    row.errors[static_cast<std::size_t>(Contender::estimate)] = experiment_error(truth_, inferred_.mean);
    row.field = field_error(by_fit);
    if (!folder_.empty()) write_meshes(row, by_fit);
  }
  evidence_.emplace_back(by_fit.fit.candidates.begin(), by_fit.fit.candidates.end());
  const TestState& state = tracker.update(by_fit);
  row.test_verdict = state.verdict;
  if (state.frames > 0) score(row, Contender::tracked, model_.sample_index(state.sample));
  row.simulation = state.simulation;
  row.simulation_probability = state.simulation_probabilities[state.simulation];
  row.branch_probability = state.branch_probabilities[model_.branch_of(state.simulation)];
  if (arena_.icp) {
    const auto start = std::chrono::steady_clock::now();
    const auto spread = spread_points(points, config_.T_reference_sensor, box_, IcpSettings{}.points);
    if (spread.size() >= 3) score(row, Contender::icp, arena_.icp->match(spread).sample);
    row.icp_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  row.status = by_fit.status;
  row.verdict = by_fit.verdict;
  row.fit = by_fit.fit;
  row.fit.candidates = {};
  row.fit.estimate = {};
  row.coverage = by_fit.coverage;
  row.leading_coordinates = by_lbea.leading_coordinates;
  row.vtp_ns = by_vtp.elapsed_ns;
  row.lbea_ns = by_lbea.elapsed_ns;
  row.fit_ns = by_fit.elapsed_ns;
  return row;
}

void Test::write_meshes(const FrameTrial& row, const MatchResult& result) {
  const std::string number = std::to_string(1000 + row.step).substr(1) + ".vtu";
  estimates_.push_back({row.time_s, folder_ / ("estimate_" + number)});
  write_estimate_mesh(estimates_.back().file, model_, result.fit.estimate, result.fit.candidates, row.time_s);
  matches_.push_back({row.time_s, folder_ / ("matched_" + number)});
  write_matched_mesh(matches_.back().file, model_, model_.sample_index(result.matches.front().sample));
}

FieldError Test::field_error(const MatchResult& result) {
  FieldError error;
  if (!has_field_) return error;
  infer_field(model_, 0, result.fit.estimate, plausible_samples(result.fit.candidates), inferred_);
  std::vector<float> matched(model_.field_size(0));
  model_.read_field(0, model_.sample_index(result.matches.front().sample), matched);
  const auto& truth = state_.fields[run_field_];
  double magnitude = 0, of_matched = 0, of_inferred = 0, of_hidden = 0;
  std::size_t hidden = 0, within = 0;
  for (std::size_t e = 0; e < model_.elements(); ++e) {
    const double value = double{truth[mesh_.elements()[e]]}, off = std::abs(double{inferred_.mean[e]} - value);
    magnitude += std::abs(value);
    of_matched += std::abs(double{matched[e]} - value);
    of_inferred += off;
    if (off <= 2 * double{inferred_.spread[e]}) ++within;
    const auto nodes = model_.element_nodes().subspan(4 * e, 4);
    if (std::ranges::all_of(nodes, [&](std::uint32_t node) { return observed_[node] != 0; })) continue;
    of_hidden += off;
    ++hidden;
  }
  const auto all = static_cast<double>(model_.elements());
  error = {magnitude / all, of_matched / all, of_inferred / all, not_measured, static_cast<double>(within) / all};
  if (hidden > 0) error.hidden = of_hidden / static_cast<double>(hidden);
  return error;
}

}  // namespace

TestTrial run_test(const Arena& arena, const Experiment& experiment, const TrialSettings& settings,
                   const FrameDone& done) {
  TestTrial trial = Test(arena, experiment, settings).run(done);
  trial.experiment = experiment.name;
  return trial;
}

}  // namespace lbea::tool
