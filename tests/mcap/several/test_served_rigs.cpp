// lbea-serve with two rigs: one answer, whatever one of them does; recorded and matched again.
#include "tests/mcap/several/rig_bench.hpp"

#include <functional>
#include <map>

using namespace lbea::test;

TEST_CASE("two rigs: one result per capture; the recording is complete and gives the same results to the bit") {
  Rigs rigs;
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 2);
  const std::int64_t impact_ns = wall_clock_ns();
  for (std::size_t step = 0; step < states; ++step) {
    const std::int64_t stamp_ns = impact_ns + static_cast<std::int64_t>(step) * between_states_ns;
    left.send(clouds()[step], stamp_ns);
    right.send(clouds()[step], stamp_ns + 50'000);
    const WireResult result = rigs.next_of(step);
    CHECK(used(result) == Names{"left", "right"});
    CHECK(result.verdict != WireVerdict::no_simulation_fits);
    CHECK(result.session == ~std::uint64_t{1});
    CHECK(result.frame_id == step);
  }
  left.end();
  right.end();
  rigs.receive_end();
  CHECK(stop(*rigs.server) == 0);
  const Json tally = Json::parse(text_of(rigs.bench.file("serve.out")));
  CHECK(tally["matched"] == 2 * states);
  for (const char* rig : {"left", "right"}) {
    CHECK(tally["rigs"][rig]["matched"] == states);
    CHECK(tally["rigs"][rig]["adds_up"] == true);
  }
  const Json audit = rigs.bench.inspect("run.mcap", 0);
  CHECK(audit["sessions"].size() == 2);
  CHECK(audit["settings"]["rigs"][1]["name"] == "right");
  const Outcome replay = rigs.bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(replay.err);
  CHECK(replay.exit_code == 0);
  CHECK(Json::parse(replay.out)["same"] == states);
  const Outcome threads = rigs.bench.replay("run.mcap --model " LBEA_MODEL " --against --json --threads 2");
  CHECK(threads.out == replay.out);
}

TEST_CASE("results go on whatever one rig does, and say which rigs they rest on") {
  Rigs rigs;
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 20);
  std::size_t step = 0;
  std::map<std::string, std::uint64_t> sent;
  std::int64_t stamp_ns = wall_clock_ns();
  const auto capture = [&](const std::function<void(std::int64_t)>& of_right) {
    left.send(clouds()[step], stamp_ns);
    of_right(stamp_ns);
    const WireResult result = rigs.next_of(sent["left"]++);
    CHECK(used(result).front() == "left");
    CHECK(result.verdict != WireVerdict::no_simulation_fits);
    CHECK(result.session == ~std::uint64_t{1});
    stamp_ns += 1000;
    return used(result);
  };
  const auto captures = [&](const std::string& what, const std::function<void(std::int64_t)>& of_right,
                            const Names& expected) {
    CAPTURE(what);
    REQUIRE(eventually([&] { return capture(of_right) == expected; }));  // a rig that returns is not waited for at once
    for (int i = 0; i < 2; ++i) {
      ++step;
      stamp_ns += between_states_ns;
      CAPTURE(step);
      CHECK(capture(of_right) == expected);
    }
  };
  const auto send_right = [&](const std::vector<lbea::Point>& points, std::int64_t at_ns) {
    right.send(points, at_ns);
    ++sent["right"];
  };
  const auto clear = [&](std::int64_t at_ns) { send_right(clouds()[step], at_ns); };
  const Names both{"left", "right"};
  captures("clear", clear, both);
  captures("killed", [](std::int64_t) {}, {"left"});
  right.restart();
  captures("restarted", clear, both);
  captures("another component", [&](std::int64_t at_ns) { send_right(other_component(), at_ns); }, {"left"});
  captures("clear again", clear, both);
  left.end();
  right.end();
  rigs.receive_end();
  stop(*rigs.server);
  const Json tally = Json::parse(text_of(rigs.bench.file("serve.out")));
  for (const char* rig : {"left", "right"}) {
    CHECK(tally["rigs"][rig]["captured"] == sent[rig]);
    CHECK(tally["rigs"][rig]["adds_up"] == true);
  }
  CHECK(tally["rigs"]["left"]["matched"] == sent["left"]);
  const Outcome replay = rigs.bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(replay.err);
  CHECK(replay.exit_code == 0);
  CHECK(Json::parse(replay.out)["different"] == 0);
}

// The frames of different times were fitted together for the whole test.
TEST_CASE("a rig whose clock is 3 ms ahead is found by the impact; then captures are of one time, also in the replay") {
  Rigs rigs;
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 2);
  constexpr std::int64_t ahead_ns = 4 * between_states_ns;
  constexpr std::size_t before = 6;  // frames before the impact
  const std::int64_t begin_ns = wall_clock_ns();
  WireResult result;
  for (std::size_t i = 0; i < before + states; ++i) {
    const std::int64_t stamp_ns = begin_ns + static_cast<std::int64_t>(i) * between_states_ns;
    const auto& points = clouds()[i < before ? 0 : i - before];
    left.send(points, stamp_ns);
    right.send(points, stamp_ns + ahead_ns);
    result = rigs.next_of(i);
  }
  CHECK(used(result) == Names{"left", "right"});
  CHECK(result.rigs[1].frame_id == result.rigs[0].frame_id);
  CHECK(std::abs(result.rigs[1].clock_correction_ns + ahead_ns) < between_states_ns / 2);
  CHECK(result.rigs[0].clock_correction_ns == 0);
  left.end();
  right.end();
  rigs.receive_end();
  CHECK(stop(*rigs.server) == 0);
  CHECK(text_of(rigs.bench.file("serve.err")).find("rig right: by the impact, its clock is") != std::string::npos);
  const Outcome replay = rigs.bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(replay.err);
  CHECK(replay.exit_code == 0);
}

// Regression: the replay took the last cloud of an id.
TEST_CASE("a repeated id of one rig changes neither results nor their replay") {
  Rigs rigs;
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 2);
  for (RigCamera* camera : {&left, &right}) camera->say_hello();
  const std::int64_t impact_ns = wall_clock_ns();
  for (std::size_t step = 0; step < 5; ++step) {
    const std::int64_t stamp_ns = impact_ns + static_cast<std::int64_t>(step) * between_states_ns;
    left.send(clouds()[step], stamp_ns);
    left.repeat_id(other_component(), stamp_ns);
    right.send(clouds()[step], stamp_ns);
    CHECK(used(rigs.next_of(step)) == Names{"left", "right"});
  }
  left.end();
  right.end();
  rigs.receive_end();
  CHECK(stop(*rigs.server) == 0);
  const Json tally = Json::parse(text_of(rigs.bench.file("serve.out")));
  CHECK(tally["rigs"]["left"]["rejected_by_reason"]["duplicate"] == 5);
  const std::string log = text_of(rigs.bench.file("serve.err"));
  CHECK(log.find("rig left: frame 0: duplicate: ") != std::string::npos);
  CHECK(log.find("rig right: end of stream before frame 5") != std::string::npos);
  const Outcome replay = rigs.bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(replay.err);
  CHECK(replay.exit_code == 0);
  CHECK(Json::parse(replay.out)["same"] == 5);
}

// Regression: a capture of which one frame was before the window held up all others.
TEST_CASE("a recorded window of two rigs is matched again") {
  Rigs rigs({"--record-window", "0.02:30"});
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 2);
  const std::int64_t impact_ns = wall_clock_ns();
  for (std::size_t step = 0; step < states; ++step) {
    const std::int64_t stamp_ns = impact_ns + static_cast<std::int64_t>(step) * between_states_ns;
    left.send(clouds()[step], stamp_ns);
    std::this_thread::sleep_for(5ms);
    right.send(clouds()[step], stamp_ns);
    static_cast<void>(rigs.next_of(step));
    if (step == 10) rigs.server->signal(SIGUSR1);
  }
  left.end();
  right.end();
  rigs.receive_end();
  stop(*rigs.server);
  const Outcome replay = rigs.bench.replay("run.mcap --model " LBEA_MODEL " --json");
  CAPTURE(replay.err);
  CHECK(replay.exit_code == 0);
  CHECK(std::ranges::count(replay.out, '\n') >= 10);
}

TEST_CASE("rigs are refused in a sentence when names, poses or methods do not fit") {
  Bench bench;
  const auto refusal = [&](const std::string& arguments) {
    const Outcome outcome =
        run_program(LBEA_SERVE " " LBEA_MODEL " --results ipc://r " + arguments, bench.folder.path());
    CHECK(outcome.exit_code == 2);
    return outcome.err;
  };
  CHECK(contains(refusal("--frames ipc://a --frames ipc://b"), "give NAME=ENDPOINT"));
  CHECK(contains(refusal("--frames a=ipc://a --frames a=ipc://b"), "the name a is given to two rigs"));
  CHECK(contains(refusal("--frames a=ipc://a --frames b=ipc://a"), "--frames a and --frames b are both \"ipc://a\""));
  CHECK(contains(refusal("--frames a=ipc://a --frames b=ipc://b --pose c=" + rail_pose),
                 "the name of a rig of --frames"));
  CHECK(
      contains(refusal("--frames a=ipc://a --frames b=ipc://b --pose " + rail_pose), "the name of a rig of --frames"));
  CHECK(contains(refusal("--frames a=ipc://a --frames b=ipc://b --pose a=none.json"), "none.json is not a file"));
  CHECK(contains(refusal("--frames a=ipc://a --frames b=ipc://b --method lbea"), "matched by --method fit"));
  CHECK(contains(refusal("--frames a=ipc://a --frames b=ipc://b --clock-offset-ns a=1.5"), "not a whole number"));
  CHECK(contains(refusal("--frames ipc://a --clock-offset-ns 5"), "needs several rigs"));
}
