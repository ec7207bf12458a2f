// Replays of parts, of windows, of recordings made before a matcher, and receipts of the matcher.
#include "tests/mcap/bench.hpp"
#include "tests/support/instrumented.hpp"

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace std::chrono_literals;
using namespace lbea::test;
using Json = nlohmann::json;

// Regression: each passed with "0 the same, 0 different" or failed without a hint.
TEST_CASE("a part of a test is matched with the history of the whole; comparing nothing is a failure") {
  Bench bench;
  {
    const auto server = bench.serve({"--record", bench.file("run.mcap"), "--method", "fit", "--pose", rail_pose});
    WireContext context;
    Camera camera(context, bench.frames());
    camera.look_from(rail_pose);
    for (std::uint64_t id = 0; id < 30; ++id) {
      camera.send(id);
      std::this_thread::sleep_for(10ms);
    }
    camera.end(30);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    CHECK(stop(*server) == 0);
  }
  const test::Outcome all = bench.replay("run.mcap --model " LBEA_MODEL " --against --range 0: --json"),
                      late = bench.replay("run.mcap --model " LBEA_MODEL " --against --range 0.15: --json --threads 2");
  CAPTURE(late.out);
  CHECK(all.exit_code == 0);
  CHECK(late.exit_code == 0);
  CHECK(Json::parse(all.out)["same"] == 30);
  const auto same = Json::parse(late.out)["same"].get<int>();
  CHECK(same > 0);
  CHECK(same < 30);
  CHECK(Json::parse(late.out)["without_history"] == 0);
  const test::Outcome reversed = bench.replay("run.mcap --model " LBEA_MODEL " --against --range 2:1");
  CHECK(reversed.exit_code == 2);
  CHECK(contains(reversed.err, "it ends before it begins"));
  for (const std::string to :
       {"--model " LBEA_MODEL " --against", "--model " LBEA_MODEL " -o new.mcap", "--to ipc:///tmp/nobody"}) {
    const test::Outcome none = bench.replay("run.mcap --range 900: " + to);
    CAPTURE(none.err);
    CHECK(none.exit_code == 1);
    CHECK(contains(none.err, "no frame in --range 900:"));
  }
  CHECK_FALSE(std::filesystem::exists(bench.file("new.mcap")));
  REQUIRE(bench.replay("run.mcap --model " LBEA_MODEL " -o results.mcap").exit_code == 0);
  const test::Outcome without_frames = bench.replay("results.mcap --model " LBEA_MODEL " --against");
  CHECK(without_frames.exit_code == 1);
  CHECK(contains(without_frames.err, "it contains no frame"));
}

// Regression: with a fixed pose, matches were compared although they follow from frames before the window. Then nothing
// was compared, and every result counted as the same.
TEST_CASE("a window within a test cannot be compared: the results depend on earlier frames") {
  Bench bench;
  std::vector<std::string> more;
  SUBCASE("with the pose estimated") {}
  SUBCASE("with a fixed pose") { more = {"--fixed-pose"}; }
  {
    std::vector<std::string> arguments{
        "--record", bench.file("run.mcap"), "--record-window", "0:60", "--method", "fit", "--pose", rail_pose};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto server = bench.serve(arguments);
    WireContext context;
    Camera camera(context, bench.frames());
    camera.look_from(rail_pose);
    for (std::uint64_t id = 0; id < 10; ++id) camera.send(id);
    REQUIRE(recording_in(RecordingPhase::armed, context, bench.results()));
    std::this_thread::sleep_for(300ms);
    server->signal(SIGUSR1);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "recording: triggered"); }));
    for (std::uint64_t id = 10; id < 20; ++id) camera.send(id);
    camera.end(20);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    static_cast<void>(stop(*server));
  }
  const test::Outcome against = bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(against.out);
  CAPTURE(against.err);
  CHECK(against.exit_code == 1);
  const Json tally = Json::parse(against.out);
  CHECK(tally["same"] == 0);
  CHECK(tally["different"] == 0);
  CHECK(tally["without_history"] == 10);
  CHECK(contains(against.err, "the test began before the recording"));
  CHECK(contains(against.err, "start recording before the test"));
  // Without a history there is something to compare.
  const test::Outcome lbea = bench.replay("run.mcap --model " LBEA_MODEL " --against --json --method lbea");
  CHECK(Json::parse(lbea.out)["without_history"] == 0);
  CHECK(Json::parse(lbea.out)["different"] == 10);
}

namespace {

/// Compares run.mcap; all `same` results must be the same, and no other result may have been compared.
void check_same(const Bench& bench, int same, const std::string& more = "") {
  const test::Outcome against = bench.replay("run.mcap --model " LBEA_MODEL " --against --json " + more);
  CAPTURE(against.out);
  CAPTURE(against.err);
  CHECK(against.exit_code == 0);
  const Json tally = Json::parse(against.out);
  CHECK(tally["same"] == same);
  CHECK(tally["without_history"] == 0);
  CHECK(tally["not_recorded"] == 0);
  CHECK(tally["not_repeated"] == 0);
}

/// How many frames a replay matches.
std::ptrdiff_t replayed_frames(const Bench& bench) {
  const test::Outcome all = bench.replay("run.mcap --model " LBEA_MODEL " --json");
  CAPTURE(all.err);
  CHECK(all.exit_code == 0);
  return std::ranges::count(all.out, '\n');
}

}  // namespace

// Regression: a test whose first captures never arrived was said to have begun before the recording.
TEST_CASE("a test whose first capture was withheld is compared") {
  Bench bench;
  {
    const auto server = bench.serve({"--record", bench.file("run.mcap"), "--method", "fit", "--pose", rail_pose});
    WireContext context;
    Camera camera(context, bench.frames());
    camera.look_from(rail_pose);
    camera.send_bytes(camera.encoder().control({1, ControlKind::hello, 0, 0}));
    camera.send_bytes(camera.encoder().control({1, ControlKind::heartbeat, 1, 1}));
    for (std::uint64_t id = 1; id <= 20; ++id) camera.send(id);
    camera.end(21);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    static_cast<void>(stop(*server));
  }
  check_same(bench, 20);
}

// Regression: frames of a dropped sender divided the test when its frames were counted, and a replay without --against
// matched them.
TEST_CASE("frames of a dropped sender are neither matched nor part of the test's history") {
  Bench bench;
  {
    const auto server =
        bench.serve({"--record", bench.file("run.mcap"), "--method", "fit", "--pose", rail_pose, "--one-sender"});
    WireContext context;
    Camera camera(context, bench.frames());
    camera.look_from(rail_pose);
    for (std::uint64_t id = 0; id < 10; ++id)
      for (const std::uint64_t session : {1u, 2u}) camera.send(id, session);
    camera.end(10);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    static_cast<void>(stop(*server));
  }
  check_same(bench, 10);
  CHECK(replayed_frames(bench) == 10);
  const test::Outcome all = bench.replay("run.mcap --model " LBEA_MODEL " -o results.mcap");
  CHECK(contains(all.err, "10 recorded frames did not get into the matcher"));
}

// Regression: a replay continued the first test.
TEST_CASE("an end of stream divides the tests of a session in a replay too") {
  Bench bench;
  {
    const auto server = bench.serve({"--record", bench.file("run.mcap"), "--method", "fit", "--pose", rail_pose});
    WireContext context;
    Camera camera(context, bench.frames());
    camera.look_from(rail_pose);
    for (const std::uint64_t test : {0u, 1u}) {
      for (std::uint64_t id = 15 * test; id < 15 * (test + 1); ++id) {
        camera.send(id);
        std::this_thread::sleep_for(10ms);
      }
      camera.end(15 * (test + 1));
    }
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream before frame 30"); }));
    CHECK(stop(*server) == 0);
  }
  check_same(bench, 30);
  const test::Outcome late = bench.replay("run.mcap --model " LBEA_MODEL " --against --range 0.2: --json");
  CHECK(late.exit_code == 0);
  CHECK(Json::parse(late.out)["same"] > 0);
  const std::string table = bench.replay("run.mcap --model " LBEA_MODEL).out;  // one answer for each test
  CHECK(table.find("\ntest: ") != table.rfind("\ntest: "));
  const auto other = bench.serve({"--method", "lbea", "--pose", rail_pose});
  const test::Outcome sent = bench.replay("run.mcap --fast --to " + bench.frames());
  CHECK_MESSAGE(sent.exit_code == 0, sent.out, sent.err);
  CHECK(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream before frame 30"); }));
  CHECK(contains(text_of(bench.file("serve.err")), "end of stream before frame 15"));
  CHECK_MESSAGE(stop(*other) == 0, text_of(bench.file("serve.err")));
}

// Regression: a replay matched the frames that the matcher never got.
TEST_CASE("frames that lbea-record could not forward are not matched") {
  Bench bench;
  const std::string rig = "ipc://" + bench.file("rig");
  const auto start_recorder = [&] {
    return bench.start({LBEA_RECORD, bench.file("run.mcap"), "--frames", rig, "--forward", bench.frames(), "--results",
                        bench.results(), "--record-memory", "64"},
                       "record", "ready: frames on");
  };
  const auto start_matcher = [&] { return bench.serve({"--method", "fit", "--pose", rail_pose}); };
  std::unique_ptr<Process> recorder, server;
  WireContext context;
  std::optional<Camera> camera;
  const auto send = [&](std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t id = from; id < to; ++id) camera->send(id);
  };
  const auto look = [&] {
    camera.emplace(context, rig);
    camera->look_from(rail_pose);
  };
  const auto start_all = [&] {
    server = start_matcher();
    recorder = start_recorder();
    look();
    std::this_thread::sleep_for(700ms);
  };
  int refused = 10, undelivered = 0;
  SUBCASE("because there was no matcher") {
    recorder = start_recorder();
    look();
    SUBCASE("that knows the first captures") {
      camera->send_bytes(camera->encoder().control({1, ControlKind::hello, 0, 0}));
    }
    SUBCASE("that knows of them") {}
    send(0, 10);
    std::this_thread::sleep_for(300ms);
    server = start_matcher();
    std::this_thread::sleep_for(1500ms);  // until all subscriptions and connections exist
    send(10, 20);
  }
  SUBCASE("because it had no room") {
    start_all();
    send(0, 5);
    std::this_thread::sleep_for(300ms);
    server->signal(SIGSTOP);
    send(5, 200);
    std::this_thread::sleep_for(300ms);
    server->signal(SIGCONT);
    std::this_thread::sleep_for(700ms);
    send(200, 210);
    refused = 0;  // unknown
  }
  // Regression: they were forwarded, and not counted as lost.
  SUBCASE("because it was killed, and another one started") {
    start_all();
    send(0, 5);
    std::this_thread::sleep_for(1200ms);  // until a state has counted them
    server->signal(SIGSTOP);
    send(5, 10);
    std::this_thread::sleep_for(300ms);
    server->signal(SIGKILL);
    static_cast<void>(server->wait());
    server = start_matcher();
    std::this_thread::sleep_for(1500ms);
    send(10, 20);
    undelivered = 5;
  }
  if (!camera) return;
  camera->end(210);
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  std::this_thread::sleep_for(200ms);
  CHECK(stop(*recorder) == 1);
  static_cast<void>(stop(*server));
  if (undelivered > 0) {
    CHECK(contains(text_of(bench.file("record.err")), "the matcher did not get 5 of 20 frames (at most: what it"));
    return;
  }
  const auto matched = Json::parse(text_of(bench.file("serve.out")))["matched"].get<int>();
  if (refused > 0) CHECK(matched == refused);
  check_same(bench, matched, "--pose " + rail_pose);
}

TEST_CASE("a replay knows the time of impact as the matcher did, and the pose to be fixed") {
  Bench bench;
  record(bench, "run.mcap", 10, {"--method", "fit", "--pose", rail_pose, "--fixed-pose", "--trigger-ns", "500"});
  const test::Outcome against = bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(against.err);
  CHECK(against.exit_code == 0);
  CHECK(Json::parse(against.out)["same"] == 10);
}

namespace {

/// run.mcap by lbea-record, which passes ten frames on to a matcher.
void record_before_matcher(Bench& bench, std::vector<std::string> of_matcher,
                           const std::vector<std::string>& of_recorder = {}) {
  const std::string rig = "ipc://" + bench.file("rig");
  of_matcher.insert(of_matcher.end(), {"--pose", rail_pose});
  std::vector<std::string> recorder_call{
      LBEA_RECORD, bench.file("run.mcap"), "--frames",        rig, "--forward", bench.frames(),
      "--results", bench.results(),        "--record-memory", "16"};
  recorder_call.insert(recorder_call.end(), of_recorder.begin(), of_recorder.end());
  const auto server = bench.serve(of_matcher);
  const auto recorder = bench.start(recorder_call, "record", "ready: frames on");
  WireContext context;
  Camera camera(context, rig);
  camera.look_from(rail_pose);
  std::this_thread::sleep_for(700ms);  // until all subscriptions and connections exist
  for (std::uint64_t id = 0; id < 10; ++id) camera.send(id);
  camera.end(10);
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  std::this_thread::sleep_for(100ms);
  CHECK(stop(*recorder) == 0);
  CHECK(stop(*server) == 0);
}

}  // namespace

// Regression: lbea-record stored the time of impact, but not that it was given.
TEST_CASE("a recording made before a matcher has the time of impact that was given to lbea-record") {
  Bench bench;
  record_before_matcher(bench, {"--method", "fit", "--trigger-ns", "1005"}, {"--trigger-ns", "1005"});
  check_same(bench, 10, "--pose " + rail_pose);
}

// Regression: there was no way to tell a replay, so that results differed.
TEST_CASE("a recording made before a matcher of frames alone is replayed alone") {
  Bench bench;
  record_before_matcher(bench, {"--method", "fit", "--frames-alone", "--matchers", "2"});
  check_same(bench, 10, "--frames-alone --pose " + rail_pose);
  const test::Outcome with_history =
      bench.replay("run.mcap --model " LBEA_MODEL " --against --json --pose " + rail_pose);
  CHECK(Json::parse(with_history.out)["different"] > 0);
}

TEST_CASE("recorded before a matcher: method and model are known, the pose must be given") {
  Bench bench;
  record_before_matcher(bench, {"--method", "vtp"});
  const auto against = [&](const std::string& more) {
    return bench.replay("run.mcap --model " LBEA_MODEL " --against --json " + more);
  };
  const test::Outcome unknown = against("");
  CHECK(unknown.exit_code == 1);
  CHECK(contains(unknown.err, "does not contain the sensor's pose"));
  CHECK(against("--pose " + rail_pose).exit_code == 0);
  CHECK(Json::parse(against("--pose " + rail_pose).out)["same"] == 10);
  CHECK(Json::parse(against("--no-pose").out)["different"] == 10);
  CHECK(Json::parse(against("--method lbea --pose " + rail_pose).out)["different"] == 10);
  const test::Outcome other = bench.replay("run.mcap --model " LBEA_OTHER_MODEL " --pose " + rail_pose);
  CHECK(other.exit_code == 0);
  CHECK(contains(other.err, "is not the model of the recording"));
}

// Regression: a replay ended with 0 although the matcher had room for only a few of its frames.
TEST_CASE("a replay requests a receipt from the matcher, and a requested stop is not a failure") {
  Bench bench;
  record(bench, "run.mcap", 60);
  const std::string to = "run.mcap --fast --json --to " + bench.frames() + " --results " + bench.results();
  {
    const auto server = bench.serve();
    const test::Outcome whole = bench.replay(to);
    CAPTURE(whole.err);
    CHECK(whole.exit_code == 0);
    CHECK(Json::parse(whole.out)["receipt"]["received"] == 60);
    const test::Outcome again = bench.replay(to);  // repeated ids
    CHECK(again.exit_code == 1);
    CHECK(contains(again.err, "restart the matcher"));
    static_cast<void>(stop(*server));
  }
  {
    const auto server = bench.start({LBEA_SERVE, LBEA_MODEL, "--frames", bench.frames(), "--results", bench.results(),
                                     "--json", "--queue", "1", "--method", "vtp"},
                                    "serve", "ready: frames on " + bench.frames());
    const test::Outcome outcome = bench.replay(to);
    static_cast<void>(stop(*server));
    const Json receipt = Json::parse(outcome.out)["receipt"];
    const auto dropped = Json::parse(text_of(bench.file("serve.out")))["dropped"];
    CAPTURE(dropped.dump());
    CHECK(receipt["received"] == 60);
    CHECK(contains(dropped.dump(), receipt["dropped"].dump()));
    CHECK(outcome.exit_code == (receipt["dropped"] == 0 ? 0 : 1));
  }
  const auto server = bench.serve();
  CHECK(run_program(LBEA_REPLAY " run.mcap --fast --loop 0 --to " + bench.frames(), bench.folder.path(), 700ms)
            .exit_code == 0);
}

// Regression: lbea-replay showed the verdict of each frame but not of the test, and refused every frame with exit code
// 0.
TEST_CASE("a replay into a model ends with the test's verdict; when no frame is matched, it fails") {
  Bench bench;
  record(bench, "run.mcap", 20, {"--method", "fit", "--pose", rail_pose});
  const test::Outcome matched = bench.replay("run.mcap --model " LBEA_MODEL);
  CHECK(matched.exit_code == 0);
  CHECK_MESSAGE(contains(matched.out, "\ntest: "), matched.out);
  const test::Outcome refused = bench.replay("run.mcap --method lbea --no-pose --model " LBEA_MODEL);
  CHECK(refused.exit_code == 1);
  CHECK_MESSAGE(contains(refused.err, "20 frames came, and none of their points is near any simulation"), refused.err);
}

TEST_CASE("a recording that claims large frames took memory for them in every thread, whatever its frames" *
          doctest::skip(test::is_instrumented)) {
  Bench bench;
  {
    const auto recorder = bench.start({LBEA_RECORD, bench.file("run.mcap"), "--frames", bench.frames(), "--max-points",
                                       "16777216", "--record-memory", "16"},
                                      "record", "ready: frames on");
    WireContext context;
    Camera camera(context, bench.frames());
    for (std::uint64_t id = 0; id < 20; ++id) camera.send(id);
    camera.end(20);
    REQUIRE(eventually([&] { return contains(text_of(bench.file("record.err")), "end of stream"); }));
    CHECK(stop(*recorder) == 0);
  }
  const test::Outcome replay = test::run_program(
      "sh -c 'ulimit -v 1500000; " LBEA_REPLAY " run.mcap --threads 4 --method lbea --no-pose --model " LBEA_MODEL "'",
      bench.folder.path());
  CHECK_MESSAGE(replay.exit_code == 0, replay.err);
}
