// lbea-inspect: verifies a model or a recording and prints what is inside.
#include "tools/inspect/reports.hpp"
#include "tools/shared/cli/tool.hpp"

#include <filesystem>

namespace lbea::tool {
namespace {

struct Options {
  std::filesystem::path file, output, other;
  bool json = false, recovers = false;
};

constexpr auto description =
    "Verifies every byte of a model or a recording and prints its contents.\n"
    "The exit code is 1 when a model is damaged and when a recording is not complete: damaged, cut off, or without "
    "some\n"
    "frames or results. --recover writes the readable part of a cut or damaged recording to a new one.";

int inspect(const Options& options) {
  if (options.recovers) {
    recover_recording(options.file, options.output, options.json);
    return exit_ok;
  }
  if (options.other.empty() && is_recording(options.file))
    return print_recording(options.file, options.json) ? exit_ok : exit_failed;
  if (options.other.empty())
    print_model(options.file, options.json);
  else
    print_diff(options.file, options.other, options.json);
  return exit_ok;
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::Options options;
  lbea::tool::Tool tool("lbea-inspect", lbea::tool::description,
                        "lbea-inspect rail.lbea\n  lbea-inspect rail.lbea --diff rail-with-new-runs.lbea\n  "
                        "lbea-inspect --recover cut.mcap.partial -o whole.mcap");
  tool.add_option("FILE", options.file, "the model or recording")->required();
  auto* output = tool.add_option("-o,--output", options.output, "with --recover: the new file");
  auto* recover =
      tool.add_flag("--recover", options.recovers, "write the readable part of FILE to a new recording with an index");
  recover->needs(output);
  output->needs(recover);
  tool.add_option("--diff", options.other,
                  "a later model: prints which runs were added, withdrawn or changed, and other changes")
      ->excludes(recover);
  tool.add_flag("--json", options.json, "print as JSON");
  return tool.run(argc, argv, [&] { return lbea::tool::inspect(options); });
}
