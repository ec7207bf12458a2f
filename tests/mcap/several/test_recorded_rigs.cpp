// lbea-record between two rigs and their matcher: one file, an account per rig, and no rig or matcher stops another.
#include "tests/mcap/several/rig_bench.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <thread>
#include <utility>

using namespace lbea::test;

namespace {

/// lbea-record in the folder of a bench; the cameras send to it.
class RigRecorder {
 public:
  RigRecorder(Bench& of, const std::vector<std::string>& more) : bench(of) {
    std::vector<std::string> words{LBEA_RECORD, bench.file("recorder.mcap"), "--frames", "left=" + left(),
                                   "--frames",  "right=" + right(),          "--json"};
    words.insert(words.end(), more.begin(), more.end());
    process = bench.start(words, "record", "ready: frames of left on " + left() + ", frames of right on " + right());
  }
  [[nodiscard]] std::string left() const { return "ipc://" + bench.file("rig-left"); }
  [[nodiscard]] std::string right() const { return "ipc://" + bench.file("rig-right"); }
  [[nodiscard]] Json tally() const { return Json::parse(text_of(bench.file("record.out"))); }
  [[nodiscard]] std::string log() const { return text_of(bench.file("record.err")); }
  Bench& bench;
  std::unique_ptr<Process> process;
};

std::vector<std::string> forwarded_to(const Rigs& rigs) {
  return {"--forward", "left=" + rigs.left(), "--forward", "right=" + rigs.right(), "--results", rigs.bench.results()};
}

const std::vector<std::string> both_poses{"--pose", "left=" + rail_pose, "--pose", "right=" + rail_pose};

}  // namespace

TEST_CASE("what lbea-record writes of two rigs is what lbea-serve writes: complete, replayed and sent again") {
  Rigs rigs;
  std::vector<std::string> words = forwarded_to(rigs);
  words.insert(words.end(), both_poses.begin(), both_poses.end());
  RigRecorder recorder(rigs.bench, words);
  RigCamera left(rigs.context, recorder.left(), 1), right(rigs.context, recorder.right(), 2);
  const std::int64_t impact_ns = wall_clock_ns();
  for (std::size_t step = 0; step < states; ++step) {
    const std::int64_t stamp_ns = impact_ns + static_cast<std::int64_t>(step) * between_states_ns;
    left.send(clouds()[step], stamp_ns);
    right.send(clouds()[step], stamp_ns + 50'000);
    if (step == 9) right.repeat_id(other_component(), stamp_ns);
    static_cast<void>(rigs.next_of(step));
  }
  left.end();
  right.end();
  rigs.receive_end();
  CHECK(stop(*recorder.process) == 0);
  stop(*rigs.server);
  const Json tally = recorder.tally();
  CHECK(tally["received"] == 2 * states + 1);
  CHECK(tally["recorded"] == 2 * states + 1);
  const std::map<std::string, std::size_t> sent_by{{"left", states}, {"right", states + 1}};  // an id was repeated
  for (const auto& entry : sent_by) {
    const auto& rig = entry.first;
    const std::size_t frames = entry.second;
    CAPTURE(rig);
    CHECK(tally["rigs"][rig]["received"] == frames);
    CHECK(tally["rigs"][rig]["forwarded"] == frames);
    CHECK(tally["rigs"][rig]["undelivered"] == 0);
  }
  const Json own = rigs.bench.inspect("recorder.mcap", 0), served = rigs.bench.inspect("run.mcap", 0);
  CHECK(own["sessions"] == served["sessions"]);
  CHECK(own["settings"]["rigs"] == served["settings"]["rigs"]);
  const auto frames_on = [](const Json& audit, const std::string& topic) {
    std::uint64_t messages = 0;
    for (const Json& channel : audit["channels"])
      if (channel["topic"] == topic) messages += channel["messages"].get<std::uint64_t>();
    return messages;
  };
  for (const auto& [rig, frames] : sent_by) {
    CHECK(frames_on(own, "/frames/" + rig) == frames);
    CHECK(frames_on(served, "/frames/" + rig) == frames);
  }
  const Outcome against = rigs.bench.replay("recorder.mcap --model " LBEA_MODEL " --against --json");
  CAPTURE(against.err);
  CHECK(against.exit_code == 0);
  CHECK(Json::parse(against.out)["same"] == states);

  Rigs again;
  const Outcome sent = again.bench.replay(rigs.bench.file("recorder.mcap") + " --to left=" + again.left() +
                                          " --to right=" + again.right() + " --fast --json");
  CAPTURE(sent.err);
  CHECK(sent.exit_code == 0);
  CHECK(Json::parse(sent.out)["rigs"]["right"]["sent"] == states + 1);
  again.receive_end();
  stop(*again.server);
  const Outcome repeated = again.bench.replay("run.mcap --model " LBEA_MODEL " --against --json");
  CHECK(Json::parse(repeated.out)["same"] == states);
}

TEST_CASE("a rig that is killed costs the other nothing, and is named; without poses, results cannot be compared") {
  Rigs rigs;
  RigRecorder recorder(rigs.bench, forwarded_to(rigs));
  RigCamera left(rigs.context, recorder.left(), 1);
  constexpr std::size_t until = 8;
  const std::int64_t impact_ns = wall_clock_ns();
  {
    RigCamera right(rigs.context, recorder.right(), 2);
    right.say_hello();
    for (std::size_t step = 0; step < until; ++step) {
      const std::int64_t stamp_ns = impact_ns + static_cast<std::int64_t>(step) * between_states_ns;
      left.send(clouds()[step], stamp_ns);
      right.send(clouds()[step], stamp_ns);
      CHECK(used(rigs.next_of(step)) == Names{"left", "right"});
    }
  }
  for (std::size_t step = until; step < states; ++step) {
    left.send(clouds()[step], impact_ns + static_cast<std::int64_t>(step) * between_states_ns);
    CHECK(used(rigs.next_of(step)) == Names{"left"});
  }
  left.end();
  CHECK(stop(*recorder.process) == 1);
  stop(*rigs.server);
  const Json tally = recorder.tally();
  CHECK(tally["rigs"]["left"]["received"] == states);
  CHECK(tally["rigs"]["left"]["silent"] == 0);
  CHECK(tally["rigs"]["right"]["received"] == until);
  CHECK(tally["rigs"]["right"]["silent"] == 1);
  CHECK(tally["recorded"] == states + until);
  CHECK(contains(recorder.log(), "recorder.mcap is incomplete; missing of rig right: 1 senders that stopped"));
  CHECK_FALSE(contains(recorder.log(), "missing of rig left"));
  CHECK(contains(recorder.log(), "rig right: frame 0: from session"));
  const Json audit = rigs.bench.inspect("recorder.mcap", 1);  // because of the sender without goodbye
  CHECK(audit["holds_all_that_came"] == true);
  CHECK(audit["missing"] == 0);
  CHECK(audit["unanswered"] == 0);
  const Outcome against = rigs.bench.replay("recorder.mcap --model " LBEA_MODEL " --against");
  CHECK(against.exit_code == 1);
  CHECK(contains(against.err, "does not contain the pose of rig left"));
  const auto refusal = [&](const std::string& more) {
    const Outcome outcome = rigs.bench.replay("recorder.mcap --model " LBEA_MODEL + more);
    CHECK(outcome.exit_code == 1);
    return outcome.err;
  };
  CHECK(contains(refusal(""), "does not contain the pose of rig left"));
  CHECK(contains(refusal(" --frames-alone"), "give --no-pose if lbea-serve had none"));
  CHECK(contains(refusal(" --pose left=" + rail_pose), "does not contain the pose of rig right"));
  const Outcome given = rigs.bench.replay(
      "recorder.mcap --model " LBEA_MODEL " --against --json --pose left=" + rail_pose + " --pose right=" + rail_pose);
  CAPTURE(given.err);
  CHECK(given.exit_code == 0);  // the same to the bit
  CHECK(Json::parse(given.out)["same"] == states);
  CHECK(contains(run_program(LBEA_INSPECT " recorder.mcap", rigs.bench.folder.path()).out,
                 "rig left, pose not recorded, clock offset 0 ns"));
}

TEST_CASE("two tests of two rigs, recorded without results, remain two tests when they are sent to a matcher") {
  Bench bench;
  RigRecorder recorder(bench, {});
  WireContext context;
  const std::int64_t begin_ns = wall_clock_ns();
  for (std::uint64_t test = 0; test < 2; ++test) {
    const std::int64_t test_ns = begin_ns + static_cast<std::int64_t>(test) * 1'000'000'000;
    RigCamera left(context, recorder.left(), 2 * test + 1), right(context, recorder.right(), 2 * test + 2);
    for (std::size_t step = 0; step < states; ++step) {
      const std::int64_t stamp_ns = test_ns + static_cast<std::int64_t>(step) * between_states_ns;
      left.send(clouds()[step], stamp_ns);
      right.send(clouds()[step], stamp_ns);
      std::this_thread::sleep_for(20ms);  // a pace at which lbea-serve can receive them again
    }
    left.end();
    right.end();
    for (std::uint64_t session : {2 * test + 1, 2 * test + 2})
      CHECK(eventually([&] {
        return contains(recorder.log(), "end of stream before frame " + std::to_string(states) +
                                            " of session 000000000000000" + std::to_string(session));
      }));
  }
  CHECK(stop(*recorder.process) == 0);
  CHECK_FALSE(contains(recorder.log(), "did not get"));
  const Outcome matched = bench.replay("recorder.mcap --no-pose --model " LBEA_MODEL);
  CHECK(matched.exit_code == 1);
  CHECK(contains(matched.err, "no results that say which were captured together"));

  for (const std::string pace : {" --fast", "", " --loop 2"}) {
    CAPTURE(pace);
    Rigs again;
    const Outcome sent = again.bench.replay(bench.file("recorder.mcap") + " --to left=" + again.left() +
                                            " --to right=" + again.right() + pace);
    CAPTURE(sent.err);
    CHECK(sent.exit_code == 0);
    CHECK(contains(sent.err, "start lbea-serve with a --wait-us") == (pace == " --fast"));
    const std::size_t tests = pace == " --loop 2" ? 4 : 2;
    std::vector<std::set<std::uint64_t>> sessions_of_tests;  // of the rigs' senders
    std::uint64_t captures = 0;                              // their session
    for (std::set<std::uint64_t> sessions; sessions_of_tests.size() < tests;) {
      const WireResult result =
          again.next([&](const WireResult& r) { return !r.rigs.empty() || r.session == captures; });
      if (!result.rigs.empty()) captures = result.session;
      for (const WireRigFrame& frame : result.rigs) sessions.insert(frame.session);
      if (result.status == WireStatus::end_of_stream) sessions_of_tests.push_back(std::exchange(sessions, {}));
    }
    std::set<std::uint64_t> all;
    for (const std::set<std::uint64_t>& sessions : sessions_of_tests) {
      CHECK(sessions.size() == 2);  // one of each rig
      all.insert(sessions.begin(), sessions.end());
    }
    CHECK(all.size() == 2 * tests);
  }
}

TEST_CASE("recording two rigs does not wait for an absent matcher; each rig's refused frames are counted") {
  Bench bench;
  RigRecorder recorder(bench, {"--forward", "left=ipc://" + bench.file("no-left"), "--forward",
                               "right=ipc://" + bench.file("no-right")});
  WireContext context;
  RigCamera left(context, recorder.left(), 1), right(context, recorder.right(), 2);
  for (std::int64_t i = 0; i < 60; ++i) {
    left.send({{1, 2, 3}}, 1000 + i);
    if (i % 2 == 0) right.send({{1, 2, 3}}, 1000 + i);
  }
  left.end();
  right.end();
  CHECK(eventually([&] { return contains(recorder.log(), "rig right: end of stream before frame 30"); }));
  CHECK(eventually([&] { return contains(recorder.log(), "rig left: end of stream before frame 60"); }));
  CHECK(stop(*recorder.process) == 1);
  const Json tally = recorder.tally();
  CHECK(tally["recorded"] == 90);
  CHECK(tally["rigs"]["left"]["refused"] == 60);
  CHECK(tally["rigs"]["right"]["refused"] == 30);
  CHECK(contains(recorder.log(), "the matcher did not get 60 of 60 frames of rig left; they are recorded"));
  CHECK(contains(recorder.log(), "the matcher did not get 30 of 30 frames of rig right; they are recorded"));
  CHECK(bench.inspect("recorder.mcap", 0)["frames"] == 90);
}

TEST_CASE("options of several rigs that do not fit together are refused in a sentence") {
  Bench bench;
  const auto refusal = [&](const std::string& arguments) {
    const Outcome outcome = run_program(LBEA_RECORD " run.mcap " + arguments, bench.folder.path());
    CAPTURE(arguments);
    CHECK(outcome.exit_code == 2);
    return outcome.err;
  };
  const std::string both = "--frames a=ipc://a --frames b=ipc://b ";
  CHECK(contains(refusal("--frames ipc://a --frames ipc://b"), "give NAME=ENDPOINT"));
  CHECK(contains(refusal("--frames a=ipc://a --frames a=ipc://b"), "the name a is given to two rigs"));
  CHECK(contains(refusal("--frames a=ipc://a --frames b=ipc://a"), "--frames a and --frames b are both \"ipc://a\""));
  CHECK(contains(refusal(both + "--forward ipc://c"), "--forward NAME=ENDPOINT with the name of a rig of --frames"));
  CHECK(contains(refusal(both + "--forward a=ipc://c"), "frames of rig b are not forwarded"));
  CHECK(contains(refusal(both + "--forward a=ipc://c --forward b=ipc://c"), "--forward a and --forward b are both"));
  CHECK(contains(refusal(both + "--forward a=ipc://c --forward b=ipc://a"), "--frames a and --forward b are both"));
  CHECK(contains(refusal(both + "--pose none.json"), "the name of a rig of --frames"));
  CHECK(contains(refusal(both + "--pose a=none.json"), "none.json is not a file"));
  CHECK(contains(refusal("--frames ipc://a --clock-offset-ns 5"), "needs several rigs"));
  CHECK(files_in(bench.folder.path()) == 0);
}
