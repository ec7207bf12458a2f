#include "tools/bake/subcommands.hpp"

#include "tools/bake/report.hpp"
#include "tools/bake/steps.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <string_view>

namespace lbea::tool {
namespace {

struct StepCommand {
  BakeCommand bake;
  std::filesystem::path work, output;
  bake::Shard shard;
  unsigned threads = 0;
  bool json = false, verifies_finished = false;
};

/// Everything else of the shard is done: to try again will not help, to look at the runs will.
constexpr int exit_runs_failed = 3;

void declare_work(Tool& tool, StepCommand& command) {
  tool.add_option("--work", command.work, "the work folder, on a file system that all processes share")->required();
}

void declare_shard(Tool& tool, StepCommand& command) {
  tool.add_option("--index", command.shard.index, "which share of the runs, from 0")->required();
  tool.add_option("--of", command.shard.of, "how many shares there are")->required();
}

void declare_ensemble(Tool& tool, StepCommand& command) {
  declare(tool, command.bake);
  tool.add_usage_check([&] {
    if (command.bake.toml.empty() && command.bake.runs.empty())
      throw WrongUsage("name an ensemble.toml, or runs with --run");
    if (command.bake.toml.empty() && command.bake.output.empty()) throw WrongUsage("name the model with -o");
  });
}

int plan(int argc, char** argv) {
  Tool tool("lbea-bake plan",
            "First step of a bake in shards: surveys the runs, chooses reference and region, solves for the basis.",
            "lbea-bake plan ensemble.toml --work work -o rail.lbea");
  StepCommand command;
  declare_ensemble(tool, command);
  declare_work(tool, command);
  return tool.run(argc, argv, [&] {
    const bake::WorkFolder work(command.work);
    const bake::BakePlan planned = plan_step(command.bake, work);
    const bake::BakeEstimate size =
        bake::estimate(work, planned, step_options(command.bake.threads, planned.description.depth_sensor));
    command.bake.json ? print_json(planned, size) : print_table(planned, size);
    return exit_ok;
  });
}

int survey(int argc, char** argv) {
  Tool tool("lbea-bake survey",
            "Before the plan, for ensembles that one machine would take long to read: surveys a share of the runs.",
            "lbea-bake survey ensemble.toml --work work --index 3 --of 100");
  StepCommand command;
  declare_ensemble(tool, command);
  declare_work(tool, command);
  declare_shard(tool, command);
  return tool.run(argc, argv, [&] {
    survey_step(command.bake, bake::WorkFolder(command.work), command.shard);
    return exit_ok;
  });
}

int shard(int argc, char** argv) {
  Tool tool(
      "lbea-bake shard",
      "Second step: bakes a share of the planned runs. What is finished is skipped.\n"
      "Exit code 3: all is done but runs that cannot be baked (lbea-bake status names them, merge leaves them out).",
      "lbea-bake shard --work work --index 3 --of 100");
  StepCommand command;
  declare_work(tool, command);
  declare_shard(tool, command);
  tool.add_flag("--verify", command.verifies_finished, "read what is finished, and make again what is damaged");
  tool.add_option("--threads", command.threads, "0: all processors; the model does not depend on it");
  return tool.run(argc, argv, [&] {
    const bake::WorkFolder work(command.work);
    const bake::ShardSummary summary =
        shard_step(work, read_plan(work), command.shard, command.threads, command.verifies_finished);
    print_table(summary);
    return summary.failed == 0 ? static_cast<int>(exit_ok) : exit_runs_failed;
  });
}

int merge(int argc, char** argv) {
  Tool tool("lbea-bake merge", "Last step: the baked runs become one model. Runs that failed are left out and named.",
            "lbea-bake merge --work work -o rail.lbea");
  StepCommand command;
  declare_work(tool, command);
  tool.add_option("-o,--output", command.output, "the model (default: the plan's)")->default_text("");
  tool.add_option("--threads", command.threads, "0: all processors; the model does not depend on it");
  tool.add_flag("--json", command.json, "print the summary as JSON");
  return tool.run(argc, argv, [&] {
    const bake::WorkFolder work(command.work);
    const bake::BakeSummary summary = merge_step(work, read_plan(work), command.output, command.threads);
    command.json ? print_json(summary, command.output) : print_table(summary, command.output);
    return exit_ok;
  });
}

int status(int argc, char** argv) {
  Tool tool("lbea-bake status", "How far a bake in shards is, and which runs failed, from the work folder alone.",
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

struct Subcommand {
  std::string_view name;
  int (*run)(int argc, char** argv);
};
constexpr std::array subcommands{Subcommand{"plan", plan}, Subcommand{"survey", survey}, Subcommand{"shard", shard},
                                 Subcommand{"merge", merge}, Subcommand{"status", status}};

}  // namespace

std::optional<int> run_subcommand(int argc, char** argv) {
  for (const Subcommand& subcommand : subcommands) {
    if (argc < 2 || subcommand.name != argv[1]) continue;
    catch_stop_signals();
    return subcommand.run(argc - 1, argv + 1);
  }
  return std::nullopt;
}

}  // namespace lbea::tool
