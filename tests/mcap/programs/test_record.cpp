// lbea-record alone: the test acts as sender and as matcher.
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/support/program.hpp"
#include "tests/wire/wire_support.hpp"
#include "tools/record/forwarder.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <random>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::contains;
using lbea::test::eventually;
using lbea::test::text_of;
using Json = nlohmann::json;

namespace {

constexpr std::uint64_t sender_session = 7;

/// A recorder between a sender and a matcher.
class Rig {
 public:
  explicit Rig(const test::TemporaryFolder& folder, std::vector<std::string> more = {}) : folder_(folder) {
    std::vector<std::string> words{LBEA_RECORD, file("run.mcap"), "--frames", at("rig"), "--record-memory",
                                   "16",        "--json"};
    words.insert(words.end(), more.begin(), more.end());
    recorder_ = std::make_unique<test::Process>(words, file("out"), file("err"));
    REQUIRE_MESSAGE(eventually([&] { return contains(log(), "ready: frames on"); }), log());
    sink_.emplace(context_, at("rig"));
    REQUIRE(sink_->wait_ready(30s));
  }
  void send(std::uint64_t id, std::size_t points = 20) {
    const std::vector<Point> cloud(points, {1, 2, 3});
    REQUIRE(sink_->send(encoder_.frame({id, static_cast<std::int64_t>(1000 + id), cloud}, sender_session), 30s));
  }
  void send_bytes(Message message) { REQUIRE(sink_->send(message, 30s)); }
  void say(ControlKind kind, std::uint64_t next_id, std::uint64_t withheld = 0) {
    REQUIRE(sink_->tell(encoder_.control({sender_session, kind, next_id, withheld}), 30s));
  }
  void end(std::uint64_t next_id) { send_bytes(encoder_.end_of_stream(sender_session, next_id)); }
  /// Interrupts it after it has received everything; returns its exit code.
  int stop() {
    REQUIRE(sink_->flush(30s) == 0);
    std::this_thread::sleep_for(200ms);
    recorder_->signal(SIGINT);
    return recorder_->wait();
  }
  [[nodiscard]] Json tally() const { return Json::parse(text_of(file("out"))); }
  [[nodiscard]] std::string log() const { return text_of(file("err")); }
  [[nodiscard]] Json inspect() const {
    const test::Outcome outcome = test::run_program(LBEA_INSPECT " run.mcap --json", folder_.path());
    Json report = Json::parse(outcome.out);
    CHECK(report["complete"] == (outcome.exit_code == 0));
    return report;
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_ / name).string(); }
  [[nodiscard]] std::string at(const std::string& name) const { return "ipc://" + file(name); }
  WireContext& context() { return context_; }

 private:
  const test::TemporaryFolder& folder_;
  WireContext context_;
  std::unique_ptr<test::Process> recorder_;
  std::optional<FrameSink> sink_;
  Encoder encoder_;
};

/// Acts as the matcher: receives until a sender has ended.
struct StandIn {
  StandIn(WireContext& context, const std::string& endpoint, const ServerAccess& access = {})
      : source(context, endpoint, {}, access) {}
  bool hears_the_end() {
    return eventually([&] {
      if (const auto message = source.receive(10ms)) take(*message);
      const auto senders = ids.senders({}, 1h);
      return std::ranges::find(senders, SenderCondition::ended, &WireSender::condition) != senders.end();
    });
  }
  void take(Message message) {
    Control control;
    const WireStatus status = decoder.open(message);
    if (decode_control(message, control) == WireStatus::ok) ids.report(control);
    if (status == WireStatus::ok) ids.observe(decoder.header().session, decoder.header().id);
    if (status == WireStatus::end_of_stream)
      ids.report({decoder.header().session, ControlKind::goodbye, decoder.header().id, 0});
  }
  FrameSource source;
  FrameDecoder decoder;
  IdTracker ids;
};

}  // namespace

// Regression: the receiving thread waited two seconds for the matcher with each control message, so the sender found no
// room.
TEST_CASE("recording does not wait for an absent matcher; once it starts it is informed of all captures") {
  const test::TemporaryFolder folder;
  Rig rig(folder, {"--forward", "ipc://" + (folder / "frames").string()});
  rig.say(ControlKind::hello, 0);
  for (std::uint64_t id = 0; id < 200; ++id) {
    if (id % 10 == 0) rig.say(ControlKind::heartbeat, id);
    rig.send(id);
  }
  rig.say(ControlKind::heartbeat, 205, 5);
  rig.end(205);
  CHECK(eventually([&] { return contains(rig.log(), "end of stream before frame 205"); }));
  StandIn matcher(rig.context(), rig.at("frames"));
  CHECK(matcher.hears_the_end());
  CHECK(matcher.ids.senders({}, 1h) ==
        std::vector<WireSender>{{sender_session, 0, 205, 0, 200, 5, SenderCondition::ended}});
  CHECK(rig.stop() == 1);
  const Json tally = rig.tally();
  CHECK(tally["recorded"] == 200);
  CHECK(tally["refused"] == 200);
  CHECK(tally["missed"] == 5);
  CHECK(tally["withheld"] == 5);
  CHECK(rig.inspect()["frames"] == 200);
  CHECK(rig.inspect()["missing"] == 5);
  CHECK(contains(rig.log(), "frame 0: refused"));
  CHECK(contains(rig.log(), "the matcher did not get 200 of 200 frames; they"));
}

TEST_CASE("the control messages kept for a matcher give the same counters as all of them") {
  std::mt19937 random(11);
  std::size_t most = 0;
  for (int run = 0; run < 2000; ++run) {
    IdTracker told_all, told_kept;
    PendingControls pending;
    std::array<std::uint64_t, 3> next{}, withheld{};
    const auto say = [&](std::uint64_t of, ControlKind kind, bool ends_stream) {
      const Control control{of, kind, next[of], ends_stream ? 0 : std::exchange(withheld[of], 0)};
      told_all.report(control);
      pending.add({control, ends_stream});
    };
    if (random() % 2 == 0)  // one session is known already
      for (IdTracker* ids : {&told_all, &told_kept}) ids->observe(1, next[1]);
    next[1] += random() % 2;
    for (int step = 0; step < 60; ++step) {
      const std::uint64_t of = random() % 3;
      const auto what = random() % 10;
      if (what == 0) say(of, static_cast<ControlKind>(random() % 3), false);
      if (what == 1) say(of, ControlKind::goodbye, true);
      if (what >= 8) {
        ++next[of];
        ++withheld[of];
      } else if (what > 1) {  // a frame, which finds no room at the matcher; of withheld ones the receiver hears first
        if (withheld[of] > 0) say(of, ControlKind::heartbeat, false);
        ++next[of];
      }
    }
    most = std::max(most, pending.size());
    for (; !pending.empty(); pending.pop()) told_kept.report(pending.front().control);
    const auto by_session = [](const IdTracker& ids) {
      auto senders = ids.senders({}, 1h);
      std::ranges::sort(senders, {}, &WireSender::session);
      return senders;
    };
    CHECK(by_session(told_kept) == by_session(told_all));
  }
  CHECK(most > 3);
  PendingControls pending;
  for (std::uint64_t i = 0; i < 10'000; ++i) pending.add({{1, ControlKind::heartbeat, i, 0}});
  CHECK(pending.size() == 2);
  for (std::uint64_t i = 0; i < 10'000; ++i) pending.add({{i, ControlKind::heartbeat, 5, 1}});
  CHECK(pending.size() == PendingControls::max_size);
}

TEST_CASE("a lost or refused frame is logged with its number and counted in the final summary of missing frames") {
  const test::TemporaryFolder folder;
  Rig rig(folder);
  rig.say(ControlKind::hello, 0);
  for (const std::uint64_t id : {0u, 1u, 4u}) rig.send(id);
  rig.say(ControlKind::goodbye, 12, 3);
  rig.send_bytes(std::as_bytes(std::span("no frame at all")));
  CHECK(rig.stop() == 1);
  for (const char* line : {"frames 2 to 3: missed:", "frames 9 to 11: withheld:", "a message: wrong_kind:",
                           "frame 0: from session 0000000000000007",
                           "6 captures that never arrived (missed), 3 captures without room at their sender "
                           "(withheld), 1 messages without"})
    CHECK_MESSAGE(contains(rig.log(), line), rig.log());
  const Json tally = rig.tally();
  CHECK(tally["missed"] == 9);
  CHECK(tally["withheld"] == 3);
  CHECK(tally["damaged"] == 1);
  const Json report =
      rig.inspect();  // the recording itself tells of what came neither between its frames nor after them
  CHECK(report["complete"] == false);
  CHECK(report["missing"] == 9);
  CHECK(report["sessions"][0]["ended"] == true);
}

TEST_CASE("frames with too many points for a matcher are recorded, counted and logged") {
  const test::TemporaryFolder folder;
  Rig rig(folder, {"--max-points", "10"});
  rig.send(0, 10);
  rig.send(1, 11);
  rig.end(2);
  CHECK(rig.stop() == 0);
  CHECK(rig.tally()["recorded"] == 2);
  CHECK(rig.tally()["too_many_points"] == 1);
  CHECK(contains(rig.log(), "frame 1: too_many_points"));
  CHECK(rig.inspect()["frames"] == 2);
}

TEST_CASE("a matcher with keys receives frames, and its results are recorded") {
  const test::TemporaryFolder folder;
  const CurveKeyPair matcher_keys = generate_key_pair(), recorder_keys = generate_key_pair();
  write_key_pair(folder / "matcher", matcher_keys, "matcher");
  write_key_pair(folder / "recorder", recorder_keys, "recorder");
  const ServerAccess access{matcher_keys, {{recorder_keys.public_key, "recorder"}}};
  for (const bool knows_keys : {true, false}) {
    CAPTURE(knows_keys);
    const test::TemporaryFolder run;
    WireContext context;
    StandIn matcher(context, "tcp://127.0.0.1:*", access);
    ResultSink results(context, "tcp://127.0.0.1:*", results_held, access);
    std::vector<std::string> words{"--forward", matcher.source.endpoint(), "--results", results.endpoint()};
    if (knows_keys)
      words.insert(words.end(), {"--server-key", (folder / "matcher.pub").string(), "--client-key",
                                 (folder / "recorder.key").string()});
    Rig rig(run, words);
    if (knows_keys) REQUIRE(eventually([&] { return matcher.source.peers().peers == 1 && results.has_newcomer(); }));
    rig.send(0);
    rig.end(1);
    if (knows_keys) CHECK(matcher.hears_the_end());
    Encoder encoder;
    WireState state;
    state.sequence = 1;
    state.method = "lbea";
    state.model.file = "rail.lbea";
    state.model.checksum = 0xabc;
    CHECK(results.send(encoder.state(state)));
    CHECK(rig.stop() == (knows_keys ? 0 : 1));
    CHECK(rig.tally()["forwarded"] == (knows_keys ? 1 : 0));
    const Json report = rig.inspect();
    CHECK(report["states"] == (knows_keys ? 1 : 0));
    CHECK(report["settings"]["model_file"] == (knows_keys ? "rail.lbea" : ""));
    CHECK(report["settings"]["method"] == (knows_keys ? "lbea" : ""));
  }
}

TEST_CASE("an argument left empty by an unset variable is wrong usage") {
  const test::TemporaryFolder folder;
  const auto is_refused = [&](const std::string& arguments, const std::string& sentence) {
    const test::Outcome outcome = test::run_program(LBEA_RECORD " " + arguments, folder.path());
    CAPTURE(arguments);
    CAPTURE(outcome.err);
    CHECK(outcome.exit_code == 2);
    CHECK(contains(outcome.err + outcome.out, sentence));
  };
  is_refused("'' --frames ipc://rig", "FILE: is empty");
  is_refused("run.mcap --frames ''", "--frames: is empty");
  is_refused("run.mcap --frames ipc://rig --forward ''", "--forward: is empty");
  is_refused("run.mcap --frames ipc://rig --results ''", "--results: is empty");
  is_refused("run.mcap --frames ipc://rig --server-key matcher.pub", "neither is given");
  is_refused("run.mcap --frames ipc://rig --client-key own.key", "--server-key");
  CHECK(test::files_in(folder.path()) == 0);
}
