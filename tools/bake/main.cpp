// lbea-bake: bakes an ensemble of simulations into one model file, in one process or in steps by several.
#include "adapters/simulation/open.hpp"
#include "tools/bake/command_line.hpp"
#include "tools/bake/steps.hpp"

#include <map>
#include <string_view>

namespace {

using namespace lbea;
using namespace lbea::tool;

/// Options of the subcommands plan, survey, shard, merge and status.
struct StepCommand {
  BakeCommand bake;
  std::filesystem::path work, output;
  bake::Shard shard;
  unsigned threads = 0;
  bool json = false, verifies_finished = false;
};

/// Every run of the shard is finished except those that cannot be baked: a retry does not help.
constexpr int exit_runs_failed = 3;
constexpr const char* threads_help = "0: all processors; the model does not depend on it";

void declare_work(Tool& tool, StepCommand& command) {
  tool.add_option("--work", command.work, "the work folder, on a file system that all processes share")->required();
}

void declare_shard(Tool& tool, StepCommand& command) {
  tool.add_option("--index", command.shard.index, "index of this shard of the runs, from 0")->required();
  tool.add_option("--of", command.shard.of, "number of shards")->required();
}

int plan(int argc, char** argv) {
  Tool tool("lbea-bake plan",
            "First step of a bake in shards: surveys the runs, chooses reference and region, solves for the basis.",
            "lbea-bake plan ensemble.toml --work work -o rail.lbea");
  StepCommand command;
  declare(tool, command.bake);
  declare_work(tool, command);
  return tool.run(argc, argv, [&] {
    const bake::WorkFolder work(command.work);
    const bake::BakePlan planned = plan_step(command.bake, work);
    const bake::BakeEstimate size =
        bake::estimate(work, planned, step_options(command.bake.threads, planned.description));
    command.bake.json ? print_json(planned, size) : print_table(planned, size);
    return exit_ok;
  });
}

int survey(int argc, char** argv) {
  Tool tool(
      "lbea-bake survey",
      "Optional step before the plan, for ensembles that take one machine long to read: surveys a shard of the runs.",
      "lbea-bake survey ensemble.toml --work work --index 3 --of 100");
  StepCommand command;
  declare(tool, command.bake);
  declare_work(tool, command);
  declare_shard(tool, command);
  return tool.run(argc, argv, [&] {
    survey_step(command.bake, bake::WorkFolder(command.work), command.shard);
    return exit_ok;
  });
}

int shard(int argc, char** argv) {
  Tool tool("lbea-bake shard",
            "Second step: bakes a shard of the planned runs. Finished runs are skipped.\n"
            "Exit code 3: all runs are finished except those that cannot be baked (lbea-bake status names them, merge "
            "leaves them out).",
            "lbea-bake shard --work work --index 3 --of 100");
  StepCommand command;
  declare_work(tool, command);
  declare_shard(tool, command);
  tool.add_flag("--verify", command.verifies_finished, "read finished runs, and bake damaged ones again");
  tool.add_option("--threads", command.threads, threads_help);
  return tool.run(argc, argv, [&] {
    const bake::WorkFolder work(command.work);
    const bake::ShardSummary summary =
        shard_step(work, read_plan(work), command.shard, command.threads, command.verifies_finished);
    print_table(summary);
    return summary.failed == 0 ? static_cast<int>(exit_ok) : exit_runs_failed;
  });
}

int merge(int argc, char** argv) {
  Tool tool("lbea-bake merge",
            "Last step: merges the baked runs into one model. Runs that failed are left out and named.",
            "lbea-bake merge --work work -o rail.lbea");
  StepCommand command;
  declare_work(tool, command);
  tool.add_option("-o,--output", command.output, "the model (default: the plan's)")->default_text("");
  tool.add_option("--threads", command.threads, threads_help);
  tool.add_flag("--json", command.json, "print the summary as JSON");
  return tool.run(argc, argv, [&] {
    const bake::WorkFolder work(command.work);
    const bake::BakeSummary summary = merge_step(work, read_plan(work), command.output, command.threads);
    command.json ? print_json(summary, command.output) : print_table(summary, command.output);
    return exit_ok;
  });
}

int status(int argc, char** argv) {
  Tool tool("lbea-bake status",
            "Prints the progress of a bake in shards and the runs that failed. Reads the work folder only.",
            "lbea-bake status --work work");
  StepCommand command;
  declare_work(tool, command);
  tool.add_flag("--json", command.json, "print as JSON");
  return tool.run(argc, argv, [&] {
    const bake::WorkFolder work(command.work);
    const bake::BakePlan planned = read_plan(work);
    const std::vector<bake::RunStatus> runs = bake::run_status(work, planned);
    command.json ? print_json(planned, runs) : print_table(planned, runs);
    return exit_ok;
  });
}

const std::map<std::string_view, int (*)(int argc, char** argv)> subcommands{
    {"plan", plan}, {"survey", survey}, {"shard", shard}, {"merge", merge}, {"status", status}};

int run(const BakeCommand& command) {
  std::filesystem::path output;
  const bake::BakeSummary summary = bake_step(command, output);
  command.json ? print_json(summary, output) : print_table(summary, output);
  return exit_ok;
}

}  // namespace

int main(int argc, char** argv) {
  catch_stop_signals();
  if (const auto subcommand = subcommands.find(argc > 1 ? argv[1] : ""); subcommand != subcommands.end())
    return subcommand->second(argc - 1, argv + 1);
  Tool tool("lbea-bake",
            "Bakes an ensemble of simulations into one model file for the runtime.\n"
            "Several processes can bake an ensemble that is too large for one machine: lbea-bake plan, shard, merge;\n"
            "status shows their progress. Each has its own --help.",
            "lbea-bake ensemble.toml -o rail.lbea\n"
            "  lbea-bake --run runs/run_001 --run runs/run_002 --region-nodes nodes.txt -o rail.lbea\n"
            "  lbea-bake plan ensemble.toml --work work -o rail.lbea");
  BakeCommand command;
  declare(tool, command);
  tool.list_formats_by(io::list_simulation_formats());
  tool.add_flag("--leave-out-broken", command.leave_out_broken,
                "leave out and name runs that cannot be read, as plan does");
  return tool.run(argc, argv, [&] { return run(command); });
}
