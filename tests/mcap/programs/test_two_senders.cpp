// Two senders at one matcher.
#include "tests/mcap/bench.hpp"

#include <map>

using namespace lbea::test;

namespace {

/// The status of each frame, by session.
using Statuses = std::map<std::uint64_t, std::vector<WireStatus>>;

Statuses receive(ResultSource& results, std::size_t count) {
  Statuses statuses;
  WireResult result;
  for (std::size_t received = 0; received < count;) {
    const auto message = results.receive(30s);
    REQUIRE(message);
    if (decode_result(*message, result) != WireStatus::ok || result.status == WireStatus::end_of_stream) continue;
    statuses[result.session].push_back(result.status);
    ++received;
  }
  return statuses;
}

void send_alternately(Camera& camera) {
  for (std::uint64_t id = 0; id < 5; ++id)
    for (const std::uint64_t session : {1u, 2u}) camera.send(id, session);
}

}  // namespace

TEST_CASE("two senders whose frames alternate are not one test: log, state, tally and exit code say so") {
  Bench bench;
  const auto server = bench.serve();
  WireContext context;
  ResultSource results(context, bench.results());
  REQUIRE(results.receive(30s));
  Camera camera(context, bench.frames());
  send_alternately(camera);
  const std::vector<WireStatus> ok(5, WireStatus::ok);
  CHECK(receive(results, 10) == Statuses{{1, ok}, {2, ok}});
  for (const std::uint64_t session : {1u, 2u}) camera.end(5, session);
  WireState state;
  CHECK(eventually([&] {
    const auto message = results.receive(30s);
    return message && decode_state(*message, state) == WireStatus::ok && state.counters.interleaved == 8;
  }));
  CHECK(
      eventually([&] { return contains(text_of(bench.file("serve.err")), "frames of different senders alternate"); }));
  CHECK(stop(*server) == 1);
  const Json tally = Json::parse(text_of(bench.file("serve.out")));
  CHECK(tally["interleaved"] == 8);
  CHECK(tally["matched"] == 10);
}

// Regression: only returns while the other sender's test was still running were counted.
TEST_CASE("a short complete test within that of another sender divides it") {
  Bench bench;
  const auto server = bench.serve();
  WireContext context;
  Camera camera(context, bench.frames());
  for (std::uint64_t id = 0; id < 5; ++id) camera.send(id, 1);
  camera.send(0, 2);
  camera.end(1, 2);
  for (std::uint64_t id = 5; id < 10; ++id) camera.send(id, 1);
  camera.end(10, 1);
  camera.send(0, 3);
  camera.end(1, 3);
  REQUIRE(eventually([&] {
    return contains(text_of(bench.file("serve.err")), "end of stream before frame 1 of session 0000000000000003");
  }));
  CHECK(stop(*server) == 1);
  CHECK(Json::parse(text_of(bench.file("serve.out")))["interleaved"] == 1);
}

TEST_CASE("a recording of two senders whose frames alternate is not one test, with and without a matcher") {
  for (const bool alone : {false, true}) {
    CAPTURE(alone);
    Bench bench;
    const auto program = bench.record_run(alone);
    WireContext context;
    Camera camera(context, bench.frames());
    send_alternately(camera);
    for (const std::uint64_t session : {1u, 2u}) camera.end(5, session);
    CHECK(stop(*program) == 1);
    const Json report = bench.inspect("run.mcap", 1);
    CHECK(report["interleaved"] == 8);
    CHECK(report["holds_all_that_came"] == true);
    CHECK(report["flaws"] ==
          Json{"the frames of different senders alternate (8 returns to an earlier one): they are not one test"});
    if (alone) CHECK(Json::parse(text_of(bench.file("record.out")))["interleaved"] == 8);
  }
}

TEST_CASE("with --one-sender the frames of a second one are dropped until the first one says goodbye") {
  Bench bench;
  const auto server = bench.serve({"--one-sender", "--record", bench.file("run.mcap")});
  WireContext context;
  ResultSource results(context, bench.results());
  REQUIRE(results.receive(30s));
  Camera camera(context, bench.frames());
  send_alternately(camera);
  const Statuses alternating = receive(results, 10);
  CHECK(alternating == Statuses{{1, std::vector(5, WireStatus::ok)}, {2, std::vector(5, WireStatus::other_sender)}});
  camera.end(5, 1);
  camera.send(5, 2);
  camera.end(6, 2);
  CHECK(receive(results, 1) == Statuses{{2, {WireStatus::ok}}});
  CHECK(eventually(
      [&] { return contains(text_of(bench.file("serve.err")), "other_sender: the test of another sender"); }));
  CHECK(stop(*server) == 1);
  const Json tally = Json::parse(text_of(bench.file("serve.out")));
  CHECK(tally["interleaved"] == 0);
  CHECK(tally["dropped_by_reason"]["other_sender"] == 5);
  CHECK(tally["adds_up"] == true);
  CHECK(bench.inspect("run.mcap", 0)["unanswered"] == 0);
  CHECK(bench.replay("run.mcap --model " LBEA_MODEL " --against").exit_code == 0);
}

// Regression: the test belonged to the sender of one damaged frame, and a dropped frame triggered the recording.
TEST_CASE("with --one-sender, rejected and dropped frames neither own the test nor trigger the recording") {
  Bench bench;
  const auto server = bench.serve(
      {"--one-sender", "--record", bench.file("run.mcap"), "--record-window", "60:60", "--trigger-ns", "1500"});
  WireContext context;
  ResultSource results(context, bench.results());
  REQUIRE(results.receive(30s));
  Camera camera(context, bench.frames());
  const std::vector<lbea::Point> too_many(200'000);
  camera.send_bytes(camera.encoder().frame({700, 2000, too_many}, 2));
  for (std::uint64_t id = 0; id < 5; ++id) camera.send(id, 1);
  camera.send(701, 2);  // captured after the trigger
  CHECK(receive(results, 7) ==
        Statuses{{1, std::vector(5, WireStatus::ok)}, {2, {WireStatus::too_many_points, WireStatus::other_sender}}});
  std::this_thread::sleep_for(200ms);
  CHECK_FALSE(contains(text_of(bench.file("serve.err")), "recording: triggered"));
  camera.send(600, 1);
  CHECK(eventually([&] { return contains(text_of(bench.file("serve.err")), "recording: triggered"); }));
  static_cast<void>(stop(*server));
}

// Regression: the end of any stream ended the evaluation, and the path continued from one sender to the next.
TEST_CASE("lbea-eval live ends with the sender that it evaluates, and reports a restarted one") {
  Bench bench;
  const auto server = bench.serve({"--method", "fit", "--pose", rail_pose});
  const auto evaluation =
      bench.start({LBEA_EVAL, "live", LBEA_MODEL, "--results", bench.results(), "--json"}, "eval", "lbea-eval: ready");
  WireContext context;
  Camera camera(context, bench.frames());
  camera.look_from(rail_pose);
  for (std::uint64_t id = 0; id < 5; ++id) camera.send(id, 1);
  camera.end(0, 9);  // of a sender without frames
  for (std::uint64_t id = 0; id < 4; ++id) camera.send(id, 2);
  camera.end(5, 1);  // of the sender before the restart
  camera.send(4, 2);
  camera.end(5, 2);
  CHECK(evaluation->wait() == 0);
  const Json report = Json::parse(text_of(bench.file("eval.out")));
  CHECK(report["complete"] == true);
  CHECK(report["sessions"] == 2);
  REQUIRE(report["frames"].size() == 10);
  for (std::size_t i = 0; i < 10; ++i) CHECK(report["frames"][i].contains("path") == (i >= 5));
  static_cast<void>(stop(*server));
}
