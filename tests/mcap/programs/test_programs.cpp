// Recording, inspecting, recovering and replaying with the programs and the model of the demo ensemble.
#include "tests/mcap/bench.hpp"
#include "tests/support/instrumented.hpp"

#include <random>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace std::chrono_literals;
using namespace lbea::test;

namespace {

bool has_oracle() { return std::system("test -d " LBEA_ORACLE "/node_modules && command -v node >/dev/null") == 0; }

Json ask_oracle(const std::string& file) {
  const test::Outcome outcome = run_program("node " LBEA_ORACLE "/check.mjs " + file, "/");
  CAPTURE(outcome.err);
  REQUIRE(outcome.exit_code == 0);
  return Json::parse(outcome.out);
}

}  // namespace

TEST_CASE("a run is recorded completely with every compression, and independent readers agree") {
  for (const std::string compression : {"none", "lz4", "zstd"}) {
    CAPTURE(compression);
    Bench bench;
    record(bench, "run.mcap", 25, {"--record-compression", compression});
    const Json report = bench.inspect("run.mcap", 0);
    CHECK(report["complete"] == true);
    CHECK(report["flaws"].empty());
    CHECK(report["frames"] == 25);
    CHECK(report["results_by_status"]["ok"] == 25);
    CHECK(report["sessions"][0]["ended"] == true);
    CHECK(report["settings"]["method"] == "lbea");
    CHECK_FALSE(std::filesystem::exists(bench.file("run.mcap.partial")));
    CHECK(contains(text_of(bench.file("serve.out")), "\"recorded\":25,\"unrecorded\":0"));
    if (!has_oracle()) {
      MESSAGE("no node or no network: independent readers were not run");
      continue;
    }
    const Json oracle = ask_oracle(bench.file("run.mcap"));
    CHECK(oracle["topics"]["/frames"] == 25);
    CHECK(oracle["topics"]["/results"] == report["results"]);
    CHECK(oracle["topics"]["/state"] == report["states"]);
    CHECK(oracle["points"] == 25 * std::uint64_t{Model::open(LBEA_MODEL).nodes()});
    CHECK(oracle["metadata"]["lbea.recording"]["model_file"] == LBEA_MODEL);
    CHECK(oracle["metadata"]["lbea.recording.end"]["frames_recorded"] == "25");
  }
}

TEST_CASE("every replay gives the recorded results to the bit on any number of threads") {
  for (const std::string method : {"lbea", "vtp", "fit"}) {
    CAPTURE(method);
    Bench bench;
    record(bench, "run.mcap", 30, {"--method", method, "--pose", rail_pose});
    std::string first;
    for (const int threads : {1, 1, 2, 3}) {
      const std::string output = "results" + std::to_string(std::rand()) + ".mcap";
      const test::Outcome replay =
          bench.replay("run.mcap --model " LBEA_MODEL " --threads " + std::to_string(threads) + " -o " + output);
      CAPTURE(replay.err);
      REQUIRE(replay.exit_code == 0);
      const std::string bytes = text_of(bench.file(output));
      if (first.empty()) first = bytes;
      CHECK(bytes.size() > 1000);
      CHECK(bytes == first);
    }
    const test::Outcome against = bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
    CAPTURE(against.err);
    CHECK(against.exit_code == 0);
    const Json tally = Json::parse(against.out);
    CHECK(tally["same"] == 30);
    CHECK(tally["different"] == 0);
    CHECK(tally["not_recorded"] == 0);
    CHECK(tally["not_repeated"] == 0);
  }
}

TEST_CASE("any number of matchers gives, to the bit, the results of one") {
  for (const std::vector<std::string>& method : std::vector<std::vector<std::string>>{
           {"lbea"}, {"vtp"}, {"fit"}, {"fit", "--fixed-pose"}, {"fit", "--frames-alone"}})
    for (const std::string matchers : {"1", "2", "3"}) {
      CAPTURE(method.front());
      CAPTURE(method.back());
      CAPTURE(matchers);
      Bench bench;
      std::vector<std::string> options{"--pose", rail_pose, "--matchers", matchers, "--method"};
      options.insert(options.end(), method.begin(), method.end());
      record(bench, "run.mcap", 30, options);
      CHECK(contains(text_of(bench.file("serve.out")), "\"matched\":30,"));
      CHECK((contains(text_of(bench.file("serve.err")), "one after the other")) ==
            (method.front() == "fit" && method.back() != "--frames-alone" && matchers != "1"));
      const test::Outcome against = bench.replay("run.mcap --model " LBEA_MODEL " --against --threads 1 --json");
      CAPTURE(against.err);
      CHECK(against.exit_code == 0);
      const Json tally = Json::parse(against.out);
      CHECK(tally["same"] == 30);
      CHECK(tally["different"] == 0);
    }
}

TEST_CASE("a replay with another model is reported") {
  Bench bench;
  record(bench, "run.mcap", 10);
  const test::Outcome against = bench.replay("run.mcap --model " LBEA_OTHER_MODEL " --against");
  CHECK(against.exit_code == 1);
  CHECK(contains(against.err, "is not the model of the recording"));
  CHECK(contains(against.out, "frame 0: then "));
  CHECK(contains(against.out, "0 results the same, 10 different"));
  const test::Outcome loose =
      bench.replay("run.mcap --model " LBEA_MODEL " --against --tolerance 0.001 --range 0:0.0001");
  CHECK(loose.exit_code == 0);
}

TEST_CASE("refused, repeated and missing frames are recorded as such") {
  Bench bench;
  const auto server = bench.serve({"--record", bench.file("run.mcap"), "--max-points", "20000"});
  WireContext context;
  Camera camera(context, bench.frames());
  camera.send(0);
  camera.send(0);  // sent twice
  const std::vector<Point> many(20'001), none;
  camera.send_bytes(camera.encoder().frame({1, 5, many}, 1));  // too many points
  camera.send_bytes(camera.encoder().frame({2, 5, none}, 1));  // empty
  camera.send_bytes(std::as_bytes(std::span("no frame at all", 15)));
  camera.send(5);  // 3 and 4 are not sent
  camera.send(1ull << 40, 2);
  camera.end(6);
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  CHECK(stop(*server) == 1);
  const Json report = bench.inspect("run.mcap", 1);
  CHECK(report["intact"] == true);
  CHECK(report["complete"] == false);
  CHECK(report["missing"] == 2);
  CHECK(report["duplicates"] == 1);
  CHECK(report["unanswered"] == 0);
  CHECK(report["results_by_status"]["too_many_points"] == 1);
  CHECK(report["sessions"][1]["first_id"] == 1ull << 40);
  const test::Outcome against = bench.replay("run.mcap --model " LBEA_MODEL " --against");
  CAPTURE(against.out);
  CHECK(against.exit_code == 0);
}

TEST_CASE("a replay to a socket sends the same frames at the recorded pace, faster, in part and repeatedly" *
          doctest::skip(test::is_instrumented)) {
  Bench bench;
  {
    const auto server = bench.serve({"--record", bench.file("run.mcap")});
    WireContext context;
    Camera camera(context, bench.frames());
    for (std::uint64_t id = 0; id < 20; ++id) {
      camera.send(id);
      std::this_thread::sleep_for(20ms);
    }
    camera.end(20);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    CHECK(stop(*server) == 0);
  }
  const auto again = [&](const std::string& arguments) {
    std::filesystem::remove(bench.file("again.mcap"));
    const auto server = bench.serve({"--record", bench.file("again.mcap")});
    const test::Outcome outcome = bench.replay("run.mcap --to " + bench.frames() + " --json " + arguments);
    CAPTURE(outcome.err);
    CHECK(outcome.exit_code == 0);
    CHECK(stop(*server) == 0);
    return Json::parse(outcome.out);
  };
  const Json paced = again("");
  CHECK(paced["sent"] == 20);
  CHECK(paced["seconds"].get<double>() >= 0.38);
  const Json first = bench.inspect("run.mcap", 0), second = bench.inspect("again.mcap", 0);
  CHECK(second["sessions"] == first["sessions"]);
  if (has_oracle())
    CHECK(ask_oracle(bench.file("again.mcap"))["points"] == ask_oracle(bench.file("run.mcap"))["points"]);
  CHECK(again("--speed 10")["seconds"].get<double>() < paced["seconds"].get<double>());
  CHECK(again("--fast --loop 3")["sent"] == 60);
  CHECK(bench.inspect("again.mcap", 0)["sessions"].size() == 3);
  {  // Regression: all rounds ended after the last one, so the matcher dropped the frames of all but the first.
    const auto server = bench.serve({"--one-sender"});
    const test::Outcome outcome =
        bench.replay("run.mcap --to " + bench.frames() + " --results " + bench.results() + " --json --fast --loop 3");
    CHECK_MESSAGE(outcome.exit_code == 0, outcome.err);
    CHECK(Json::parse(outcome.out)["receipt"]["received"] == 60);
    CHECK(Json::parse(outcome.out)["receipt"]["dropped"] == 0);
    CHECK(stop(*server) == 0);
  }
  const auto part = again("--fast --range 0.1:0.3")["sent"].get<int>();
  CHECK(part >= 5);
  CHECK(part <= 15);
  const auto server = bench.serve();
  const test::Outcome stepped =
      run_program("sh -c 'printf \"\\n\\n\\n\" | " LBEA_REPLAY " run.mcap --json --step --to " + bench.frames() + "'",
                  bench.folder.path());
  CHECK(Json::parse(stepped.out)["sent"] == 3);
  CHECK(stop(*server) == 0);
}

TEST_CASE("after a kill at any time everything but the last moment is recovered, and independent readers open it") {
  std::mt19937 random(7);
  for (int round = 0; round < 4; ++round) {
    CAPTURE(round);
    Bench bench;
    auto server = bench.serve({"--record", bench.file("run.mcap")});
    WireContext context;
    ResultSource results(context, bench.results());
    Camera camera(context, bench.frames());
    const std::uint64_t frames = 20 + random() % 40;
    for (std::uint64_t id = 0; id < frames; ++id) camera.send(id);
    // Older messages have left the process.
    std::uint64_t answered = 0;
    WireResult result;
    while (answered < frames / 2) {
      const auto message = results.receive(10s);
      if (!message) break;  // the first results were published before this subscription
      if (decode_result(*message, result) == WireStatus::ok) answered = std::max(answered, result.frame_id);
    }
    std::this_thread::sleep_for(50ms);
    for (std::uint64_t id = frames; id < frames + random() % 20; ++id) camera.send(id);
    server->signal(SIGKILL);
    CHECK(server->wait() == 128 + SIGKILL);
    CHECK_FALSE(std::filesystem::exists(bench.file("run.mcap")));
    CHECK(bench.inspect("run.mcap.partial", 1)["closed"] == false);
    CHECK(contains(bench.replay("run.mcap.partial --model " LBEA_MODEL).err, "lbea-inspect --recover"));
    const test::Outcome recovery =
        run_program(LBEA_INSPECT " --recover run.mcap.partial -o fixed.mcap --json", bench.folder.path());
    CAPTURE(recovery.err);
    REQUIRE(recovery.exit_code == 0);
    // Regression: the documented command failed because the new file's .partial name was that of the old file.
    CHECK(run_program(LBEA_INSPECT " --recover run.mcap.partial -o run.mcap", bench.folder.path()).exit_code == 0);
    CHECK(text_of(bench.folder / "run.mcap") == text_of(bench.folder / "fixed.mcap"));
    CHECK(std::filesystem::exists(bench.folder / "run.mcap.partial"));
    std::filesystem::remove(bench.folder / "run.mcap");
    const Json report = bench.inspect("fixed.mcap", 1);  // sound, but the recorder's closing metadata are missing
    CHECK(report["intact"] == true);
    CHECK(report["indexed"] == true);
    CHECK(report["frames"].get<std::uint64_t>() >= answered);
    CHECK(report["missing"] == 0);
    if (has_oracle()) CHECK(ask_oracle(bench.file("fixed.mcap"))["topics"]["/frames"] == report["frames"]);
    CHECK(bench.replay("fixed.mcap --model " LBEA_MODEL " --json").exit_code == 0);
  }
}

TEST_CASE("a full disk is logged at once and at the end, counted in every result, and gives exit code 1") {
  Bench bench;
  const std::string command = "echo $$ >pid; exec " LBEA_SERVE " " LBEA_MODEL " --frames " + bench.frames() +
                              " --results " + bench.results() + " --json --queue 64 --record-memory 16 --record " +
                              bench.file("run.mcap");
  const auto server = bench.start({"/bin/sh", "-c", "cd " + bench.folder.path().string() + " && " + command}, "serve",
                                  "ready: frames on");
  REQUIRE(run_program("prlimit --pid $(cat pid) --fsize=100000:", bench.folder.path()).exit_code == 0);
  WireContext context;
  ResultSource results(context, bench.results());
  Camera camera(context, bench.frames());
  for (std::uint64_t id = 0; id < 20; ++id) camera.send(id);
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "LOST so far"); }));
  camera.send(20);
  WireResult result;
  REQUIRE(eventually([&] {
    const auto message = results.receive(100ms);
    return message && decode_result(*message, result) == WireStatus::ok && result.frame_id == 20;
  }));
  CHECK(result.counters.unrecorded > 0);
  // Regression: the phase stayed "recording" and the last log line was "is complete".
  CHECK(recording_in(RecordingPhase::failed, context, bench.results()).has_value());
  REQUIRE(run_program("prlimit --pid $(cat pid) --fsize=unlimited:", bench.folder.path()).exit_code ==
          0);  // space for the end of the file
  CHECK(stop(*server) == 1);
  CHECK(contains(text_of(bench.file("serve.err")), "run.mcap is closed and NOT complete: "));
  CHECK_FALSE(contains(text_of(bench.file("serve.err")), "is complete"));
  const Json tally = Json::parse(text_of(bench.file("serve.out")));
  CHECK(tally["matched"] == 21);
  CHECK(tally["unrecorded"].get<std::uint64_t>() > 0);
  CHECK(contains(text_of(bench.file("serve.err")), "File too large"));
  // It is sound and lists what it lacks.
  const Json report = bench.inspect("run.mcap", 1);
  CHECK(report["intact"] == true);
  CHECK(report["complete"] == false);
  CHECK(report["lost_while_recording"] == tally["unrecorded"]);
}

TEST_CASE("a window around SIGUSR1, and one around the first frame after the trigger's stamp") {
  Bench bench;
  for (const bool by_stamp : {false, true}) {
    const std::string name = by_stamp ? "stamp.mcap" : "signal.mcap";
    std::vector<std::string> more{"--record", bench.file(name), "--record-window", "60:0.2"};
    if (by_stamp) more.insert(more.end(), {"--trigger-ns", "1005"});
    const auto server = bench.serve(more);
    WireContext context;
    Camera camera(context, bench.frames());
    const auto armed = recording_in(RecordingPhase::armed, context, bench.results());
    REQUIRE(armed.has_value());
    // Approximate, because other programs use the disk.
    const double space = static_cast<double>(std::filesystem::space(bench.folder.path()).available);
    CHECK(static_cast<double>(armed->free_bytes) == doctest::Approx(space).epsilon(0.2));
    for (std::uint64_t id = 0; id < 4; ++id) camera.send(id);
    std::this_thread::sleep_for(100ms);
    CHECK_FALSE(contains(text_of(bench.file("serve.err")), "recording: triggered"));
    if (!by_stamp) server->signal(SIGUSR1);
    for (std::uint64_t id = 4; id < 7; ++id) camera.send(id);
    CHECK(eventually([&] { return std::filesystem::exists(bench.file(name)); }));  // while the server continues
    const auto finished = recording_in(RecordingPhase::finished, context, bench.results());
    REQUIRE(finished.has_value());
    const auto size = std::filesystem::file_size(bench.file(name));
    CHECK(finished->bytes == size);  // regression: the index was not counted
    for (std::uint64_t id = 7; id < 10; ++id) camera.send(id);
    camera.end(10);
    CHECK(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    CHECK(stop(*server) == 0);
    CHECK(bench.inspect(name, 0)["frames"] == 7);
  }
}

TEST_CASE("lbea-record alone and between a rig and a matcher") {
  Bench bench;
  const std::string rig = "ipc://" + bench.file("rig");
  {
    const auto recorder = bench.record("alone.mcap", rig);
    WireContext context;
    Camera camera(context, rig);
    for (std::uint64_t id = 0; id < 10; ++id) camera.send(id);
    camera.end(10);
    std::this_thread::sleep_for(300ms);
    CHECK(stop(*recorder) == 0);
    CHECK(bench.inspect("alone.mcap", 0)["frames"] == 10);
    CHECK(bench.inspect("alone.mcap", 0)["results"] == 0);
  }
  const auto server = bench.serve();
  const auto recorder = bench.start({LBEA_RECORD, bench.file("between.mcap"), "--frames", rig, "--forward",
                                     bench.frames(), "--results", bench.results(), "--record-memory", "16", "--json"},
                                    "record", "ready: frames on");
  WireContext context;
  Camera camera(context, rig);
  ResultSource results(context, bench.results());
  std::this_thread::sleep_for(700ms);  // until all subscriptions and connections exist
  for (std::uint64_t id = 0; id < 10; ++id) camera.send(id);
  camera.end(10);
  CHECK(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  std::this_thread::sleep_for(100ms);
  CHECK(stop(*recorder) == 0);
  CHECK(stop(*server) == 0);
  const Json report = bench.inspect("between.mcap", 0);
  CHECK(report["frames"] == 10);
  CHECK(report["results_by_status"]["ok"] == 10);
  CHECK(contains(text_of(bench.file("serve.out")), "\"matched\":10"));
}

// Regression: the last frames of a sender with a broken connection were not counted, and the file was complete.
TEST_CASE("lbea-record reports senders without goodbye and the incomplete run") {
  Bench bench;
  const std::string rig = "ipc://" + bench.file("rig");
  const auto recorder = bench.record("run.mcap", rig);
  {
    WireContext context;
    Camera camera(context, rig);
    camera.send_bytes(camera.encoder().control({1, ControlKind::hello, 0, 0}));
    for (std::uint64_t id = 0; id < 5; ++id) camera.send(id);
    std::this_thread::sleep_for(300ms);  // until they have arrived: without a frame there is nothing to account for
  }
  std::this_thread::sleep_for(IdTracker::default_sender_timeout + 300ms);
  CHECK(stop(*recorder) == 1);
  CHECK(contains(text_of(bench.file("record.err")),
                 "session 0000000000000001 did not say goodbye: its captures are accounted for up to id"));
  CHECK(Json::parse(text_of(bench.file("record.out")))["silent"] == 1);
}

TEST_CASE("errors are reported in one sentence") {
  Bench bench;
  const auto fails = [&](const std::string& command, int code, const std::string& sentence) {
    const test::Outcome outcome = run_program(command, bench.folder.path());
    CAPTURE(command);
    CAPTURE(outcome.err);
    CHECK(outcome.exit_code == code);
    CHECK(contains(outcome.err + outcome.out, sentence));
  };
  std::ofstream(bench.file("text.mcap")) << "hello";
  std::ofstream(bench.file("there.mcap")) << "";
  fails(LBEA_REPLAY " none.mcap --model " LBEA_MODEL, 1, "there is no file none.mcap");
  fails(LBEA_REPLAY " text.mcap --model " LBEA_MODEL, 1, "not a recording");
  fails(LBEA_REPLAY " text.mcap", 2, "Give --to ENDPOINT or --model MODEL");
  fails(LBEA_REPLAY " text.mcap --range a:b --model " LBEA_MODEL, 2, "write e.g. 0.5:2");
  fails(LBEA_REPLAY " text.mcap --speed 2 --model " LBEA_MODEL, 2, "--speed");
  fails(LBEA_REPLAY " text.mcap --step --model " LBEA_MODEL, 2, "--step");
  fails(LBEA_REPLAY " text.mcap --model " LBEA_MODEL " --to ipc:///tmp/x", 2, "--to");
  fails(LBEA_INSPECT " text.mcap", 1, "is not an MCAP file");
  fails(LBEA_INSPECT " --recover text.mcap -o new.mcap", 1, "no part of this file can be read");
  CHECK_FALSE(std::filesystem::exists(bench.file("new.mcap.partial")));
  fails(LBEA_INSPECT " --recover text.mcap -o there.mcap", 1, "never overwritten");
  fails(LBEA_INSPECT " --recover text.mcap", 2, "--output");
  const std::string endpoints = " --frames " + bench.frames() + " --results " + bench.results();
  fails(LBEA_SERVE " " LBEA_MODEL + endpoints + " --record there.mcap", 1, "never overwritten");
  fails(LBEA_SERVE " " LBEA_MODEL + endpoints + " --record /no/such/folder/x.mcap", 1, "check the folder");
  fails(LBEA_SERVE " " LBEA_MODEL + endpoints + " --record x.mcap --record-window 1", 1, "write e.g. 0.5:2");
  fails(LBEA_SERVE " " LBEA_MODEL + endpoints + " --record x.mcap --record-memory 10000000", 1, "more than half");
  fails(LBEA_RECORD " x.mcap", 2, "--frames");
}
