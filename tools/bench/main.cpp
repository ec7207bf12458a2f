// lbea-bench: checks the answers for a set of clouds, then measures the time per frame.
#include "adapters/rig/sensor_json.hpp"
#include "tools/bench/growth.hpp"
#include "tools/bench/report.hpp"
#include "tools/bench/round_trip.hpp"
#include "tools/bench/selection.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/transformed.hpp"

#include <cstdio>

namespace lbea::tool::bench {
namespace {

struct Options : Selection {
  std::string model_file, pose_file, csv_file, growth_folder, endpoints, columns, inferred_field;
  std::vector<std::string> cloud_paths;
  std::optional<std::uint32_t> points;
  std::optional<double> rate;
  Schedule schedule;
  bool json = false, markdown = false, adversarial = false;
};

constexpr auto description =
    "Measures the time of each stage of the matcher on clouds from files. Before that it checks the answer for every\n"
    "cloud by a computation in double precision: nearest points, coefficients, ranked samples; by fit also depth\n"
    "image and candidates. If one is wrong, it is printed, nothing is timed, and the exit code is 1. Percentiles are\n"
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

void add_clouds(Tool& tool, Options& options) {
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
}

void add_options(Tool& tool, Options& options) {
  add_clouds(tool, options);
  tool.add_choice("--method", options.matcher.method, method_names,
                  "lbea: in the eigenbasis (eq. 3); vtp: by positions (eq. 1); fit: depth images");
  tool.add_flag("--track", options.extras.tracks,
                "with --method fit: track the test and use its history, as lbea-serve");
  tool.add_option("--infer", options.inferred_field, "with --method fit: infer this field of the model");
  tool.add_option("--trigger-ns", options.matcher.trigger_ns, "time of impact in the clock of the clouds, ns");
  tool.add_option("--baseline", options.baselines,
                  "pipelines to compare with: nanoflann (a tree per frame, simple loops), portable (the product with "
                  "loops that every x86-64 processor runs), lbea (beside --method fit)")
      ->delimiter(',')
      ->check(one_of({"nanoflann", "portable", "lbea"}));
  tool.add_option("--kernels", options.kernels_name,
                  "use the inner loops of this instruction set instead of the fastest one");
  tool.add_option("--csv", options.csv_file, "write the times of every frame to this file");
  auto* json = tool.add_flag("--json", options.json, "print as JSON");
  tool.add_flag("--markdown", options.markdown, "print as Markdown")->excludes(json);
  tool.add_option(
      "--growth", options.growth_folder,
      "instead: measure times by number of points and of samples, by fit also of cells and candidates, and write the "
      "tables into this folder");
  tool.add_flag("--adversarial", options.adversarial,
                "instead: clouds made to be slow (equal points, tiny balls, spheres, denormal numbers), each compared "
                "with the first cloud")
      ->excludes("--growth");
  add_server_options(tool, options);
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

// The check has no reference for method fit with these clouds, of which something seems to hide a part: only its
// nearest points and coefficients are compared, those of method lbea.
int compare_hostile(Options options, const Model& model, const BenchCloud& first) {
  std::vector<BenchCloud> clouds = with_hostile(first, options.matcher.T_reference_sensor);
  options.matcher.T_reference_sensor = identity_transform;
  options.matcher.max_points = most_points(clouds);
  Matcher matcher(model, options.matcher);  // clouds outside the envelope take no time
  std::erase_if(clouds, [&](const BenchCloud& cloud) { return matcher.match(cloud.frame()).points.used == 0; });
  Selection checked = options;
  if (checked.matcher.method == Method::fit) checked.matcher.method = Method::lbea;
  if (!check_answers(make_pipelines(checked, model), model, checked.matcher, clouds)) return exit_failed;
  const auto pipelines = make_pipelines(options, model);
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

Report measured(const Options& options, const Model& model, Pipelines pipelines, std::vector<BenchCloud> clouds,
                std::size_t hidden) {
  Report report{conditions(), std::move(clouds), {}};
  report.facts.emplace_back("model", "n = " + std::to_string(model.vertices()) +
                                         " vertices, p = " + std::to_string(model.modes()) +
                                         " modes, s = " + std::to_string(model.samples()) + " samples");
  report.facts.emplace_back("clouds", points_of(report.clouds));
  report.facts.emplace_back(
      "checked",
      "the answers agree with double precision on all " + std::to_string(report.clouds.size()) + " clouds" +
          (hidden > 0 ? " (candidates: without " + std::to_string(hidden) + " of which a part is hidden)" : ""));
  Progress progress("timing", std::uint64_t{options.schedule.warm_up} + options.schedule.frames);
  report.measurements =
      measure(pipelines, report.clouds, options.schedule, [&](std::uint64_t done) { progress.advance_to(done); });
  return report;
}

int bench(Options options) {
  const Model model = Model::open(options.model_file);
  if (!options.pose_file.empty())
    options.matcher.T_reference_sensor = io::read_pose(options.pose_file, model.length_unit());
  if (!options.inferred_field.empty()) options.extras.inferred = field_named(model, options.inferred_field);
  check(options, model);
  std::vector<BenchCloud> clouds =
      load_clouds(options.cloud_paths, options.adversarial ? std::nullopt : options.points, options.columns);
  if (options.adversarial && options.points)
    clouds.front().points = resized(clouds.front().points, *options.points, point_jitter(model.length_unit()));
  options.matcher.max_points = most_points(clouds);
  require_matches(model, options.matcher, clouds);
  if (options.adversarial) return compare_hostile(options, model, clouds.front());
  if (!options.growth_folder.empty()) {
    for (const auto& file : measure_growth(options.growth_folder, model, options, clouds))
      std::printf("%s\n", file.c_str());
    return exit_ok;
  }
  if (!options.endpoints.empty())
    return options.rate ? send_at_rate(options, clouds) : send_one_by_one(options, clouds);
  const auto pipelines = make_pipelines(options, model);
  const auto hidden = check_answers(pipelines, model, options.matcher, clouds);
  if (!hidden) return exit_failed;
  const Report report = measured(options, model, pipelines, std::move(clouds), *hidden);
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
