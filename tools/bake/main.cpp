// lbea-bake: an ensemble of simulations becomes one model file.
#include "adapters/simulation/open.hpp"
#include "precompute/bake.hpp"
#include "tools/bake/command_line.hpp"
#include "tools/bake/report.hpp"
#include "tools/bake/stage_progress.hpp"
#include "tools/bake/steps.hpp"
#include "tools/bake/subcommands.hpp"
#include "tools/shared/ensemble/ensemble_input.hpp"

namespace {

using namespace lbea;
using namespace lbea::tool;

int run(const BakeCommand& command) {
  catch_stop_signals();
  bake::EnsembleDescription description = described(command);
  read_region_nodes(description.region);
  StageProgress progress;
  bake::BakeOptions options;
  options.threads = command.threads;
  options.visible_nodes = visibility(description.region, command.threads);
  options.depth_renderer = depth_rendering(description.depth_sensor);
  options.progress = [&](const bake::BakeProgress& stage) { progress.show(stage); };
  options.cancelled = [] { return stop_requested != 0; };
  options.leaves_out_broken = command.leave_out_broken;
  const bake::BakeSummary summary =
      bake::bake_model(ensemble_of(command, description), description, description.output, options);
  progress.end();
  command.json ? print_json(summary, description.output) : print_table(summary, description.output);
  return exit_ok;
}

}  // namespace

int main(int argc, char** argv) {
  if (const auto exit_code = lbea::tool::run_subcommand(argc, argv)) return *exit_code;
  Tool tool("lbea-bake",
            "Bakes an ensemble of simulations into one model file for the runtime.\n"
            "What one machine cannot hold is baked in steps, by many: lbea-bake plan, shard, merge; status shows how\n"
            "far they are. Each has its own --help.",
            "lbea-bake ensemble.toml -o rail.lbea\n"
            "  lbea-bake --run runs/run_001 --run runs/run_002 --region-nodes nodes.txt -o rail.lbea\n"
            "  lbea-bake plan ensemble.toml --work work -o rail.lbea");
  BakeCommand command;
  declare(tool, command);
  tool.list_formats_by(io::list_simulation_formats());
  tool.add_flag("--leave-out-broken", command.leave_out_broken,
                "runs that cannot be read are left out and named, as plan does");
  tool.add_usage_check([&] {
    if (command.toml.empty() && command.runs.empty()) throw WrongUsage("name an ensemble.toml, or runs with --run");
    if (command.toml.empty() && command.output.empty()) throw WrongUsage("name the model with -o");
  });
  return tool.run(argc, argv, [&] { return run(command); });
}
