// The figures of docs/evaluation.md about several components: how often a wrong simulation is named by each half of a
// component alone, and by both together. The tests are runs that are in the ensemble.
//   coupling_figures ensemble.toml sensor.json FOLDER CUT GAP [TESTS [EVERY]]
// CUT: x=200, where the plane is that divides the component, GAP: width of what belongs to neither half and is not in
// the frames, in the length unit. FOLDER keeps both models.
#include "adapters/ensemble/ensemble_toml.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "precompute/rig/counter_random.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "tests/components/cut_run.hpp"
#include "tools/eval/experiments.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/views/assembled_views.hpp"

#include <lbea/components.hpp>
#include <lbea/test_history.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace {

using namespace lbea;

constexpr std::uint32_t first_step = 2;
constexpr std::uint64_t seed = 1;

std::vector<tool::Disturbance> rounds() {
  return {{},
          {.name = "noise", .noise = 0.5f},
          {.name = "third hidden", .connected = 1.0 / 3, .same_place = true},
          {.name = "pose 5 mm", .pose_error = 5},
          {.name = "all", .noise = 0.5f, .connected = 1.0 / 3, .same_place = true, .pose_error = 5}};
}

struct Setup {
  bake::EnsembleDescription description;
  bake::Ensemble ensemble;
  io::SensorDescription rig;
  std::vector<test::Cut> cuts;
  bool are_apart = false;
  std::vector<SensorViews> views;  // of both models, each between the other one
  std::vector<Model> models;
};

Model half(const Setup& setup, const std::filesystem::path& file, const test::Cut& cut) {
  if (std::filesystem::exists(file)) return Model::open(file);
  bake::Ensemble ensemble = setup.ensemble;
  for (bake::EnsembleRun& run : ensemble.runs)
    run.open = [open = run.open, cut] { return std::make_unique<test::CutRun>(open(), std::vector{cut}); };
  bake::BakeOptions options;
  options.depth_renderer = tool::depth_rendering(setup.description.depth_sensor);
  bake::bake_model(ensemble, setup.description, file, options);
  return Model::open(file);
}

/// Names by each component alone, and by both.
struct Names {
  std::array<std::uint32_t, 2> frame{}, sample{}, test{};
  std::uint32_t sample_of_both = 0, test_of_both = 0;
};

struct Count {
  double frames = 0, tests = 0;
  std::array<double, 2> frame{}, sample{}, test{}, whole{};
  double both_sample = 0, both_test = 0, both_whole = 0, either_sample = 0;

  void add(const Names& names, std::uint32_t own, bool is_last) {
    ++frames;
    for (std::size_t c = 0; c < 2; ++c) {
      frame[c] += names.frame[c] != own;
      sample[c] += names.sample[c] != own;
      test[c] += names.test[c] != own;
      whole[c] += is_last && names.test[c] != own;
    }
    both_sample += names.sample_of_both != own;
    both_test += names.test_of_both != own;
    both_whole += is_last && names.test_of_both != own;
    tests += is_last;
  }
  void print(const std::string& name) const {
    const auto percent = [](double count, double all) { return 100 * count / all; };
    std::printf(
        "%-14s %4.0f frames | frame %5.1f %5.1f | sample %5.1f %5.1f both %5.1f | test so far %5.1f %5.1f both "
        "%5.1f | after %2.0f tests %5.1f %5.1f both %5.1f\n",
        name.c_str(), frames, percent(frame[0], frames), percent(frame[1], frames), percent(sample[0], frames),
        percent(sample[1], frames), percent(both_sample, frames), percent(test[0], frames), percent(test[1], frames),
        percent(both_test, frames), tests, percent(whole[0], tests), percent(whole[1], tests),
        percent(both_whole, tests));
    std::fflush(stdout);
  }
};

class Test {
 public:
  Test(const Setup& setup, std::size_t run, const tool::Disturbance& disturbance)
      : setup_(setup),
        disturbance_(disturbance),
        name_(setup.ensemble.runs[run].name),
        noise_(tool::disturbed(setup.rig.noise, disturbance)),
        both_({{setup.models[0], setup.views[0]}, {setup.models[1], setup.views[1]}}) {
    MatcherConfig config;
    config.method = Method::fit;
    config.max_points = setup.rig.sensor.width_px * setup.rig.sensor.height_px;
    config.T_reference_sensor = setup.rig.sensor.T_reference_sensor;
    for (std::size_t c = 0; c < (setup.are_apart ? 2 : 1); ++c) {
      const auto cuts = setup.are_apart ? std::vector{setup.cuts[c]} : setup.cuts;
      readers_.push_back(std::make_unique<test::CutRun>(setup.ensemble.runs[run].open(), cuts));
      sensors_.emplace_back(setup.rig.sensor, readers_[c]->mesh().nodes(), readers_[c]->mesh().elements);
    }
    for (std::size_t c = 0; c < setup.models.size(); ++c) {
      const Model& model = setup.models[c];
      matchers_.emplace_back(model, config);
      histories_.emplace_back(model);
      assembled_.emplace_back(model, config, setup.views[c]);
      histories_.emplace_back(model, setup.views[c]);
      alone_.emplace_back(model);
    }
  }
  void run(std::uint32_t every, std::uint32_t own, Count& count) {
    for (std::uint32_t step = first_step; step < readers_[0]->states(); step += every)
      count.add(names(step), own, step + every >= readers_[0]->states());
  }

 private:
  Names names(std::uint32_t step) {
    const auto stamp_ns = static_cast<std::int64_t>(
        std::llround((readers_[0]->time_s(step) - readers_[0]->time_s(0)) * setup_.description.time_factor * 1e9));
    std::vector<MatchResult> results;
    Names names;
    std::vector<Point> points;
    for (std::size_t c = 0; c < 2; ++c) {
      if (c < readers_.size()) points = sense(c, step);
      results.push_back(matchers_[c].match({step, stamp_ns, points}, histories_[2 * c]));
      names.frame[c] = results[c].matches.empty() ? ~0u : results[c].matches.front().sample.simulation;
      const TestState& alone = alone_[c].update(results[c]);
      names.sample[c] = alone.sample.simulation;
      names.test[c] = alone.simulation;
      if (!setup_.are_apart) results[c] = assembled_[c].match({step, stamp_ns, points}, histories_[2 * c + 1]);
    }
    both_.update(results);
    names.sample_of_both = both_.state(0).sample.simulation;
    names.test_of_both = both_.state(0).simulation;
    return names;
  }
  std::vector<Point> sense(std::size_t c, std::uint32_t step) {
    readers_[c]->read(step, state_);
    const std::uint64_t own_seed = bake::frame_seed(seed ^ std::hash<std::string>{}(name_), step);
    std::vector<Point> points = sensors_[c].sense(
        {state_.positions, bake::exposed_elements(readers_[c]->mesh(), state_.alive)}, noise_, own_seed);
    if (disturbance_.same_place && !place_ && !points.empty()) place_ = tool::any_of_them(points, own_seed);
    points = tool::disturbed(std::move(points), disturbance_, own_seed, place_);
    if (!(disturbance_.pose_error > 0)) return points;
    return tool::misplaced(std::move(points), disturbance_, 1, setup_.rig.sensor.T_reference_sensor, {},
                           seed ^ std::hash<std::string>{}(name_));
  }

  const Setup& setup_;
  const tool::Disturbance& disturbance_;
  const std::string name_;
  std::vector<std::unique_ptr<bake::SimulationReader>> readers_;  // of what a frame shows
  std::vector<bake::VirtualSensor> sensors_;
  bake::SensingNoise noise_;
  std::vector<Matcher> matchers_, assembled_;
  std::vector<TestHistory> histories_;
  std::vector<Tracker> alone_;
  ComponentTracker both_;
  std::optional<Point> place_;
  bake::SimulationState state_;
};

}  // namespace

int main(int count, char** arguments) {
  if (count < 6) return 2;
  Setup setup;
  setup.description = io::read_ensemble_toml(arguments[1]);
  setup.description.depth_sensor = arguments[2];
  setup.description.region = {};
  setup.description.fields.clear();
  setup.ensemble = tool::open_ensemble(setup.description);
  setup.rig = io::read_sensor_json(arguments[2]);
  const std::filesystem::path folder = arguments[3];
  std::filesystem::create_directories(folder);
  const std::string plane = arguments[4];
  const auto axis = static_cast<std::size_t>(plane.at(0) - 'x');
  if (axis > 2 || plane.size() < 3) return 2;
  const auto cut = static_cast<float>(std::atof(plane.c_str() + 2)), gap = static_cast<float>(std::atof(arguments[5]));
  setup.are_apart = std::string(arguments[5]) == "apart";
  setup.cuts = {{axis, -INFINITY, cut - gap / 2}, {axis, cut + gap / 2, INFINITY}};
  setup.models.push_back(half(setup, folder / "rear.lbea", setup.cuts[0]));
  setup.models.push_back(half(setup, folder / "front.lbea", setup.cuts[1]));
  for (std::size_t c = 0; c < 2; ++c)
    setup.views.push_back(setup.are_apart
                              ? SensorViews{}
                              : tool::assembled_views(setup.models[c], {setup.models[1 - c]}, setup.rig.sensor));
  const std::size_t runs = setup.ensemble.runs.size(),
                    tests = count > 6 ? std::min<std::size_t>(std::strtoul(arguments[6], nullptr, 10), runs) : runs;
  const auto every = static_cast<std::uint32_t>(count > 7 ? std::strtoul(arguments[7], nullptr, 10) : 2);
  for (const tool::Disturbance& round : rounds()) {
    Count wrong;
    for (std::size_t test = 0; test < tests; ++test) {
      const std::size_t run = test * runs / tests;
      Test(setup, run, round).run(every, static_cast<std::uint32_t>(run), wrong);
    }
    wrong.print(round.name);
  }
}
