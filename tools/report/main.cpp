// lbea-report: the report of a recorded test, as one HTML page.
#include "adapters/files/atomic_file.hpp"
#include "adapters/files/atomic_folder.hpp"
#include "adapters/mcap/records.hpp"
#include "runtime/src/model/model_format.hpp"
#include "tools/report/content/channels/channel_export.hpp"
#include "tools/report/page/page.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"

#include <array>
#include <cstdio>
#include <fstream>

namespace lbea::tool {
namespace {

struct Options {
  ReportOptions report;
  std::filesystem::path output, csv, mme;
  bool json = false;
};

constexpr auto description =
    "Writes the report of a recorded test as one HTML page, which needs no other file and can be printed: the verdict "
    "and what it means,\n"
    "the account of the frames, frames beside match and estimate, curves, the regions that are explained worst, "
    "versions and checksums.\n"
    "With --channels-csv and --mme, it writes the quantities of interest of the test over time.\n"
    "A damaged recording is reported as far as it can be read; the report says so. The exit code is 1 when no report "
    "is written.";

/// A report must not replace what it is about.
void require_other_file(const std::filesystem::path& output, const std::filesystem::path& input) {
  std::error_code unknown;
  if (!output.empty() && std::filesystem::equivalent(output, input, unknown))
    throw WrongUsage(output.string() + " would replace " + input.string() + "; give another name");
}

void require_no_recording_or_model(const std::filesystem::path& output) {
  std::array<std::uint8_t, 8> begin{};
  static_assert(begin.size() == mcap::magic.size() && begin.size() == format::magic.size());
  std::ifstream(output, std::ios::binary).read(reinterpret_cast<char*>(begin.data()), begin.size());
  if (begin == mcap::magic || begin == format::magic)
    throw WrongUsage(output.string() + " is a recording or a model; nothing was overwritten, give another name");
}

/// names: of the options.
void require_different(const std::filesystem::path& a, const std::filesystem::path& b, const char* names) {
  const auto place = [](const std::filesystem::path& path) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path) / "").parent_path();
  };
  if (!a.empty() && !b.empty() && place(a) == place(b))
    throw WrongUsage(std::string(names) + " have the same destination; give another name");
}

void require_destinations(const Options& options) {
  if (options.output.empty() && options.csv.empty() && options.mme.empty() && !options.json)
    throw WrongUsage("no destination. Give -o REPORT.html, --json, --channels-csv FILE or --mme FOLDER");
  for (const auto* file : {&options.output, &options.csv}) {
    require_other_file(*file, options.report.recording);
    for (const std::string& model : options.report.model_files) require_other_file(*file, model);
    if (!file->empty()) require_no_recording_or_model(*file);
  }
  require_different(options.output, options.csv, "-o and --channels-csv");
  require_different(options.output, options.mme, "-o and --mme");
  require_different(options.csv, options.mme, "--channels-csv and --mme");
  if (!options.mme.empty()) io::require_new_folder(options.mme);
}

int report(Options options) {
  const Log log("lbea-report");
  catch_stop_signals();
  require_destinations(options);
  options.report.keeps_all_frames = !options.csv.empty() || !options.mme.empty();
  std::optional<StageProgress> progress(std::in_place);
  const std::vector<TestReport> reports = make_reports(
      options.report,
      [&](std::string_view stage, std::uint64_t done, std::uint64_t total) { progress->show(stage, done, total); });
  progress.reset();
  for (const TestReport& report : reports)
    for (const auto* file : {&options.output, &options.csv}) require_other_file(*file, report.model_file);
  if (reports.size() > 1 && options.report.keeps_all_frames)
    throw Error(Status::bad_config,
                "--channels-csv and --mme export the quantities of one component; give its --model alone");
  if (!options.csv.empty()) io::write_file(options.csv, csv_of(reports.front()));
  if (!options.mme.empty()) io::write_mme(options.mme, mme_of(reports.front()), require_not_stopped);
  if (!options.output.empty()) io::write_file(options.output, page_of(reports));
  if (options.json) std::printf("%s\n", summary_json(reports).c_str());
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
  tool.add_option("--model", options.report.model_files,
                  "the model (.lbea) that the frames were matched with, of several components once for each that is "
                  "reported; default: the files that the recording names")
      ->check(lbea::tool::existing_file());
  auto* pose = tool.add_option("--pose", options.report.pose_file,
                               "sensor.json, for a recording by lbea-record, which does not know the pose")
                   ->check(lbea::tool::existing_file());
  tool.add_flag("--no-pose", options.report.without_pose, "the points are in the reference's coordinates")
      ->excludes(pose);
  tool.add_option("--test", options.report.test,
                  "number of the test in the recording, from 1; default: the one with the most matched frames");
  tool.add_option("--channels-csv", options.csv, "table of the quantities of interest, a row per matched frame (CSV)");
  tool.add_option("--mme", options.mme,
                  "new folder for the quantities of interest as signals of ISO/TS 13499 (ISO-MME), in SI units");
  tool.add_flag("--json", options.json, "print a summary as JSON");
  return tool.run(argc, argv, [&] { return lbea::tool::report(options); });
}
