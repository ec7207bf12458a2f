// lbea-bake: an ensemble of simulations becomes one model file.
#include "precompute/bake.hpp"
#include "tools/bake/command_line.hpp"
#include "tools/bake/ensemble_input.hpp"
#include "tools/bake/report.hpp"
#include "tools/common/progress.hpp"

#include <optional>
#include <string>

namespace {

using namespace lbea;

/// One progress line per stage.
class StageProgress {
 public:
  void show(const BakeProgress& progress) {
    if (!line_ || progress.stage != stage_) line_.emplace(std::string(progress.stage), progress.total);
    stage_ = progress.stage;
    line_->advance_to(progress.done);
  }
  void end() { line_.reset(); }

 private:
  std::string stage_;
  std::optional<Progress> line_;
};

int run(const BakeCommand& command) {
  catch_stop_signals();
  EnsembleDescription description = described(command);
  read_region_nodes(description.region);
  StageProgress progress;
  BakeOptions options;
  options.threads = command.threads;
  options.visible_nodes = visibility(description.region, command.threads);
  options.views = view_rendering(description.views);
  options.progress = [&](const BakeProgress& stage) { progress.show(stage); };
  options.cancelled = [] { return stop_requested != 0; };
  const BakeSummary summary = bake(open_ensemble(description), description, description.output, options);
  progress.end();
  command.json ? print_json(summary, description.output) : print_table(summary, description.output);
  return exit_ok;
}

}  // namespace

int main(int argc, char** argv) {
  Tool tool("lbea-bake", "Bakes an ensemble of simulations into one model file for the runtime.",
            "lbea-bake ensemble.toml -o rail.lbea\n"
            "  lbea-bake --run runs/run_001 --run runs/run_002 --region-nodes nodes.txt -o rail.lbea");
  BakeCommand command;
  declare(tool, command);
  tool.final_callback([&] {
    if (command.toml.empty() && command.runs.empty())
      throw CLI::ValidationError("name an ensemble.toml, or runs with --run");
    if (command.toml.empty() && command.output.empty()) throw CLI::ValidationError("name the model with -o");
  });
  return tool.run(argc, argv, [&] { return run(command); });
}
