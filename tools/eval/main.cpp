// lbea-eval: measures the error of matches against the truth of sensed experiments.
#include "adapters/rig/sensor_json.hpp"
#include "tools/eval/ensemble_command.hpp"
#include "tools/eval/live.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/printable.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"
#include "tools/shared/intake/access_options.hpp"

#include <cstdio>

#include <unistd.h>

using namespace lbea;
using namespace lbea::tool;

namespace {

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

// Checked before the test, which cannot be repeated.
void prepare_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || access(folder.c_str(), W_OK) != 0)
    throw Error(Status::write_failed, folder.string() + ": cannot write to this folder; choose another one with --out");
}

int live(const LiveArguments& arguments) {
  catch_stop_signals();
  const Model model = Model::open(arguments.model);
  std::unique_ptr<Truth> truth;
  if (!arguments.truth_table.empty())
    truth = std::make_unique<Truth>(arguments.truth_table, open_named_run(arguments.run, arguments.single_file), model);
  const RigidTransform pose =
      arguments.pose.empty() ? identity_transform : io::read_pose(arguments.pose, model.length_unit());
  if (!arguments.out.empty()) prepare_folder(arguments.out);
  const LiveOptions options{arguments.results, arguments.access.load(),
                            std::chrono::milliseconds(static_cast<std::int64_t>(arguments.silence_s * 1e3))};
  const auto ready = [] { std::fprintf(stderr, "lbea-eval: ready\n"); };
  const auto print = [&](const LiveRow& row) {
    if (!arguments.json) std::printf("%s\n", printable(table_line(row)).c_str()), std::fflush(stdout);
    if (!row.warning.empty()) std::fprintf(stderr, "lbea-eval: warning: %s\n", row.warning.c_str());
  };
  if (!arguments.json) std::printf("%s\n", table_header(model).c_str());
  const LiveSummary summary = watch(options, model, truth.get(), ready, print, [] { return stop_requested != 0; });
  std::printf("%s\n", arguments.json ? to_json(summary, model).c_str()
                                     : printable(table_summary(summary, model), "\n").c_str());
  if (!arguments.out.empty()) {
    write_csv(arguments.out / "results.csv", summary);
    write_meshes(arguments.out, summary, model, truth.get(), pose, arguments.columns);
  }
  if (summary.rows.empty())
    throw Error(
        Status::endpoint_unavailable,
        arguments.results + ": no result received; check that lbea-serve publishes there and that frames were sent");
  if (summary.complete) return refusal_of_all(summary.counters, model.length_unit()).empty() ? exit_ok : exit_failed;
  std::fprintf(stderr, "lbea-eval: the sender did not end the stream: frames may be missing from the evaluation\n");
  return exit_failed;
}

}  // namespace

int main(int argc, char** argv) {
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
  return tool.run(argc, argv,
                  [&] { return ensemble_command.is_chosen() ? evaluate_ensemble(ensemble) : live(arguments); });
}
