// lbea-bench: checks the answers for a set of clouds, then measures the time per frame.
#include "adapters/rig/sensor_json.hpp"
#include "tools/bench/growth.hpp"
#include "tools/bench/report.hpp"
#include "tools/bench/round_trip.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/transformed.hpp"

#include <cstdio>

namespace lbea::tool::bench {
namespace {

struct Options {
  std::string model_file, pose_file, csv_file, growth_folder, kernels_name, endpoints, columns;
  std::vector<std::string> cloud_paths, baselines;
  std::optional<std::uint32_t> points;
  std::optional<double> rate;
  MatcherConfig matcher;
  Schedule schedule;
  bool json = false, markdown = false, adversarial = false;
};

constexpr auto description =
    "Measures the time of each stage of the matcher on clouds from files. Before that it checks the answer for every\n"
    "cloud by a computation in double precision: nearest points, coefficients, ranked samples. If one is wrong, its\n"
    "cloud and vertex are printed, nothing is timed, and the exit code is 1. Percentiles are\n"
    "nearest-rank. \"total\" is wall time; \"processor\" is processor time of the thread.";

const std::map<std::string, Method> method_names{{"lbea", Method::lbea}, {"vtp", Method::vtp}, {"fit", Method::fit}};

/// The other options are declared before.
void add_server_options(Tool& tool, Options& options) {
  auto* through = tool.add_option("--through", options.endpoints,
                                  "instead: FRAMES,RESULTS, the endpoints of a running lbea-serve; measure the time "
                                  "from sending a frame to its result, one frame at a time");
  for (const char* other : {"--csv", "--kernels", "--method", "--baseline", "--markdown", "--growth", "--adversarial"})
    through->excludes(tool.get_option(other));
  tool.add_option("--rate", options.rate,
                  "with --through: send this number of frames per second without waiting for results; measure the time "
                  "from the due time of a frame, and count lost frames")
      ->needs(through)
      ->check(in_range(0.001, 1e6));
}

void add_options(Tool& tool, Options& options) {
  tool.add_option("model", options.model_file, "baked model (.lbea)")->required();
  tool.add_option("clouds", options.cloud_paths, "point clouds, or folders of them")->required();
  tool.add_option("--pose", options.pose_file,
                  "sensor.json with T_reference_sensor (default: clouds are in reference coordinates)")
      ->check(existing_file());
  add_columns_option(tool, options.columns);
  tool.add_option(
          "--points", options.points,
          "thin every cloud to this number of points; smaller clouds are refused, or, with --adversarial, repeated")
      ->check(in_range(1u, 16'777'216u));
  tool.add_option("--frames", options.schedule.frames, "number of frames to time; the clouds are used in turn")
      ->check(in_range(1u, 10'000'000u));
  tool.add_option("--warm-up", options.schedule.warm_up, "number of frames before those, not timed")
      ->check(in_range(0u, 10'000'000u));
  tool.add_choice("--method", options.matcher.method, method_names,
                  "lbea: in the eigenbasis (eq. 3); vtp: by positions (eq. 1); fit, with --adversarial: depth images");
  tool.add_option("--trigger-ns", options.matcher.trigger_ns, "time of impact in the clock of the clouds, ns");
  tool.add_option("--baseline", options.baselines,
                  "pipelines to compare with: nanoflann (a tree per frame, simple loops), portable (the product with "
                  "loops that every x86-64 processor runs)")
      ->delimiter(',')
      ->check(one_of({"nanoflann", "portable"}));
  tool.add_option("--kernels", options.kernels_name,
                  "use the inner loops of this instruction set instead of the fastest one");
  tool.add_option("--csv", options.csv_file, "write the times of every frame to this file");
  auto* json = tool.add_flag("--json", options.json, "print as JSON");
  tool.add_flag("--markdown", options.markdown, "print as Markdown")->excludes(json);
  tool.add_option(
      "--growth", options.growth_folder,
      "instead: measure times by number of points and by number of samples, and write the tables into this folder");
  tool.add_flag("--adversarial", options.adversarial,
                "instead: clouds made to be slow (equal points, tiny balls, spheres, denormal numbers), each compared "
                "with the first cloud")
      ->excludes("--growth");
  add_server_options(tool, options);
}

std::unique_ptr<Pipeline> make_product(const std::string& kernels_name, const Model& model,
                                       const MatcherConfig& config) {
  if (kernels_name.empty()) return matcher_pipeline(model, config);
  return kernels_pipeline(model, config, kernels_named(kernels_name), "lbea, " + kernels_name);
}

std::unique_ptr<Pipeline> make_baseline(const std::string& name, const Model& model, const MatcherConfig& config) {
  if (name == "nanoflann") return nanoflann_pipeline(model, config);
  return kernels_pipeline(model, config, kernels_named("baseline"), name);
}

std::vector<std::unique_ptr<Pipeline>> make_pipelines(const Options& options, const Model& model,
                                                      const MatcherConfig& config) {
  std::vector<std::unique_ptr<Pipeline>> pipelines;
  pipelines.push_back(make_product(options.kernels_name, model, config));
  for (const std::string& name : options.baselines) pipelines.push_back(make_baseline(name, model, config));
  return pipelines;
}

/// Whether all answers are right. Prints the first wrong one.
bool answers_agree(Pipelines pipelines, const MatchTask& task, std::span<const BenchCloud> clouds) {
  Progress progress("checking", clouds.size());
  for (std::size_t i = 0; i < clouds.size(); ++i) {
    AnswerCheck check(task, clouds[i].points);
    for (const auto& pipeline : pipelines) {
      const auto wrong = check.disagreement(pipeline->answer(clouds[i].frame(i)));
      if (!wrong) continue;
      std::fprintf(stderr, "lbea-bench: %s: %s: %s\n", clouds[i].name.c_str(), pipeline->name().c_str(),
                   wrong->c_str());
      return false;
    }
    progress.advance_to(i + 1);
  }
  return true;
}

// Matching a cloud without points in the envelope would be fast and meaningless.
void require_matches(const Model& model, const MatcherConfig& config, std::span<const BenchCloud> clouds) {
  Matcher matcher(model, config);
  for (const BenchCloud& cloud : clouds)
    if (matcher.match(cloud.frame()).status == Status::empty_frame)
      throw Error(Status::bad_input,
                  cloud.name + ": no point is inside the ensemble's envelope; give the pose of its sensor with --pose");
}

std::string points_of(std::span<const BenchCloud> clouds) {
  const auto [least, most] =
      std::ranges::minmax(clouds, {}, [](const BenchCloud& cloud) { return cloud.points.size(); });
  return std::to_string(clouds.size()) + ", of " + std::to_string(least.points.size()) + " to " +
         std::to_string(most.points.size()) + " points";
}

// In reference coordinates, because a transformation would round denormal numbers and equal distances away.
std::vector<BenchCloud> with_hostile(const BenchCloud& first, const RigidTransform& T) {
  std::vector<Point> points;
  for (const Point& p : first.points) points.push_back(transformed(T, p));
  std::vector<BenchCloud> clouds = hostile_clouds(points);
  clouds.insert(clouds.begin(), {first.name, first.stamp_ns, std::move(points)});
  return clouds;
}

// Method fit starts from the nearest points of method lbea; the check has no reference for its depth images.
int compare_hostile(Options options, const Model& model, const BenchCloud& first) {
  std::vector<BenchCloud> clouds = with_hostile(first, options.matcher.T_reference_sensor);
  options.matcher.T_reference_sensor = identity_transform;
  options.matcher.max_points = most_points(clouds);
  Matcher matcher(model, options.matcher);  // clouds outside the envelope take no time
  std::erase_if(clouds, [&](const BenchCloud& cloud) { return matcher.match(cloud.frame()).points.used == 0; });
  MatcherConfig checked = options.matcher;
  if (checked.method == Method::fit) checked.method = Method::lbea;
  const MatchTask task{model.view(), checked.method, identity_transform, checked.max_matches};
  if (!answers_agree(make_pipelines(options, model, checked), task, clouds)) return exit_failed;
  const auto pipelines = make_pipelines(options, model, options.matcher);
  for (const BenchCloud& cloud : clouds) {
    const auto [us, ratio] = compare(pipelines, cloud, clouds.front(), std::min(options.schedule.frames, 90u));
    std::printf("%-44s %8.3f ms %6.2f x\n", cloud.name.c_str(), us * 1e-3, ratio);
  }
  return exit_ok;
}

int send_at_rate(const Options& options, std::span<const BenchCloud> clouds) {
  Progress progress("sending", std::uint64_t{options.schedule.warm_up} + options.schedule.frames);
  const OpenLoop run = open_loop(parse_endpoints(options.endpoints), clouds, options.schedule, *options.rate,
                                 [&](std::uint64_t done) { progress.advance_to(done); });
  std::printf("%s\n", (options.json ? to_json(run) : to_text(run)).c_str());
  return run.lost + run.refused == 0 ? exit_ok : exit_failed;
}

int send_one_by_one(const Options& options, std::span<const BenchCloud> clouds) {
  Progress progress("sending", std::uint64_t{options.schedule.warm_up} + options.schedule.frames);
  const auto times = round_trips(parse_endpoints(options.endpoints), clouds, options.schedule,
                                 [&](std::uint64_t done) { progress.advance_to(done); });
  const Statistics s = statistics_of(times);
  if (options.json)
    std::printf(
        "{\"frames\": %zu, \"p50_us\": %.1f, \"p90_us\": %.1f, \"p99_us\": %.1f, \"p99.9_us\": %.1f, \"max_us\": "
        "%.1f}\n",
        s.count, s.p50, s.p90, s.p99, s.p99_9, s.max);
  else
    std::printf("camera to result: %zu frames, us: p50 %.1f, p90 %.1f, p99 %.1f, p99.9 %.1f, max %.1f\n", s.count,
                s.p50, s.p90, s.p99, s.p99_9, s.max);
  return exit_ok;
}

Report measured(const Options& options, const Model& model, Pipelines pipelines, std::vector<BenchCloud> clouds) {
  Report report{conditions(), std::move(clouds), {}};
  report.facts.emplace_back("model", "n = " + std::to_string(model.vertices()) +
                                         " vertices, p = " + std::to_string(model.modes()) +
                                         " modes, s = " + std::to_string(model.samples()) + " samples");
  report.facts.emplace_back("clouds", points_of(report.clouds));
  report.facts.emplace_back(
      "checked", "the answers agree with double precision on all " + std::to_string(report.clouds.size()) + " clouds");
  Progress progress("timing", std::uint64_t{options.schedule.warm_up} + options.schedule.frames);
  report.measurements =
      measure(pipelines, report.clouds, options.schedule, [&](std::uint64_t done) { progress.advance_to(done); });
  return report;
}

int bench(Options options) {
  const Model model = Model::open(options.model_file);
  if (!options.pose_file.empty())
    options.matcher.T_reference_sensor = io::read_pose(options.pose_file, model.length_unit());
  if (options.matcher.method == Method::fit &&
      (!options.adversarial || !options.kernels_name.empty() || !options.baselines.empty()))
    throw Error(Status::bad_config,
                "--method fit is measured with --adversarial only, and without --kernels and --baseline");
  std::vector<BenchCloud> clouds =
      load_clouds(options.cloud_paths, options.adversarial ? std::nullopt : options.points, options.columns);
  if (options.adversarial && options.points)
    clouds.front().points = resized(clouds.front().points, *options.points, point_jitter(model.length_unit()));
  options.matcher.max_points = most_points(clouds);
  require_matches(model, options.matcher, clouds);
  if (options.adversarial) return compare_hostile(options, model, clouds.front());
  if (!options.growth_folder.empty()) {
    const auto make = [&](const MatcherConfig& config) { return make_pipelines(options, model, config); };
    measure_growth(options.growth_folder, model, options.matcher, make, clouds);
    return exit_ok;
  }
  if (!options.endpoints.empty())
    return options.rate ? send_at_rate(options, clouds) : send_one_by_one(options, clouds);
  const auto pipelines = make_pipelines(options, model, options.matcher);
  const MatchTask task{model.view(), options.matcher.method, options.matcher.T_reference_sensor,
                       options.matcher.max_matches};
  if (!answers_agree(pipelines, task, clouds)) return exit_failed;
  const Report report = measured(options, model, pipelines, std::move(clouds));
  if (!options.csv_file.empty()) write_csv(options.csv_file, report);
  const TableStyle style = options.markdown ? TableStyle::markdown : TableStyle::plain;
  std::printf("%s\n", (options.json ? to_json(report) : to_text(report, style)).c_str());
  return exit_ok;
}

}  // namespace
}  // namespace lbea::tool::bench

int main(int argc, char** argv) {
  lbea::tool::bench::Options options;
  lbea::tool::Tool tool("lbea-bench", lbea::tool::bench::description,
                        "lbea-bench rail.lbea frames/ --pose sensor.json --baseline nanoflann,portable");
  lbea::tool::bench::add_options(tool, options);
  return tool.run(argc, argv, [&] { return lbea::tool::bench::bench(options); });
}
