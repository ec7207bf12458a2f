// lbea-report: the report of a recorded test, as one HTML page.
#include "adapters/files/atomic_file.hpp"
#include "tools/report/page/page.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"

#include <cstdio>

namespace lbea::tool {
namespace {

struct Options {
  ReportOptions report;
  std::filesystem::path output;
  bool json = false;
};

constexpr auto description =
    "Writes the report of a recorded test as one HTML page, which needs no other file and can be printed: the verdict "
    "and what it means,\n"
    "the account of the frames, frames beside match and estimate, curves, the regions that are explained worst, "
    "versions and checksums.\n"
    "A damaged recording is reported as far as it can be read; the report says so. The exit code is 1 when no report "
    "is written.";

/// A report must not replace what it is about.
void require_other_file(const std::filesystem::path& output, const std::filesystem::path& input) {
  std::error_code unknown;
  if (!output.empty() && std::filesystem::equivalent(output, input, unknown))
    throw WrongUsage("-o " + output.string() + " would replace " + input.string() + "; give another name");
}

int report(const Options& options) {
  const Log log("lbea-report");
  catch_stop_signals();
  if (options.output.empty() && !options.json) throw WrongUsage("no destination. Give -o REPORT.html or --json");
  require_other_file(options.output, options.report.recording);
  require_other_file(options.output, options.report.model_file);
  std::optional<StageProgress> progress(std::in_place);
  const TestReport report = make_report(
      options.report,
      [&](std::string_view stage, std::uint64_t done, std::uint64_t total) { progress->show(stage, done, total); });
  progress.reset();
  require_other_file(options.output, report.model_file);
  if (!options.output.empty()) io::write_file(options.output, page_of(report));
  if (options.json) std::printf("%s\n", summary_json(report).c_str());
  return exit_ok;
}

}  // namespace
}  // namespace lbea::tool

int main(int argc, char** argv) {
  lbea::tool::Options options;
  lbea::tool::Tool tool("lbea-report", lbea::tool::description,
                        "lbea-report test.mcap -o report.html\n  lbea-report test.mcap --model rail.lbea --json");
  tool.add_option("RECORDING", options.report.recording, "the recording (.mcap)")->required();
  tool.add_option("-o,--output", options.output,
                  "the page to write; an earlier one is replaced when the new one is complete");
  tool.add_option("--model", options.report.model_file,
                  "the model (.lbea) that the frames were matched with; default: the file that the recording names")
      ->check(lbea::tool::existing_file());
  auto* pose = tool.add_option("--pose", options.report.pose_file,
                               "sensor.json, for a recording by lbea-record, which does not know the pose")
                   ->check(lbea::tool::existing_file());
  tool.add_flag("--no-pose", options.report.without_pose, "the points are in the reference's coordinates")
      ->excludes(pose);
  tool.add_option("--test", options.report.test,
                  "number of the test in the recording, from 1; default: the one with the most matched frames");
  tool.add_flag("--json", options.json, "print a summary as JSON");
  return tool.run(argc, argv, [&] { return lbea::tool::report(options); });
}
