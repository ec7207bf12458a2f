// Every capture of every sender gets exactly one status: with small and large queues, stalls on either side, senders
// that start and stop, messages over the size limit.
#include "tools/serve/reports.hpp"
#include "tools/shared/intake/handshake.hpp"

#include "tests/support/test_data.hpp"
#include "tests/wire/pipeline/fake_engine.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <cstdlib>
#include <map>
#include <random>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::eventually;
using lbea::test::FakeEngine;

namespace {

/// LBEA_CAPTURES=10000000 sets the number.
std::uint64_t wanted_captures() {
  if (const char* number = std::getenv("LBEA_CAPTURES")) return std::strtoull(number, nullptr, 10);
  return std::getenv("LBEA_LONG_TESTS") != nullptr ? 1'000'000 : 10'000;
}

/// The sender's own, independent count.
struct Captures {
  std::uint64_t session = 0, captured = 0, sent = 0;
};

/// Collects everything from the results socket.
class Listener {
 public:
  Listener(WireContext& context, const std::string& endpoint) : source_(context, endpoint, 2'000'000) {}
  ~Listener() { stop(); }
  void start() {
    REQUIRE(eventually([&] { return receive(10ms); }));
    thread_ = std::thread([this] {
      while (!stopping_ || receive(200ms)) receive(10ms);
    });
  }
  void stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }

  std::map<std::uint64_t, std::map<std::uint64_t, std::uint32_t>> results;  // by session and id: how many
  std::map<WireStatus, std::uint64_t> by_status;
  std::map<std::uint64_t, WireSender> senders;
  std::uint64_t unidentified = 0, lost = 0;  // lost: messages that this listener missed

 private:
  bool receive(std::chrono::milliseconds timeout) {
    const auto message = source_.receive(timeout);
    if (!message) return false;
    WireResult result;
    WireState state;
    std::uint64_t sequence = 0;
    if (decode_result(*message, result) == WireStatus::ok) {
      sequence = result.sequence;
      note(result);
    } else if (decode_state(*message, state) == WireStatus::ok) {
      sequence = state.sequence;
      for (const WireSender& sender : state.senders) senders[sender.session] = sender;
    }
    if (next_ > 0) lost += sequence - next_;
    next_ = sequence + 1;
    return true;
  }
  void note(const WireResult& result) {
    if (result.status == WireStatus::end_of_stream) return;
    ++by_status[result.status];
    if (result.session == 0) {
      ++unidentified;
    } else {
      ++results[result.session][result.frame_id];
    }
  }
  ResultSource source_;
  std::atomic<bool> stopping_{false};
  std::uint64_t next_ = 0;
  std::thread thread_;
};

PipelineConfig config(std::mt19937& random) {
  PipelineConfig config;
  config.limits.max_points = 100;
  config.limits.least_message_bytes = 0;
  config.limits.queued_messages = 1 + random() % 64;
  config.queue_slots = 1 + random() % 16;
  config.matchers = static_cast<std::uint32_t>(1 + random() % 3);
  config.state_interval = 20ms;
  return config;
}

/// A sender that does not wait, with bursts, pauses and some oversized messages; it ends with a goodbye.
Captures send_frames(WireContext& context, const std::string& endpoint, const std::string& results,
                     std::uint64_t session, std::uint64_t frames, std::uint32_t seed, std::size_t cap) {
  std::mt19937 random(seed);
  FrameSink sink(context, endpoint, 1 + random() % 64);
  Encoder encoder;
  std::vector<Point> points(20, Point{4, 0, 0});
  const std::vector<std::byte> oversized(cap + 1);
  std::uint64_t withheld = 0;
  Captures captures{session, 0, 0};
  const auto tell = [&](ControlKind kind, std::uint64_t next_id, std::chrono::milliseconds timeout) {
    if (!sink.tell(encoder.control({session, kind, next_id, withheld}), timeout)) return false;
    withheld = 0;
    return true;
  };
  Handshake handshake(sink, ResultSource(context, results, 2'000'000), session);
  CHECK(sink.wait_ready(30s));
  CHECK(handshake.begin([] { return false; }));
  for (std::uint64_t id = 0; id < frames; ++id) {
    ++captures.captured;
    if (random() % 2000 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 20'000));
    if (random() % 8 == 0) std::this_thread::sleep_for(std::chrono::microseconds(random() % 200));
    const bool is_oversized = random() % 5000 == 0;
    const bool is_free = withheld == 0 || tell(ControlKind::heartbeat, id, 0ms);
    const bool sent =
        is_free &&
        sink.send(is_oversized ? std::span<const std::byte>(oversized)
                               : encoder.frame({id, 1, std::span(points).first(1 + random() % 20)}, session));
    captures.sent += sent ? 1 : 0;
    withheld += sent ? 0 : 1;
  }
  const auto receipt = handshake.end(captures.captured, withheld, 60s);
  CHECK(receipt);
  if (receipt) CHECK(receipt->received + receipt->missed + receipt->withheld == captures.captured);
  CHECK(sink.flush(60s) == 0);
  return captures;
}

}  // namespace

TEST_CASE(
    "every capture is accounted for: queues of 1 to 64, stalls, restarts, oversized messages, three senders at once") {
  const std::uint64_t wanted = wanted_captures();
  std::uint64_t total = 0;
  for (std::uint32_t round = 0; total < wanted; ++round) {
    std::mt19937 random(round);
    const test::TemporaryFolder folder;
    FakeEngine engine;
    WireContext context;
    const PipelineConfig chosen = config(random);
    FrameSource source(context, round % 2 == 0 ? "ipc://" + (folder / "frames").string() : "tcp://127.0.0.1:*",
                       chosen.limits);
    ResultSink sink(context, "ipc://" + (folder / "results").string(), 2'000'000);
    const std::string endpoint = source.endpoint(), results_endpoint = sink.endpoint();
    Listener listener(context, sink.endpoint());
    Pipeline pipeline(chosen, engine, std::move(source), std::move(sink));
    listener.start();

    std::atomic<bool> done = false;
    std::thread watcher([&] {  // checks the counters all the time
      std::mt19937 moods(round + 1000);
      for (std::uint64_t captured = 0; !done;) {
        const Counters now = pipeline.counters();
        CHECK(now.on_the_way() <= chosen.queue_slots + chosen.matchers + 1u);
        CHECK(now.captured() >= captured);
        captured = now.captured();
        if (moods() % 100 == 0) engine.set_delay(std::chrono::microseconds(moods() % 3 == 0 ? moods() % 2000 : 0));
        std::this_thread::sleep_for(1ms);
      }
    });
    std::vector<Captures> lives;
    std::mutex mutex;
    std::vector<std::thread> cameras;
    for (std::uint32_t camera = 0; camera < 3; ++camera)
      cameras.emplace_back([&, camera] {
        for (std::uint32_t life = 0; life < 3; ++life) {  // restarts
          const std::uint64_t session = 1 + camera * 100 + life;
          const Captures captures =
              send_frames(context, endpoint, results_endpoint, session, 500 + 1000 * camera,
                          round * 31 + static_cast<std::uint32_t>(session), chosen.limits.max_message_bytes());
          const std::lock_guard lock(mutex);
          lives.push_back(captures);
        }
      });
    for (std::thread& camera : cameras) camera.join();
    std::uint64_t captured = 0;
    for (const Captures& life : lives) captured += life.captured;
    CHECK(eventually([&] { return pipeline.counters().captured() == captured && pipeline.counters().adds_up(); }));
    done = true;
    watcher.join();
    pipeline.stop();
    listener.stop();

    const Counters counters = pipeline.counters();
    CAPTURE(round);
    CHECK(counters.adds_up());
    CHECK(counters.captured() == captured);
    CHECK(counters.silent == 0);
    CHECK(counters.duplicates == 0);
    CHECK(listener.lost == 0);
    CHECK(listener.unidentified == 0);
    std::uint64_t announced = 0;
    for (const auto& [status, count] : listener.by_status) {
      CHECK(count <= counters.of(status));
      announced += count;
    }
    CHECK(announced + counters.unannounced == captured);
    for (const Captures& life : lives) {
      const WireSender& sender = listener.senders[life.session];
      CHECK(sender.condition == SenderCondition::ended);
      CHECK(sender.first_id == 0);
      CHECK(sender.next_id == life.captured);
      CHECK(sender.received + sender.missed + sender.withheld == life.captured);
      CHECK(sender.received <= life.sent);
      for (const auto& [id, count] : listener.results[life.session]) {
        REQUIRE(count == 1);
        REQUIRE(id < life.captured);
      }
    }
    total += captured;
  }
  MESSAGE(total << " captures, all accounted for");
}

TEST_CASE("a message over the size limit is missed and gets a result") {
  std::mt19937 random(1);
  const test::TemporaryFolder folder;
  FakeEngine engine;
  WireContext context;
  PipelineConfig chosen = config(random);
  FrameSource source(context, "ipc://" + (folder / "frames").string(), chosen.limits);
  ResultSink results(context, "ipc://" + (folder / "results").string());
  FrameSink sink(context, source.endpoint());
  Listener listener(context, results.endpoint());
  Pipeline pipeline(chosen, engine, std::move(source), std::move(results));
  listener.start();
  Encoder encoder;
  const std::vector<Point> points(5, Point{4, 0, 0});
  REQUIRE(sink.wait_ready(30s));
  REQUIRE(sink.tell(encoder.control({7, ControlKind::hello, 0, 0})));
  REQUIRE(sink.send(encoder.frame({0, 1, points}, 7)));
  REQUIRE(eventually([&] { return pipeline.counters().received == 1; }));
  const std::vector<Point> many(100'000);
  REQUIRE(sink.send(encoder.frame({1, 1, many}, 7)));                         // 1.2 MB, over the limit
  REQUIRE(eventually([&] { return pipeline.frame_peers().admitted >= 2; }));  // disconnected, and reconnected
  REQUIRE(sink.tell(encoder.control({7, ControlKind::goodbye, 2, 0}), 30s));
  REQUIRE(eventually([&] { return pipeline.counters().captured() == 2; }));
  pipeline.stop();
  listener.stop();
  const Counters counters = pipeline.counters();
  CHECK(counters.of(WireStatus::missed) == 1);
  CHECK(counters.adds_up());
  CHECK_FALSE(is_complete(counters));
  CHECK(listener.by_status[WireStatus::missed] == 1);
  CHECK(listener.results[7][1] == 1);
}

TEST_CASE("a hello is answered with a state that lists the session; a new subscriber gets a state") {
  const test::TemporaryFolder folder;
  FakeEngine engine;
  WireContext context;
  PipelineConfig chosen;
  chosen.limits.max_points = 100;
  chosen.state_interval = 1h;
  FrameSource source(context, "ipc://" + (folder / "frames").string(), chosen.limits);
  ResultSink results(context, "ipc://" + (folder / "results").string());
  const std::string results_endpoint = results.endpoint();
  FrameSink sink(context, source.endpoint());
  const Pipeline pipeline(chosen, engine, std::move(source), std::move(results));
  WireState state;
  const auto receives_state = [&](ResultSource& subscriber) {
    const auto message = subscriber.receive(30s);
    return message && decode_state(*message, state) == WireStatus::ok;
  };
  ResultSource early(context, results_endpoint);
  CHECK(receives_state(early));
  CHECK(state.max_message_bytes == chosen.limits.max_message_bytes());
  Encoder encoder;
  REQUIRE(sink.tell(encoder.control({5, ControlKind::hello, 0, 0}), 30s));
  CHECK(receives_state(early));
  REQUIRE(state.senders.size() == 1);
  CHECK(state.senders[0] == WireSender{5, 0, 0, 0, 0, 0, SenderCondition::active});
  ResultSource late(context, results_endpoint);
  CHECK(receives_state(late));
  CHECK(state.senders.size() == 1);
}

TEST_CASE("a sender that stops without goodbye is silent and makes the run incomplete; one that resumes does not") {
  const test::TemporaryFolder folder;
  FakeEngine engine;
  WireContext context;
  PipelineConfig chosen;
  chosen.limits.max_points = 100;
  chosen.sender_timeout = 300ms;
  FrameSource source(context, "ipc://" + (folder / "frames").string(), chosen.limits);
  ResultSink results(context, "ipc://" + (folder / "results").string());
  FrameSink sink(context, source.endpoint());
  Pipeline pipeline(chosen, engine, std::move(source), std::move(results));
  Encoder encoder;
  REQUIRE(sink.tell(encoder.control({5, ControlKind::hello, 0, 0}), 30s));
  CHECK(eventually([&] { return pipeline.counters().silent == 1; }));
  CHECK_FALSE(is_complete(pipeline.counters()));
  CHECK(tally_line(pipeline.counters()).find("1 gone without goodbye") != std::string::npos);
  REQUIRE(sink.tell(encoder.control({5, ControlKind::heartbeat, 0, 0}), 30s));
  CHECK(eventually([&] { return pipeline.counters().silent == 0; }));
  REQUIRE(sink.tell(encoder.end_of_stream(5, 0), 30s));
  CHECK(eventually([&] { return pipeline.counters().of(WireStatus::end_of_stream) == 1; }));
  std::this_thread::sleep_for(500ms);
  pipeline.stop();
  CHECK(is_complete(pipeline.counters()));
}

// Regression: a run reported itself complete when it was stopped within the sender timeout after its sender was killed,
// or while a sender was connected that had not said goodbye.
TEST_CASE("at the end a sender without goodbye is silent at once, disconnected or not") {
  for (const bool leaves : {true, false}) {
    CAPTURE(leaves);
    const test::TemporaryFolder folder;
    FakeEngine engine;
    WireContext context;
    FrameSource source(context, "ipc://" + (folder / "frames").string(), {.max_points = 100});
    ResultSink results(context, "ipc://" + (folder / "results").string());
    auto sink = std::make_unique<FrameSink>(context, source.endpoint());
    PipelineConfig config;
    config.limits.max_points = 100;
    Pipeline pipeline(config, engine, std::move(source), std::move(results));
    Encoder encoder;
    REQUIRE(sink->tell(encoder.control({5, ControlKind::hello, 0, 0}), 30s));
    REQUIRE(eventually([&] { return !pipeline.senders().empty() && pipeline.frame_peers().admitted == 1; }));
    CHECK(pipeline.counters().silent == 0);
    if (leaves) {
      sink.reset();
      REQUIRE(eventually([&] { return pipeline.frame_peers().peers == 0; }));
    }
    pipeline.stop();
    CHECK(pipeline.counters().silent == 1);
    CHECK_FALSE(is_complete(pipeline.counters()));
  }
}

TEST_CASE("an impossible id or control message is rejected and does not change the account") {
  const test::TemporaryFolder folder;
  FakeEngine engine;
  WireContext context;
  PipelineConfig config;
  config.limits.max_points = 100;
  FrameSource source(context, "ipc://" + (folder / "frames").string(), config.limits);
  ResultSink results(context, "ipc://" + (folder / "results").string());
  FrameSink sink(context, source.endpoint());
  Pipeline pipeline(config, engine, std::move(source), std::move(results));
  Encoder encoder;
  const std::vector<Point> points(10);
  constexpr auto far = ~std::uint64_t{0} - 1;
  for (const std::uint64_t id : {std::uint64_t{0}, far, far + 1})
    REQUIRE(sink.send(encoder.frame({id, 0, points}, 7), 30s));
  REQUIRE(sink.tell(encoder.control({7, ControlKind::goodbye, far, far}), 30s));
  REQUIRE(sink.tell(encoder.end_of_stream(7, far), 30s));
  REQUIRE(sink.send(encoder.frame({1, 0, points}, 7), 30s));
  REQUIRE(eventually([&] { return pipeline.counters().sum(Fate::matched) == 2; }));
  pipeline.stop();
  const Counters counters = pipeline.counters();
  CHECK(counters.captured() == 6);
  CHECK(counters.of(WireStatus::damaged) == 3);     // two frames and the end of the stream
  CHECK(counters.of(WireStatus::wrong_kind) == 1);  // the control message
  CHECK(counters.missed == 0);
  CHECK(counters.adds_up());
}

TEST_CASE("unidentified messages beyond the rate limit are counted without results; frames get results") {
  const test::TemporaryFolder folder;
  FakeEngine engine;
  WireContext context;
  PipelineConfig chosen;
  chosen.limits.max_points = 100;
  chosen.unidentified_results_per_second = 50;
  FrameSource source(context, "ipc://" + (folder / "frames").string(), chosen.limits);
  ResultSink results(context, "ipc://" + (folder / "results").string());
  FrameSink sink(context, source.endpoint());
  Listener listener(context, results.endpoint());
  Pipeline pipeline(chosen, engine, std::move(source), std::move(results));
  listener.start();
  Encoder encoder;
  const std::vector<Point> points(5, Point{4, 0, 0});
  REQUIRE(sink.wait_ready(30s));
  const auto begin = std::chrono::steady_clock::now();
  for (std::uint64_t i = 0; i < 5000; ++i) {
    REQUIRE(sink.send(std::vector<std::byte>(40, std::byte{1}), 30s));
    if (i % 100 == 0) REQUIRE(sink.send(encoder.frame({i, 1, points}, 3), 30s));
  }
  CHECK(eventually([&] { return pipeline.counters().received == 5050; }));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  pipeline.stop();
  listener.stop();
  const Counters counters = pipeline.counters();
  CHECK(counters.of(WireStatus::wrong_kind) == 5000);
  CHECK(listener.unidentified <= 50 * (seconds + 1) + 1);
  CHECK(listener.unidentified >= 1);
  CHECK(counters.received - counters.of(WireStatus::wrong_kind) == 50);
  CHECK(listener.results[3].size() == 4901);  // 50 frames, and the ids between them as missed
}
