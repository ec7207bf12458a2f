// lbea-replay --to with a recording of two rigs: a matcher gets what the recorded one got, and answers the same.
#include "tests/mcap/several/rig_bench.hpp"

using namespace lbea::test;

namespace {

constexpr auto between_frames = 10ms;

/// All that a matcher publishes about captures until `tests` tests have ended, without times, counters and numbers of
/// messages.
std::vector<std::vector<std::byte>> answers(Rigs& rigs, int tests) {
  std::vector<std::vector<std::byte>> answers;
  Encoder encoder;
  while (tests > 0) {
    WireResult result =
        rigs.next([](const WireResult& r) { return !r.rigs.empty() || r.session == ~std::uint64_t{1}; });
    if (result.status == WireStatus::end_of_stream) --tests;
    result.sequence = 0;
    result.publish_ns = result.receive_ns = 0;
    result.elapsed_ns = {};
    result.counters = {};
    const auto bytes = encoder.result(result);
    answers.emplace_back(bytes.begin(), bytes.end());
  }
  return answers;
}

/// Two tests; in the first one, the right rig misses a frame and sends another one twice. Waits for neither.
std::vector<std::vector<std::byte>> record_two_tests(Rigs& rigs) {
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 2);
  const std::int64_t begin_ns = wall_clock_ns();
  std::vector<std::vector<std::byte>> expected;
  for (int test = 0; test < 2; ++test) {
    for (std::size_t step = 0; step < states; ++step) {
      const std::int64_t stamp_ns =
          begin_ns + test * 1'000'000'000 + static_cast<std::int64_t>(step) * between_states_ns;
      left.send(clouds()[step], stamp_ns);
      if (step != 7 || test == 1) right.send(clouds()[step], stamp_ns + 50'000);
      if (step == 9 && test == 0) right.repeat_id(other_component(), stamp_ns);
      std::this_thread::sleep_for(between_frames);
    }
    left.end();
    right.end();
    const auto of_test = answers(rigs, 1);
    expected.insert(expected.end(), of_test.begin(), of_test.end());
  }
  return expected;
}

std::string to_both(Rigs& rigs) { return " --to left=" + rigs.left() + " --to right=" + rigs.right(); }

}  // namespace

TEST_CASE("a recording of two rigs, sent to another matcher, gives the same bits; each rig has its account") {
  Rigs recorded;
  const auto expected = record_two_tests(recorded);
  stop(*recorded.server);
  const Json first = Json::parse(text_of(recorded.bench.file("serve.out")));
  Rigs repeated;
  const Outcome replay = repeated.bench.replay(recorded.bench.file("run.mcap") + to_both(repeated) + " --results " +
                                               repeated.bench.results() + " --json --fast");
  CAPTURE(replay.err);
  CAPTURE(replay.out);
  CHECK(replay.exit_code == 0);
  CHECK(answers(repeated, 2) == expected);
  stop(*repeated.server);
  const Json tally = Json::parse(replay.out), second = Json::parse(text_of(repeated.bench.file("serve.out")));
  CHECK(tally["sent"] == 4 * states);  // one less, and one twice
  for (const char* rig : {"left", "right"}) {
    CAPTURE(rig);
    CHECK(tally["rigs"][rig]["sent"] == 2 * states);
    CHECK(tally["rigs"][rig]["refused"] == 0);
    CHECK(tally["rigs"][rig]["left"] == 0);
    CHECK(second["rigs"][rig] == first["rigs"][rig]);
  }
  CHECK(tally["rigs"]["left"]["received"] == 2 * states);
  CHECK(tally["rigs"]["right"]["received"] == 2 * states - 1);  // a repeated id is not another frame
  const Outcome against = repeated.bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(against.err);
  CHECK(against.exit_code == 0);
  CHECK(Json::parse(against.out)["same"] == expected.size() - 2);
  const Json audit = repeated.bench.inspect("run.mcap", 0);
  CHECK(audit["sessions"].size() == 2);
}

// Without --fast, a frame without room is refused, as a camera's would be.
TEST_CASE("frames of two rigs are sent no sooner than they were recorded, in each round, and all are accounted for") {
  Rigs recorded;
  static_cast<void>(record_two_tests(recorded));
  stop(*recorded.server);
  Rigs repeated;
  const auto begin = std::chrono::steady_clock::now();
  const Outcome replay =
      repeated.bench.replay(recorded.bench.file("run.mcap") + to_both(repeated) + " --speed 2 --loop 2");
  // Two rounds at twice the pace take the recorded time: at least that of the second test, whose first frame was sent
  // after the matcher had those of the first one.
  CHECK(std::chrono::steady_clock::now() - begin >= (states - 1) * between_frames);
  CAPTURE(replay.err);
  CAPTURE(replay.out);
  stop(*repeated.server);
  const Json tally = Json::parse(text_of(repeated.bench.file("serve.out")));
  const std::string all = std::to_string(4 * states);
  for (const std::string rig : {"left", "right"}) {
    CAPTURE(rig);
    CHECK(contains(replay.out, "\n" + rig + ": frames " + all + " = sent "));
    CHECK(tally["rigs"][rig]["captured"] <= 4 * states);
    CHECK(tally["rigs"][rig]["captured"] > 0);
    CHECK(tally["rigs"][rig]["adds_up"] == true);
  }
}

// Only the pose of the rig that is named changes.
TEST_CASE("a recording of two rigs is matched with another pose of one of them") {
  Rigs rigs;
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 2);
  const std::int64_t begin_ns = wall_clock_ns();
  for (std::size_t step = 0; step < 4; ++step) {
    const std::int64_t stamp_ns = begin_ns + static_cast<std::int64_t>(step) * between_states_ns;
    left.send(clouds()[step], stamp_ns);
    right.send(clouds()[step], stamp_ns);
    CHECK(used(rigs.next_of(step)) == Names{"left", "right"});
  }
  stop(*rigs.server);
  // Turned by 180 degrees about the vertical axis through the rail's middle: the frame shows no simulation there.
  Json sensor = Json::parse(text_of(rail_pose));
  for (Json* T : {&sensor["T_reference_sensor"], &sensor["sensor"]["T_reference_right"]})
    for (const std::size_t row : {0u, 1u})
      for (std::size_t column = 0; column < 4; ++column) {
        Json& value = (*T)[row][column];
        value = (row == 0 && column == 3 ? 400.0 : 0.0) - value.get<double>();
      }
  std::ofstream(rigs.bench.file("turned.json")) << sensor;
  const auto used_of_last = [&](const std::string& poses) {
    const Outcome replay = rigs.bench.replay("run.mcap --model " LBEA_MODEL " --json" + poses);
    CAPTURE(replay.err);
    REQUIRE(replay.exit_code == 0);
    const std::size_t before = replay.out.rfind('\n', replay.out.size() - 2);  // the end of the line before the last
    const Json last = Json::parse(replay.out.substr(before + 1));
    Names names;
    for (const Json& rig : last["rigs"])
      if (rig["is_used"] == true) names.push_back(rig["rig"]);
    return names;
  };
  CHECK(used_of_last("") == Names{"left", "right"});
  CHECK(used_of_last(" --pose right=" + rail_pose) == Names{"left", "right"});
  CHECK(used_of_last(" --pose right=turned.json") == Names{"left"});
  CHECK(used_of_last(" --pose left=turned.json") == Names{"right"});
}

TEST_CASE("endpoints that are not those of the recorded rigs are refused in a sentence") {
  Rigs rigs;
  RigCamera left(rigs.context, rigs.left(), 1), right(rigs.context, rigs.right(), 2);
  left.send(clouds()[0], 1000);
  right.send(clouds()[0], 1000);
  static_cast<void>(rigs.next_of(0));
  stop(*rigs.server);
  const auto refusal = [&](const std::string& arguments, int exit_code) {
    const Outcome outcome = rigs.bench.replay("run.mcap " + arguments);
    CAPTURE(outcome.err);
    CHECK(outcome.exit_code == exit_code);
    return outcome.err;
  };
  CHECK(contains(refusal("--to ipc://a", 2), "with the name of a rig of the recording: left, right"));
  CHECK(contains(refusal("--to left=ipc://a", 2), "frames of rig right; give --to right=ENDPOINT too"));
  CHECK(contains(refusal("--to left= --to right=ipc://b", 2), "frames of rig left; give --to left=ENDPOINT too"));
  CHECK(contains(refusal("--to ''", 2), "--to"));
  CHECK(contains(refusal("--to left=ipc://a --to other=ipc://b", 2), "of the recording: left, right"));
  CHECK(contains(refusal("--to left=ipc://a --to left=ipc://b", 2), "--to is given twice for left"));
  CHECK(contains(refusal("--to left=ipc://a --to right=ipc://a", 2), "are both \"ipc://a\""));
  CHECK(contains(refusal("--to left=ipc://a --to right=ipc://b", 1), "start lbea-serve with --frames left=ipc://a"));

  const std::string model = "--model " LBEA_MODEL " ";
  CHECK(contains(refusal(model + "--pose " + rail_pose, 2), "of the recording: left, right"));
  CHECK(contains(refusal(model + "--pose other=" + rail_pose, 2), "of the recording: left, right"));
  CHECK(contains(refusal(model + "--pose left=none.json", 2), "none.json is not a file"));
  CHECK(contains(refusal(model + "--pose left=a.json --pose left=b.json", 2), "--pose is given twice for left"));
  CHECK(contains(refusal(model + "--no-pose --pose left=" + rail_pose, 2), "--pose"));

  Bench bench;
  record(bench, "one.mcap", 1);
  const Outcome outcome = bench.replay("one.mcap --to left=ipc://a --to right=ipc://b");
  CHECK(outcome.exit_code == 2);
  CHECK(contains(outcome.err, "frames of one rig; give one endpoint"));
  const Outcome named = bench.replay("one.mcap --to left=ipc://a");
  CHECK(named.exit_code == 2);
  CHECK(contains(named.err, "--to left=ipc://a: the recording has the frames of one rig; give --to ENDPOINT"));
}
