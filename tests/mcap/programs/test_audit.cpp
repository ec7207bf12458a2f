// What lbea-inspect prints about a recording: whether the file is sound, and whether the test is whole.
#include "tests/mcap/bench.hpp"

#include <ctime>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

namespace {

const std::string clock_name = "%Y-%m-%d_%H-%M-%S";

std::string flaws_of(const Json& report) {
  std::string flaws;
  for (const Json& flaw : report["flaws"]) flaws += flaw.get<std::string>() + "\n";
  return flaws;
}

const Json& session_of(const Json& report, std::uint64_t number) {
  for (const Json& session : report["sessions"])
    if (std::stoull(session["session"].get<std::string>(), nullptr, 16) == number) return session;
  FAIL("session " << number << " is not in the report");
  return report;
}

void send_frames(Camera& camera, std::uint64_t session, std::uint64_t first, std::uint64_t past_last) {
  for (std::uint64_t id = first; id < past_last; ++id) camera.send(id, session);
}

}  // namespace

// Regression: losses before the first and after the last frame were not counted.
TEST_CASE("captures that never arrived or found no room at the sender are missing, also in a sound file") {
  Bench bench;
  const auto server = bench.serve({"--record", bench.file("run.mcap")});
  WireContext context;
  Camera camera(context, bench.frames());
  const auto say = [&](const Control& control) { camera.send_bytes(camera.encoder().control(control)); };
  say({1, ControlKind::hello, 0, 0});  // 0 to 4 of ten arrive
  send_frames(camera, 1, 0, 5);
  say({1, ControlKind::goodbye, 10, 0});
  say({2, ControlKind::hello, 0, 0});  // the first five never arrive
  send_frames(camera, 2, 5, 9);
  say({2, ControlKind::goodbye, 9, 0});
  say({3, ControlKind::hello, 0, 0});  // three in the middle and the last one find no room
  send_frames(camera, 3, 0, 2);
  say({3, ControlKind::heartbeat, 5, 3});
  send_frames(camera, 3, 5, 7);
  say({3, ControlKind::goodbye, 8, 1});
  say({4, ControlKind::hello, 0, 0});  // no frame arrives
  say({4, ControlKind::goodbye, 6, 0});
  const std::uint64_t frames = 5 + 4 + 4, missed = 5 + 5 + 6, withheld = 3 + 1;
  say({5, ControlKind::hello, 0, 0});  // all arrive
  send_frames(camera, 5, 0, 3);
  camera.end(3, 5);
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  CHECK(stop(*server) == 1);
  const Json report = bench.inspect("run.mcap", 1);
  CAPTURE(report.dump(1));
  CHECK(report["complete"] == false);
  CHECK(report["holds_all_that_came"] == true);
  CHECK(report["frames"] == frames + 3);
  CHECK(report["missing"] == missed + withheld);
  CHECK(report["matcher"]["captured"] == frames + 3 + missed + withheld);
  CHECK(report["matcher"]["missed"] == missed);
  CHECK(report["matcher"]["withheld"] == withheld);
  CHECK(report["matcher"]["dropped_by_reason"] == Json{{"missed", missed}, {"withheld", withheld}});
  const std::uint64_t missing[] = {5, 5, 4, 6, 0};
  for (std::uint64_t session = 1; session <= 5; ++session) {
    CAPTURE(session);
    CHECK(session_of(report, session)["missing"] == missing[session - 1]);
    CHECK(session_of(report, session)["first_id"] == 0);
    CHECK(session_of(report, session)["ended"] == true);
  }
  CHECK(contains(
      flaws_of(report),
      "20 captures of the test are missing; the matcher reports: 16 never arrived (missed), 4 found no room at "
      "the sender (withheld)"));
  const Outcome text = run_program(LBEA_INSPECT " run.mcap", bench.folder.path());
  CHECK(contains(text.out, "run.mcap: NOT COMPLETE"));
  CHECK(contains(text.out, "the file is sound and contains everything that was received"));
}

// Regression: the recording was called complete, because the sender was still connected.
TEST_CASE("a recording that is stopped in mid-test is not complete when its sender has said hello and no goodbye") {
  for (const bool alone : {false, true}) {
    CAPTURE(alone);
    Bench bench;
    const auto program = bench.record_run(alone);
    WireContext context;
    Camera camera(context, bench.frames());
    camera.send_bytes(camera.encoder().control({1, ControlKind::hello, 0, 0}));
    send_frames(camera, 1, 0, 5);
    CHECK(stop(*program) == 1);
    const Json report = bench.inspect("run.mcap", 1);
    CHECK(report["frames"] == 5);
    CHECK(report["complete"] == false);
    CHECK(report["holds_all_that_came"] == true);
    CHECK(contains(flaws_of(report), "1 senders did not say goodbye"));
  }
}

// Regression: a window without a trigger was a success, and a file without frames "complete".
TEST_CASE("a missing trigger is a failure, reported in the log and in the file; time 0 is a valid trigger") {
  for (const bool comes : {false, true}) {
    CAPTURE(comes);
    Bench bench;
    std::vector<std::string> more{"--record", bench.file("run.mcap"), "--record-window", "60:60"};
    if (comes) more.insert(more.end(), {"--trigger-ns", "0"});
    const auto server = bench.serve(more);
    WireContext context;
    Camera camera(context, bench.frames());
    for (std::uint64_t id = 0; id < 7; ++id) camera.send(id);
    camera.end(7);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    CHECK(stop(*server) == (comes ? 0 : 1));
    CHECK(contains(text_of(bench.file("serve.err")), "THERE WAS NO TRIGGER: none of 7 frames was recorded") == !comes);
    const Json report = bench.inspect("run.mcap", comes ? 0 : 1);
    CHECK(report["frames"] == (comes ? 7 : 0));
    CHECK(report["window"]["triggered"] == comes);
    CHECK(report["holds_all_that_came"] == comes);
    CHECK(contains(flaws_of(report), "there was no trigger: nothing was recorded for the window, of 7 frames") ==
          !comes);
  }
}

// Regression: SIGUSR1 killed programs without a window.
TEST_CASE("SIGUSR1 without a window only causes a warning") {
  Bench bench;
  const auto recorder = bench.start(
      {LBEA_RECORD, bench.file("alone.mcap"), "--frames", "ipc://" + bench.file("rig"), "--record-memory", "16"},
      "record", "ready: frames on");
  const auto recording = bench.serve({"--record", bench.file("run.mcap")});
  for (const auto* process : {&recorder, &recording}) (*process)->signal(SIGUSR1);
  for (const char* name : {"record.err", "serve.err"})
    CHECK(eventually(
        [&] { return contains(text_of(bench.file(name)), "SIGUSR1: there is no --record-window to trigger"); }));
  CHECK(stop(*recorder) == 0);
  CHECK(stop(*recording) == 0);
  const auto server = bench.serve();
  server->signal(SIGUSR1);
  CHECK(eventually(
      [&] { return contains(text_of(bench.file("serve.err")), "SIGUSR1: there is no --record-window to trigger"); }));
  CHECK(stop(*server) == 0);
}

// Regression: a service with --record could not be restarted because its own FILE or FILE.partial existed.
TEST_CASE(
    "with the time in its name a recording can be restarted with the same arguments, after a kill and after an end") {
  Bench bench;
  const auto names = [&] {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(bench.folder.path()))
      if (entry.path().filename().string().starts_with("run-")) found.push_back(entry.path().filename().string());
    std::ranges::sort(found);
    return found;
  };
  const std::vector<std::string> words{"--record", bench.file("run-100%%-" + clock_name + ".mcap")};
  for (std::size_t round = 0; round < 3; ++round) {
    const auto begin = std::chrono::steady_clock::now();
    const auto server = bench.serve(words);
    REQUIRE(names().size() == round + 1);
    const std::string name = names().back();
    CHECK(contains(text_of(bench.file("serve.err")),
                   "recording to " + bench.file(name.substr(0, name.rfind(".partial")))));
    std::tm time{};
    const char* const rest = ::strptime(name.c_str(), ("run-100%%-" + clock_name).c_str(), &time);
    REQUIRE(rest != nullptr);
    CHECK(std::string(rest) == ".mcap.partial");
    CHECK(std::abs(std::difftime(std::time(nullptr), std::mktime(&time))) <
          60 + 3600);  // allows for a change to or from daylight saving time
    server->signal(round == 0 ? SIGKILL : SIGINT);
    CHECK(server->wait() == (round == 0 ? 128 + SIGKILL : 0));
    std::this_thread::sleep_until(begin + 1100ms);  // until the next second
  }
}

TEST_CASE("invalid names for a recording are wrong usage") {
  Bench bench;
  const std::string endpoints = " --frames " + bench.frames() + " --results " + bench.results();
  for (const std::string name : {"", "%", "50%", "%D.mcap", "%q"})
    for (const std::string& program : {std::string(LBEA_SERVE " " LBEA_MODEL) + endpoints + " --record ",
                                       std::string(LBEA_SERVE " " LBEA_MODEL) + endpoints + " --check --record ",
                                       std::string(LBEA_RECORD " --frames ") + bench.frames() + " "}) {
      const Outcome outcome = run_program(program + "'" + name + "'", bench.folder.path());
      CAPTURE(program + name);
      CHECK(outcome.exit_code == 2);
      CHECK(contains(outcome.err,
                     name.empty() ? "is empty" : "write e.g. %Y-%m-%d_%H-%M-%S.mcap, and %% for a percent sign"));
    }
  CHECK(std::filesystem::is_empty(bench.folder.path()));
}

// Regression: results whose frame is before the window and frames whose result is after it made recordings incomplete.
TEST_CASE("a window may separate frames and their results at its edges, and only there") {
  Bench bench;
  const auto server =
      bench.serve({"--record", bench.file("run.mcap"), "--record-window", "0.02:0.02", "--trigger-ns", "1100"});
  WireContext context;
  Camera camera(context, bench.frames());
  for (std::uint64_t id = 0; id < 200; ++id) camera.send(id);
  camera.end(200);
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  static_cast<void>(stop(*server));
  const Json report = bench.inspect("run.mcap", 0);
  CAPTURE(report.dump(1));
  const auto frames = report["frames"].get<std::uint64_t>();
  const auto results = report["results"].get<std::uint64_t>() - report["results_by_status"].value("end_of_stream", 0u);
  CHECK(frames > 1);
  CHECK(report["complete"] == true);
  // At least the difference between the numbers of frames and results has no counterpart.
  CHECK(report["window"]["cut_apart"].get<std::uint64_t>() >= std::max(frames, results) - std::min(frames, results));
  const std::string all = text_of(bench.folder / "run.mcap");
  CHECK(contains(all, "window_begin_ns"));
}

// Regression: the file of lbea-replay was reported as incomplete because it has no frames.
TEST_CASE("a recording of results alone, written by a replay, is complete") {
  Bench bench;
  record(bench, "run.mcap", 10);
  REQUIRE(bench.replay("run.mcap --model " LBEA_MODEL " -o results.mcap").exit_code == 0);
  const Json report = bench.inspect("results.mcap", 0);
  CHECK(report["complete"] == true);
  CHECK(report["results_by_status"]["ok"] == 10);
  CHECK(report["matcher"].is_null());
}
