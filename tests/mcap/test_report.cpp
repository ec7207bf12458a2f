// lbea-report on real recordings: sound, cut off, and none.
#include "tests/mcap/bench.hpp"

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

namespace {

Outcome report(const Bench& bench, const std::string& arguments) {
  return run_program(LBEA_REPORT " " + arguments, bench.folder.path());
}

const std::string& rail_pose() {
  static const std::string file = (test::data() / "rail-demo/sensor.json").string();
  return file;
}

}  // namespace

TEST_CASE("a report has the accounts of lbea-inspect, and no text of the recording becomes markup") {
  Bench bench;
  record(bench, "<b>run&.mcap", 20, {"--method", "fit", "--pose", rail_pose()});
  const Outcome made = report(bench, "'<b>run&.mcap' -o report.html --json");
  REQUIRE_MESSAGE(made.exit_code == 0, made.err);
  const Json summary = Json::parse(made.out), inspected = bench.inspect("'<b>run&.mcap'", 0);
  for (const char* count : {"captured", "matched", "rejected", "dropped", "rejected_by_reason", "dropped_by_reason"})
    CHECK(summary["accounts"][count] == inspected["matcher"][count]);
  CHECK(summary["flaws"] == inspected["flaws"]);
  CHECK(summary["model_checksum"] == inspected["settings"]["model_checksum"]);
  CHECK(summary["tests"][0]["matched_frames"] == 20);
  const std::string page = text_of(bench.file("report.html"));
  CHECK_FALSE(contains(page, "<b>run"));
  CHECK(contains(page, "&lt;b&gt;run&amp;.mcap"));
  CHECK(contains(page, "data:image/png;base64,"));
  for (const char* foreign : {"<script", "http://", "https://", ">nan", ">inf"}) CHECK_FALSE(contains(page, foreign));
}

TEST_CASE("a cut recording gives a report that says so; without a recording, an earlier report stays") {
  Bench bench;
  record(bench, "run.mcap", 20, {"--method", "fit", "--pose", rail_pose()});
  const auto bytes = std::filesystem::file_size(bench.file("run.mcap"));
  std::filesystem::resize_file(bench.file("run.mcap"), bytes - 100);  // without its end; all chunks remain
  const Outcome cut = report(bench, "run.mcap -o report.html --json");
  REQUIRE_MESSAGE(cut.exit_code == 0, cut.err);
  CHECK(Json::parse(cut.out)["intact"] == false);
  const std::string page = text_of(bench.file("report.html"));
  CHECK(page.find("The recording is damaged") < page.find("class=\"answer"));
  CHECK(report(bench, "absent.mcap -o report.html").exit_code == 1);
  std::filesystem::resize_file(bench.file("run.mcap"), 2000);  // no chunk is whole
  const Outcome none = report(bench, "run.mcap -o report.html");
  CHECK(none.exit_code == 1);
  CHECK(contains(none.err, "contains no frame and no result"));
  CHECK(text_of(bench.file("report.html")) == page);
  CHECK(report(bench, "run.mcap -o run.mcap").exit_code == 2);
  CHECK(report(bench, "run.mcap").exit_code == 2);
}
