// lbea-report on real recordings: sound, cut off, of two tests, and none; and stopped while it reads one.
#include "tests/mcap/bench.hpp"

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

namespace {

Outcome report(const Bench& bench, const std::string& arguments) {
  return run_program(LBEA_REPORT " " + arguments, bench.folder.path());
}

void send_test(Camera& camera, std::uint64_t session, std::uint64_t frames) {
  for (std::uint64_t id = 0; id < frames; ++id) camera.send(id, session);
  camera.end(frames, session);
}

}  // namespace

TEST_CASE("a report has the accounts of lbea-inspect, and no text of the recording becomes markup") {
  Bench bench;
  record(bench, "<b>run&.mcap", 20, {"--method", "fit", "--pose", rail_pose});
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
  record(bench, "run.mcap", 20, {"--method", "fit", "--pose", rail_pose});
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

TEST_CASE("--test chooses among the tests of a recording; the one with the most frames is the default") {
  Bench bench;
  {
    const auto server = bench.serve({"--record", bench.file("run.mcap"), "--method", "fit", "--pose", rail_pose});
    WireContext context;
    Camera camera(context, bench.frames());
    camera.look_from(rail_pose);
    send_test(camera, 1, 6);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream before frame 6"); }));
    send_test(camera, 2, 15);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream before frame 15"); }));
    CHECK(stop(*server) == 0);
  }
  const auto summary_of = [&](const std::string& more) {
    const Outcome made = report(bench, "run.mcap --json -o report.html" + more);
    REQUIRE_MESSAGE(made.exit_code == 0, made.err);
    return Json::parse(made.out);
  };
  const Json longest = summary_of(""), first = summary_of(" --test 1"), second = summary_of(" --test 2");
  CHECK(first["tests"].size() == 2);
  CHECK(first["end"]["frame"] == 5);
  CHECK(second["end"]["frame"] == 14);
  CHECK(longest == second);
  CHECK(contains(text_of(bench.file("report.html")), "This report is about test 2"));
  const Outcome absent = report(bench, "run.mcap --test 3 -o absent.html");
  CHECK(absent.exit_code == 1);
  CHECK(contains(absent.err, "the recording has 2 tests"));
  CHECK_FALSE(std::filesystem::exists(bench.file("absent.html")));
}

TEST_CASE("several components: a verdict of the test, and the report of each, as lbea-replay finds them") {
  Bench bench;
  record(bench, "run.mcap", 20, {LBEA_OTHER_MODEL, "--method", "fit", "--pose", rail_pose, "--min-coverage", "0.1"});
  const Outcome made = report(bench, "run.mcap -o report.html --json");
  REQUIRE_MESSAGE(made.exit_code == 0, made.err);
  const Json summary = Json::parse(made.out), inspected = bench.inspect("run.mcap", 0);
  CHECK(summary["accounts"]["captured"] == 20);
  CHECK(summary["accounts"]["matched"] == inspected["matcher"]["matched"]);
  const std::string page = text_of(bench.file("report.html"));
  const std::string replayed = bench.replay("run.mcap --model " LBEA_MODEL " --model " LBEA_OTHER_MODEL).out;
  const std::array<std::string, 2> names{"channels", "other"}, files{LBEA_MODEL, LBEA_OTHER_MODEL};
  REQUIRE(summary["components"].size() == 2);
  for (std::size_t i = 0; i < names.size(); ++i) {
    CAPTURE(names[i]);
    const std::string begin = "test, " + names[i] + ": ";
    REQUIRE(contains(replayed, begin));
    const std::size_t at = replayed.find(begin) + begin.size();
    const std::string answer = replayed.substr(at, replayed.find('\n', at) - at);
    CHECK(contains(page, "<tr><td>" + names[i] + "</td><td>" + answer + "</td><td class=\"number\">20</td></tr>"));
    CHECK(contains(page, "<article aria-label=\"" + names[i] + "\"><h1>Component " + names[i] + "</h1>"));
    CHECK(contains(page, "<section aria-label=\"" + names[i] + ": End\">"));
    Json component = summary["components"][i];
    CHECK(component["component"] == names[i]);
    CHECK(component["channels"].empty() == (i == 1));
    CHECK(component["tests"][0]["matched_frames"] == 20);
    // Of one component alone, the same.
    const Outcome alone = report(bench, "run.mcap -o alone.html --json --model " + files[i]);
    REQUIRE_MESSAGE(alone.exit_code == 0, alone.err);
    CHECK(contains(text_of(bench.file("alone.html")), "Not in this report: component " + names[1 - i] + "."));
    const Json of_one = Json::parse(alone.out);
    for (const auto& entry : component.items()) CHECK_MESSAGE(of_one[entry.key()] == entry.value(), entry.key());
  }
  CHECK(contains(page, "--model " LBEA_MODEL " --model " LBEA_OTHER_MODEL " --against"));
  CHECK_FALSE(contains(page, "Not in this report"));

  CHECK(report(bench, "run.mcap --channels-csv table.csv --model " LBEA_MODEL).exit_code == 0);
  const Outcome both = report(bench, "run.mcap --channels-csv both.csv");
  CHECK(both.exit_code == 1);
  CHECK(contains(both.err, "give its --model alone"));
  CHECK_FALSE(std::filesystem::exists(bench.file("both.csv")));
  record(bench, "one.mcap", 3, {"--method", "fit", "--pose", rail_pose});
  CHECK(contains(report(bench, "one.mcap --json --model " LBEA_OTHER_MODEL).err, "is not the model"));
  CHECK(contains(report(bench, "one.mcap --json --model " LBEA_MODEL " --model " LBEA_OTHER_MODEL).err,
                 "was matched with one model"));
}

TEST_CASE("a report that is stopped or killed at any time leaves the earlier page or the whole new one") {
  Bench bench;
  record(bench, "run.mcap", 20, {"--method", "fit", "--pose", rail_pose});
  const std::string made_by = bench.file("run.mcap") + " -o " + bench.file("report.html");
  const auto begin = std::chrono::steady_clock::now();
  REQUIRE(report(bench, made_by).exit_code == 0);
  const std::chrono::duration<double> whole_run = std::chrono::steady_clock::now() - begin;
  const std::string page = text_of(bench.file("report.html"));
  constexpr int stops = 8;
  int stopped = 0;
  for (int i = 0; i < stops; ++i) {
    put(bench.file("report.html"), "earlier");
    Process process({LBEA_REPORT, bench.file("run.mcap"), "-o", bench.file("report.html")}, bench.file("out"),
                    bench.file("err"));
    const auto program = std::filesystem::path("/proc") / std::to_string(process.id()) / "exe";
    std::error_code unknown;  // until then it is a copy of this test
    REQUIRE(eventually([&] { return std::filesystem::equivalent(program, LBEA_REPORT, unknown); }));
    std::this_thread::sleep_for(whole_run * i / stops);
    process.signal(i % 2 == 0 ? SIGINT : SIGKILL);
    const int code = process.wait();
    const std::string left = text_of(bench.file("report.html"));
    stopped += left == "earlier" ? 1 : 0;
    CHECK((left == "earlier" || left == page));
    if (code == 0) CHECK((left == page));
    if (code == 1) CHECK(contains(text_of(bench.file("err")), "stopped; no report was written"));
  }
  CHECK(stopped > 0);
}

TEST_CASE("signals and table of a recorded test; an existing folder and the inputs are refused") {
  Bench bench;
  record(bench, "run.mcap", 20, {"--method", "fit", "--pose", rail_pose});
  const Outcome made = report(bench, "run.mcap --mme 'Test 1' --channels-csv table.csv");
  REQUIRE_MESSAGE(made.exit_code == 0, made.err);
  const std::filesystem::path folder = bench.file("Test 1");
  const std::string test = text_of(folder / "Test 1.mme");
  CHECK(contains(test, "recording run.mcap, test 1"));
  CHECK(contains(test, "Date of the test            :20"));
  const std::string list = text_of(folder / "Channel/Test 1.chn");
  CHECK(contains(list, "DSXV / struck end\n"));
  CHECK(contains(list, "VEXV / struck end, velocity\n"));
  CHECK_FALSE(contains(list, "simulation"));  // equal frames do not tell the impact
  CHECK(contains(text_of(folder / "Channel/Test 1.001"), "Number of samples           :20\n"));
  const std::string table = text_of(bench.file("table.csv"));
  CHECK(std::ranges::count(table, '\n') == 21);
  CHECK(contains(table, "struck end [mm]"));
  const Outcome again = report(bench, "run.mcap --mme 'Test 1'");
  CHECK(again.exit_code == 1);
  CHECK(contains(again.err, "Test 1: exists; give another name"));
  CHECK(report(bench, "run.mcap --channels-csv run.mcap").exit_code == 2);
  CHECK(report(bench, "run.mcap -o same --channels-csv same").exit_code == 2);
  // Regression: another test's recording, or a model, was replaced by the report.
  std::filesystem::copy_file(bench.file("run.mcap"), bench.file("other.mcap"));
  const Outcome replaced = report(bench, "run.mcap -o other.mcap");
  CHECK(replaced.exit_code == 2);
  CHECK(contains(replaced.err, "other.mcap is a recording or a model"));
  CHECK(text_of(bench.file("other.mcap")) == text_of(bench.file("run.mcap")));
}

TEST_CASE("a stopped or killed export leaves no folder or the whole one") {
  Bench bench;
  record(bench, "run.mcap", 20, {"--method", "fit", "--pose", rail_pose});
  const auto begin = std::chrono::steady_clock::now();
  REQUIRE(report(bench, "run.mcap --mme whole").exit_code == 0);
  const std::chrono::duration<double> whole_run = std::chrono::steady_clock::now() - begin;
  constexpr int stops = 8;
  for (int i = 0; i < stops; ++i) {
    const std::filesystem::path parent = bench.file("stopped-" + std::to_string(i)), folder = parent / "whole";
    std::filesystem::create_directory(parent);
    Process process({LBEA_REPORT, bench.file("run.mcap"), "--mme", folder.string()}, bench.file("out"),
                    bench.file("err"));
    const auto program = std::filesystem::path("/proc") / std::to_string(process.id()) / "exe";
    std::error_code unknown;  // until then it is a copy of this test
    REQUIRE(eventually([&] { return std::filesystem::equivalent(program, LBEA_REPORT, unknown); }));
    std::this_thread::sleep_for(whole_run * i / stops);
    const bool is_killed = i % 2 == 1;
    process.signal(is_killed ? SIGKILL : SIGINT);
    const int code = process.wait();
    const bool exists = std::filesystem::exists(folder);
    if (code == 0) CHECK(exists);
    if (!is_killed && code != 0) CHECK(std::filesystem::is_empty(parent));
    if (exists)
      for (const char* file : {"whole.mme", "Channel/whole.chn", "Channel/whole.001", "Channel/whole.002"})
        CHECK(text_of(folder / file) == text_of(std::filesystem::path(bench.file("whole")) / file));
  }
}
