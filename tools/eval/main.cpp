// lbea-eval: measures the error of matches against the truth of sensed experiments.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/eval/ensemble_command.hpp"
#include "tools/eval/live.hpp"
#include "tools/eval/mesh_series.hpp"
#include "tools/eval/truth.hpp"
#include "tools/shared/answer/component_results.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/matching/transformed.hpp"
#include "tools/shared/text/formatted.hpp"
#include "tools/shared/text/printable.hpp"

#include <lbea/inference.hpp>
#include <lbea/tracker.hpp>

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdio>
#include <set>

#include <unistd.h>

namespace lbea::tool {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds poll_interval{50};

struct LiveArguments {
  std::filesystem::path model, truth_table, run, pose, out;
  std::string results, columns;
  ClientAccessOptions access;
  double silence_s = 10;
  bool single_file = false, json = false;
};

void add_live(CommandLine& app, LiveArguments& arguments) {
  app.add_option("model", arguments.model, "The model that the matcher uses (.lbea)")->required();
  app.add_option("--results", arguments.results, "Endpoint where the matcher publishes, e.g. ipc:///tmp/results")
      ->required();
  arguments.access.add_to(app);
  auto* truth = app.add_option("--truth", arguments.truth_table, "truth.csv of the sensed frames");
  app.add_option("--run", arguments.run, "The run that the frames were sensed from")->needs(truth);
  truth->needs("--run");
  app.add_flag("--single-file", arguments.single_file, single_file_help)->needs("--run");
  add_columns_option(app, arguments.columns);
  app.add_option("--pose", arguments.pose, "sensor.json of the frames, for clouds in reference coordinates");
  app.add_option("-o,--out", arguments.out, "Folder for results.csv and the meshes for ParaView");
  app.add_option("--silence", arguments.silence_s, "Stop after this number of seconds without a message")
      ->check(positive_number());
  app.add_flag("--json", arguments.json, "Print the results as JSON instead of a table");
}

/// Checked before the test, which cannot be repeated.
void prepare_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || access(folder.c_str(), W_OK) != 0)
    throw Error(Status::write_failed, folder.string() + ": cannot write to this folder; choose another one with --out");
}

void write_cloud(const std::filesystem::path& file, const std::filesystem::path& cloud, const RigidTransform& T,
                 const std::string& columns) {
  io::PointCloud points = io::read_point_cloud(cloud, columns);
  for (Point& p : points.points) p = transformed(T, p);
  const std::vector<std::string> comments{"reference coordinates"};
  io::write_ply(file, points.points, comments);
}

bool lacks_rigid_motion(const Model& model) {
  const auto provenance = nlohmann::json::parse(model.provenance(), nullptr, false);
  return provenance.is_object() && provenance.contains("/configuration/rigid"_json_pointer);
}

/// Receives the results of a running test and compares them with the truth.
class LiveTest {
 public:
  explicit LiveTest(const LiveArguments& arguments) : arguments_(arguments), model_(Model::open(arguments.model)) {
    if (!arguments.truth_table.empty()) open_truth();
    if (!arguments.pose.empty()) pose_ = io::read_pose(arguments.pose, model_.length_unit());
    if (!arguments.out.empty()) prepare_folder(arguments.out);
  }

  int run() {
    receive();
    find_path(summary_, model_);
    compare_path();
    std::printf("%s\n", arguments_.json ? to_json(summary_, model_).c_str()
                                        : printable(table_summary(summary_, model_), "\n").c_str());
    if (!arguments_.out.empty()) {
      write_csv(arguments_.out / "results.csv", summary_);
      write_meshes();
    }
    if (summary_.rows.empty() && !others_.empty())
      throw Error(Status::bad_input, arguments_.results + ": no component has this model; give the model of " +
                                         *others_.begin() + " or of another component of the matcher");
    if (summary_.rows.empty())
      throw Error(
          Status::endpoint_unavailable,
          arguments_.results + ": no result received; check that lbea-serve publishes there and that frames were sent");
    if (summary_.complete)
      return refusal_of_all(summary_.counters, model_.length_unit()).empty() ? exit_ok : exit_failed;
    std::fprintf(stderr, "lbea-eval: the sender did not end the stream: frames may be missing from the evaluation\n");
    return exit_failed;
  }

 private:
  void open_truth() {
    if (lacks_rigid_motion(model_))
      throw Error(Status::bad_config, arguments_.model.string() +
                                          " was baked with `rigid`, but the run's states include its rigid motion; "
                                          "evaluate with lbea-eval ensemble");
    truth_.emplace(arguments_.truth_table, open_named_run(arguments_.run, arguments_.single_file), model_);
  }
  /// Until the end of the evaluated sender's stream, a timeout, or a stop signal.
  void receive() {
    const wire::ClientAccess access = arguments_.access.load();
    const auto silence = std::chrono::milliseconds(static_cast<std::int64_t>(arguments_.silence_s * 1e3));
    if (!arguments_.json) std::printf("%s\n", table_header(model_).c_str());
    wire::WireContext context;
    wire::ResultSource source(context, arguments_.results, wire::results_held, access);
    bool is_ready = false;
    auto last = Clock::now();
    while (!summary_.complete && stop_requested == 0) {
      const auto message = source.receive(poll_interval);
      if (!message && Clock::now() - last > silence) break;
      if (!message) continue;
      last = Clock::now();
      // From the first message on, no result can be missed.
      if (!std::exchange(is_ready, true)) std::fprintf(stderr, "lbea-eval: ready\n");
      if (wire::message_kind(*message) == wire::MessageKind::result) add(*message);
    }
  }

  void add(wire::Message message) {
    wire::WireResult result;
    if (const wire::WireStatus status = wire::decode_result(message, result); status != wire::WireStatus::ok)
      throw Error(Status::bad_input,
                  arguments_.results + ": a result cannot be read: " + std::string(wire::explain(status)));
    if (!concerns(result, model_.checksum())) return void(others_.insert(result.component));
    if (result.model_checksum != model_.checksum() && result.model_checksum != 0)
      throw Error(Status::bad_input,
                  arguments_.results + ": these results are from another model; give the model that the matcher uses");
    if (result.status == wire::WireStatus::end_of_stream) {
      summary_.complete = summary_.sessions.has_latest(result);
      return void(summary_.answer.add(result));
    }
    summary_.sessions.add(result);
    const bool was_silent = summary_.answer.warning().empty();
    summary_.answer.add(result);
    ++summary_.counters.by_status[static_cast<std::size_t>(result.status)];
    LiveRow& row = summary_.rows.emplace_back(row_of(std::move(result)));
    if (was_silent) row.warning = summary_.answer.warning();
    if (!arguments_.json) std::printf("%s\n", printable(table_line(row)).c_str()), std::fflush(stdout);
    if (!row.warning.empty()) std::fprintf(stderr, "lbea-eval: warning: %s\n", row.warning.c_str());
  }

  LiveRow row_of(wire::WireResult result) {
    LiveRow row;
    const StageTimes& stages = result.elapsed_ns.match;
    row.match_ms = 1e-6 * static_cast<double>(std::uint64_t{stages.index} + stages.correspondence + stages.projection +
                                              stages.matching + stages.fit + stages.coverage);
    row.total_ms = 1e-6 * static_cast<double>(result.elapsed_ns.total);
    const Truth::Row* real = truth_at(result.stamp_ns);
    if (real != nullptr && !result.matches.empty()) {
      const std::uint32_t sample = model_.sample_index(result.matches.front().sample);
      if (sample == model_.samples())
        throw Error(Status::bad_input,
                    "frame " + std::to_string(result.frame_id) +
                        ": the result has a sample that this model does not have; give the model that the matcher "
                        "uses");
      const auto& positions = truth_->positions(*real);
      row.error = experiment_error(positions, model_.node_positions(sample));
      row.oracle_error = oracle(model_, positions).error;
      if (!result.fit.estimate.empty()) {
        Inferred estimate;
        infer_positions(model_, result.fit.estimate, {}, estimate);
        row.estimate_error = experiment_error(positions, estimate.mean);
      }
    }
    row.result = std::move(result);
    return row;
  }

  void compare_path() {
    for (LiveRow& row : summary_.rows)
      if (const Truth::Row* real = row.on_path ? truth_at(row.result.stamp_ns) : nullptr)
        row.path_error =
            experiment_error(truth_->positions(*real), model_.node_positions(model_.sample_index(*row.on_path)));
  }

  /// The matched samples, for fit also the estimates, and with a truth the clouds in reference coordinates.
  void write_meshes() const {
    MeshSeries series(model_, arguments_.out);
    for (const LiveRow& row : summary_.rows) {
      if (row.result.matches.empty()) continue;
      const std::uint32_t sample = model_.sample_index(row.result.matches.front().sample);
      if (sample == model_.samples()) continue;
      const std::string number = formatted("%05llu", static_cast<unsigned long long>(row.result.frame_id));
      const Truth::Row* real = truth_at(row.result.stamp_ns);
      const double time_s = real == nullptr ? summary_.seconds_since_first(row) : real->time_s;
      series.add_match(number, sample, time_s);
      if (const wire::WireFit& fit = row.result.fit; !fit.estimate.empty())
        series.add_estimate(number, fit.view(), time_s);
      if (real != nullptr)
        write_cloud(arguments_.out / ("frame_" + number + ".ply"), real->cloud, pose_, arguments_.columns);
    }
    series.finish();
  }

  /// Null without a truth, or without this stamp in it.
  [[nodiscard]] const Truth::Row* truth_at(std::int64_t stamp_ns) const {
    return truth_ ? truth_->at(stamp_ns) : nullptr;
  }

  const LiveArguments& arguments_;
  const Model model_;
  std::optional<Truth> truth_;
  RigidTransform pose_ = identity_transform;
  LiveSummary summary_;
  std::set<std::string> others_;  // components with other models
};

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  using namespace lbea::tool;
  Tool tool("lbea-eval", "Measures the error of matches against the truth of sensed experiments.",
            "lbea-eval live rail.lbea --results ipc:///tmp/results --truth frames/truth.csv --run runs/run_043 --out "
            "evaluation\n"
            "  lbea-eval ensemble ensemble.toml --sensor sensor.json --split 0.2 --robustness --out evaluation");
  LiveArguments arguments;
  tool.require_subcommand();
  CommandLine& live_command =
      tool.add_subcommand("live", "Receive the results of a running test and print a row per frame");
  add_live(live_command, arguments);
  EnsembleArguments ensemble;
  CommandLine& ensemble_command = tool.add_subcommand(
      "ensemble", "Sense runs of an ensemble, match them with the others, and print the error of every method");
  declare(ensemble_command, ensemble);
  return tool.run(argc, argv, [&] {
    if (ensemble_command.is_chosen()) return evaluate_ensemble(ensemble);
    catch_stop_signals();
    return LiveTest(arguments).run();
  });
}
