// The pipeline of lbea-serve in this process, with a fake matcher.
#include "tools/serve/reports.hpp"

#include "tests/support/test_data.hpp"
#include "tests/wire/pipeline/fake_engine.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <map>
#include <random>
#include <set>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::eventually;
using lbea::test::FakeEngine;

namespace {

// inproc passes the sender's memory through queues that the thread sanitizer cannot follow.
const std::vector<std::string> transports{
    "ipc",
    "tcp",
#ifndef __SANITIZE_THREAD__
    "inproc",
#endif
};

/// A pipeline with one sender and one subscriber that receives everything.
class Bench {
 public:
  explicit Bench(std::chrono::microseconds delay = {}, PipelineConfig config = small(),
                 const std::string& transport = "ipc")
      : engine(delay),
        source_(context, endpoint("frames", transport), config.limits),
        sink_(context, endpoint("results", transport)),
        sender(context, source_.endpoint()),
        subscriber(context, sink_.endpoint()),
        pipeline(std::move(config), engine, std::move(source_), std::move(sink_)) {
    REQUIRE(sender.wait_ready(30s));
    // A state shows that the subscription is complete.
    REQUIRE(eventually([&] { return subscriber.receive(10ms).has_value(); }));
  }

  void send(std::uint64_t id, std::size_t points, std::uint64_t session = 1, const Point& first = {4, 0, 0}) {
    const std::vector<Point> cloud(points, first);
    send_bytes(encoder.frame({id, 77, cloud}, session));
  }
  void send_bytes(std::span<const std::byte> bytes) { REQUIRE(sender.send(bytes, 30s)); }

  /// Receives until there are `count` results.
  void receive(std::size_t count) {
    while (results.size() < count) {
      const auto message = subscriber.receive(30s);
      REQUIRE(message);
      decode(*message);
    }
  }
  /// Stops after everything has arrived, then receives the rest.
  Counters finish() {
    const auto arrived = [&] {
      const Counters counters = pipeline.counters();
      return counters.received + counters.of(WireStatus::end_of_stream);
    };
    CHECK(eventually([&] { return arrived() == sender.tally().sent; }));
    pipeline.stop();
    while (const auto message = subscriber.receive(200ms)) decode(*message);
    return pipeline.counters();
  }

  static PipelineConfig small() {
    PipelineConfig config;
    config.limits.max_points = 1000;
    config.state_interval = 20ms;
    config.description.model.checksum = 99;
    config.description.model.simulations = {"run_004"};
    return config;
  }

  test::TemporaryFolder folder;
  FakeEngine engine;
  WireContext context;

 private:
  std::string endpoint(const std::string& name, const std::string& transport) const {
    if (transport == "tcp") return "tcp://127.0.0.1:*";
    return transport == "inproc" ? "inproc://" + name : "ipc://" + (folder / name).string();
  }
  void decode(Message message) {
    if (message_kind(message) == MessageKind::state) {
      REQUIRE(decode_state(message, state) == WireStatus::ok);
      return;
    }
    results.emplace_back();
    REQUIRE(decode_result(message, results.back()) == WireStatus::ok);
  }
  FrameSource source_;
  ResultSink sink_;

 public:
  FrameSink sender;
  ResultSource subscriber;
  Encoder encoder;
  std::vector<WireResult> results;
  WireState state;
  Pipeline pipeline;
};

std::map<WireStatus, std::uint64_t> count_results(const std::vector<WireResult>& results) {
  std::map<WireStatus, std::uint64_t> counts;
  for (const WireResult& result : results) ++counts[result.status];
  return counts;
}

void check_published_as_counted(const Bench& bench, const Counters& counters) {
  const auto published = count_results(bench.results);
  for (std::size_t i = 0; i < wire_status_count; ++i) {
    const auto status = static_cast<WireStatus>(i);
    CAPTURE(to_string(status));
    const auto found = published.find(status);
    CHECK((found == published.end() ? 0 : found->second) == counters.of(status));
  }
}

}  // namespace

TEST_CASE("every frame gets a result, in order, with names, times and counters") {
  for (const std::string& transport : transports) {
    CAPTURE(transport);
    Bench bench({}, Bench::small(), transport);
    for (std::uint64_t id = 0; id < 100; ++id) {
      bench.send(id, 10);
      bench.receive(id + 1);
    }
    const Counters counters = bench.finish();
    REQUIRE(bench.results.size() == 100);
    for (std::uint64_t id = 0; id < 100; ++id) {
      const WireResult& result = bench.results[id];
      CHECK(result.frame_id == id);
      CHECK(result.session == 1);
      CHECK(result.stamp_ns == 77);
      CHECK(result.status == WireStatus::ok);
      CHECK(result.verdict == WireVerdict::unknown);  // regression: `matched`, by a method that gives no verdict
      CHECK(result.coverage == 0.5f);
      CHECK(result.points.received == 10);
      REQUIRE(result.matches.size() == 1);
      CHECK(result.matches[0].sample == Sample{4, 3});
      CHECK(result.matches[0].simulation_name == "run_004");
      CHECK(result.matches[0].time_s == doctest::Approx(0.003));
      CHECK(result.matches[0].distance == 1.5f);
      CHECK(result.elapsed_ns.match.index == 1);
      CHECK(result.elapsed_ns.match.coverage == 5);
      CHECK(result.elapsed_ns.total > 0);
      CHECK(result.publish_ns >= result.receive_ns);
      CHECK(result.model_checksum == 99);
      CHECK(result.counters.received == id + 1);
      CHECK(result.counters.of(WireStatus::ok) == id + 1);
    }
    CHECK(counters.received == 100);
    CHECK(counters.of(WireStatus::ok) == 100);
    CHECK(counters.missed == 0);
    CHECK(is_complete(counters));
  }
}

// Each frame takes another time, so that later ones are often matched before earlier ones.
TEST_CASE("several matchers: every frame has its own result, in order, with the counters of one matcher") {
  for (const std::uint32_t matchers : {1u, 2u, 3u, 8u}) {
    CAPTURE(matchers);
    PipelineConfig config = Bench::small();
    config.matchers = matchers;
    config.queue_slots = 400;
    Bench bench({}, config);
    std::mt19937 random(matchers);
    constexpr std::uint64_t frames = 300;
    for (std::uint64_t id = 0; id < frames; ++id)
      bench.send(id, id % 50 == 7 ? 0 : 5, 1, {static_cast<float>(id), static_cast<float>(random() % 4 * 500), 0});
    bench.send_bytes(bench.encoder.end_of_stream(1, frames));
    const Counters counters = bench.finish();
    CHECK(is_complete(counters));
    check_published_as_counted(bench, counters);
    REQUIRE(bench.results.size() == frames + 1);
    for (std::uint64_t id = 0; id < frames; ++id) {
      const WireResult& result = bench.results[id];
      CHECK(result.frame_id == id);
      CHECK(result.status == (id % 50 == 7 ? WireStatus::empty_frame : WireStatus::ok));
      if (id % 50 != 7) CHECK(result.matches.at(0).sample == Sample{static_cast<std::uint32_t>(id), 3});
      const Counters& then = result.counters;
      CHECK(then.of(WireStatus::ok) + then.of(WireStatus::empty_frame) >= id + 1);
    }
    CHECK(bench.results.back().status == WireStatus::end_of_stream);
  }
}

namespace {

/// Frames depend on earlier ones; notes the order of calls.
class OrderedEngine final : public MatchEngine {
 public:
  MatchResult match(const Frame& frame, std::uint32_t) noexcept override {
    calls.push_back("match " + std::to_string(frame.id));
    MatchResult result;
    result.frame_id = frame.id;
    return result;
  }
  [[nodiscard]] bool matches_frames_alone() const noexcept override { return false; }
  const TestState* track(const MatchResult& result) noexcept override {
    calls.push_back("track " + std::to_string(result.frame_id));
    return nullptr;
  }
  void begin_test() noexcept override { calls.emplace_back("begin"); }
  [[nodiscard]] std::string_view simulation_name(std::uint32_t) const noexcept override { return "run"; }
  [[nodiscard]] double time_s(Sample) const noexcept override { return 0; }

  std::vector<std::string> calls;  // no thread may add one while another does
};

}  // namespace

TEST_CASE("frames that depend on earlier ones are matched one after the other by any number of matchers") {
  PipelineConfig config = Bench::small();
  config.matchers = 3;
  PipelineQueues queues(config);
  OrderedEngine engine;
  FrameMatcher matcher(config, engine, queues);
  std::vector<std::thread> threads;
  for (std::uint32_t i = 0; i < config.matchers; ++i) threads.emplace_back(&FrameMatcher::run, &matcher, i);
  std::vector<std::string> expected;
  std::size_t published = 0;
  for (std::uint64_t id = 0; id < 2'000; ++id) {
    FrameSlot& slot = queues.frames.wait_and_claim();
    slot.header.id = id;
    slot.header.session = id / 100;
    slot.header.end_of_stream = id % 100 == 50;
    slot.header.points = 1;
    if (id % 100 == 0 || id % 100 == 51) expected.emplace_back("begin");
    if (!slot.header.end_of_stream)
      expected.insert(expected.end(), {"match " + std::to_string(id), "track " + std::to_string(id)});
    queues.frames.publish();
    for (; queues.outcomes.front() != nullptr; queues.outcomes.release())
      CHECK(queues.outcomes.front()->result.frame_id == published++);
  }
  queues.frames.close();
  for (; published < 2'000; queues.outcomes.release()) {
    REQUIRE(eventually([&] { return queues.outcomes.front() != nullptr; }));
    CHECK(queues.outcomes.front()->result.frame_id == published++);
  }
  for (std::thread& thread : threads) thread.join();
  CHECK(engine.calls == expected);
  CHECK(matcher.current_frame() == 1'999);
}

TEST_CASE("a matcher goes on while another one needs long for an earlier frame") {
  PipelineConfig config = Bench::small();
  config.matchers = 2;
  PipelineQueues queues(config);
  FakeEngine engine;
  FrameMatcher matcher(config, engine, queues);
  std::vector<std::thread> threads;
  for (std::uint32_t i = 0; i < config.matchers; ++i) threads.emplace_back(&FrameMatcher::run, &matcher, i);
  for (std::uint64_t id = 0; id < 11; ++id) {
    FrameSlot& slot = queues.frames.wait_and_claim();
    slot.header.id = id;
    slot.header.points = 2;
    slot.points[0] = {4, id == 0 ? 500'000.0f : 0.0f, 0};  // us
    queues.frames.publish();
  }
  REQUIRE(eventually([&] { return engine.matched == 10; }));
  CHECK(queues.outcomes.front() == nullptr);
  CHECK(matcher.current_frame() == 0);
  for (std::uint64_t id = 0; id < 11; ++id, queues.outcomes.release()) {
    REQUIRE(eventually([&] { return queues.outcomes.front() != nullptr; }));
    CHECK(queues.outcomes.front()->result.frame_id == id);
  }
  queues.frames.close();
  for (std::thread& thread : threads) thread.join();
}

// Otherwise the watchdog of lbea-serve would not notice a hanging matcher beside an idle one.
TEST_CASE("rounds do not rise while a frame is being matched, whatever the other matchers do") {
  PipelineConfig config = Bench::small();
  config.matchers = 2;
  PipelineQueues queues(config);
  FakeEngine engine(1s);
  FrameMatcher matcher(config, engine, queues);
  std::vector<std::thread> threads;
  for (std::uint32_t i = 0; i < config.matchers; ++i) threads.emplace_back(&FrameMatcher::run, &matcher, i);
  REQUIRE(eventually([&] { return matcher.rounds() > 2; }));  // idle
  FrameSlot& slot = queues.frames.wait_and_claim();
  slot.header.id = 17;
  slot.header.points = 1;
  queues.frames.publish();
  REQUIRE(eventually([&] { return matcher.current_frame() == 17; }));
  const std::uint64_t rounds = matcher.rounds();
  while (queues.outcomes.front() == nullptr) {
    const std::uint64_t now = matcher.rounds();
    if (queues.outcomes.front() == nullptr) CHECK(now == rounds);
    std::this_thread::sleep_for(5ms);
  }
  REQUIRE(eventually([&] { return matcher.rounds() > rounds + 1; }));
  queues.frames.close();
  for (std::thread& thread : threads) thread.join();
}

TEST_CASE("with a slow matcher, frames beyond the queue are dropped, counted and published") {
  PipelineConfig config = Bench::small();
  config.queue_slots = 3;
  Bench bench(2ms, config);
  constexpr std::uint64_t frames = 400;
  for (std::uint64_t id = 0; id < frames; ++id) bench.send(id, 5);
  bench.send_bytes(bench.encoder.end_of_stream(1, frames));
  const Counters counters = bench.finish();
  CHECK(counters.received == frames);
  CHECK(counters.adds_up());
  CHECK(counters.of(WireStatus::queue_full) > 0);
  CHECK(counters.of(WireStatus::ok) >= 3);
  CHECK(counters.missed == 0);
  CHECK_FALSE(is_complete(counters));
  check_published_as_counted(bench, counters);
  std::set<std::uint64_t> ids;
  for (const WireResult& result : bench.results) ids.insert(result.frame_id);
  CHECK(ids.size() == frames + 1);
  CHECK(bench.results.back().status == WireStatus::end_of_stream);
  CHECK(bench.results.back().counters.adds_up());
}

TEST_CASE("rejected frames get results too and do not affect the others") {
  Bench bench;
  const std::vector<std::byte> garbage(500, std::byte{0x5a});
  const std::vector<Point> many(1001), few(3, Point{4, 0, 0});
  std::uint64_t id = 0;
  for (int round = 0; round < 20; ++round) {
    bench.send(id++, 2);
    bench.send_bytes(garbage);
    bench.send(id++, 0);
    bench.send_bytes(bench.encoder.frame({id++, 1, many}, 1));
    bench.send(id++, 1);
    const auto message = bench.encoder.frame({id, 1, few}, 1);
    bench.send_bytes(message.first(message.size() / 2));
    bench.receive(static_cast<std::size_t>(round + 1) * 6);
  }
  const Counters counters = bench.finish();
  CHECK(counters.received == 120);
  CHECK(counters.adds_up());
  for (const auto status : {WireStatus::ok, WireStatus::low_coverage, WireStatus::empty_frame,
                            WireStatus::too_many_points, WireStatus::wrong_kind, WireStatus::damaged})
    CHECK(counters.of(status) == 20);
  CHECK(counters.missed == 0);
  check_published_as_counted(bench, counters);
  for (const WireResult& result : bench.results) {
    const bool refused = fate_of(result.status) == Fate::rejected;
    CHECK((result.verdict == WireVerdict::refused) == refused);
    CHECK(result.matches.empty() == refused);
  }
}

TEST_CASE("gaps, duplicates and sessions are counted") {
  Bench bench;
  for (const std::uint64_t id : {5u, 6u, 9u, 9u}) bench.send(id, 2, 1);
  bench.send(1000, 2, 2);
  bench.send_bytes(bench.encoder.end_of_stream(2, 1003));
  bench.receive(10);
  const Counters counters = bench.finish();
  CHECK(counters.missed == 4);  // 7, 8; 1001, 1002
  CHECK(counters.of(WireStatus::missed) == 4);
  CHECK(counters.duplicates == 1);
  CHECK(counters.of(WireStatus::duplicate) == 1);
  CHECK(counters.sessions == 2);
  CHECK(counters.received == 5);
  CHECK(counters.captured() == 9);
  CHECK(counters.of(WireStatus::ok) == 4);
  CHECK(counters.of(WireStatus::end_of_stream) == 1);
  CHECK(counters.adds_up());
  CHECK_FALSE(is_complete(counters));
}

TEST_CASE("the metrics show the channels of the latest matched frame until its test ends or its sender is silent") {
  PipelineConfig config = Bench::small();
  config.sender_timeout = 1s;
  Bench bench({}, config);
  const auto shows = [&](const std::string& line) {
    return metrics_page(bench.pipeline).find("\n" + line) != std::string::npos;
  };
  const auto has_channels = [&] { return shows("# HELP lbea_channel "); };
  const Point with_channels{4, 0, 1}, without{4, 0, 0};
  const auto show_channels = [&](std::uint64_t id) {
    bench.send(id, 10, 1, with_channels);
    CHECK(eventually(has_channels));
  };
  const auto hide_channels = [&](std::uint64_t id, std::size_t points, const Point& first) {
    bench.send(id, points, 1, first);
    CHECK(eventually([&] { return !has_channels(); }));
  };
  CHECK_FALSE(has_channels());
  show_channels(0);
  CHECK(shows("lbea_channel{name=\"end \\\"x\\\" \\\\ \\n\",unit=\"mm\"} 12.3\n"));
  CHECK(shows("lbea_channel{name=\"gap\",unit=\"\"} -3\n"));
  CHECK(shows("lbea_channel_bound_90{name=\"end \\\"x\\\" \\\\ \\n\",unit=\"mm\"} 0.5\n"));
  CHECK_FALSE(shows("lbea_channel_bound_90{name=\"gap\""));
  CHECK_FALSE(shows("lbea_channel{name=\"unknown\""));
  hide_channels(1, 10, without);
  show_channels(2);
  hide_channels(3, 1, with_channels);  // its coverage is low
  show_channels(4);
  bench.send(5, 0);  // rejected: the latest matched frame remains
  bench.send_bytes(bench.encoder.end_of_stream(2, 0));
  REQUIRE(eventually([&] { return bench.pipeline.counters().of(WireStatus::end_of_stream) == 1; }));
  bench.receive(7);
  CHECK(has_channels());
  bench.send_bytes(bench.encoder.end_of_stream(1, 6));
  CHECK(eventually([&] { return !has_channels(); }));
  show_channels(6);
  bench.send_bytes(bench.encoder.control({1, ControlKind::heartbeat, 7, 0}));
  CHECK(eventually([&] { return !has_channels(); }));  // after sender_timeout
}

TEST_CASE("stop() finishes all frames that have arrived") {
  PipelineConfig config = Bench::small();
  config.queue_slots = 8;
  Bench bench(20ms, config);
  for (std::uint64_t id = 0; id < 5; ++id) bench.send(id, 3);
  const Counters counters = bench.finish();
  CHECK(counters.received == 5);
  CHECK(counters.of(WireStatus::ok) == 5);
  CHECK(bench.results.size() == 5);
  CHECK(bench.state.counters == counters);  // the last state has the closing tally
}

TEST_CASE("a late subscriber learns the current counts from the state") {
  Bench bench;
  bench.send(0, 3);
  bench.receive(1);
  ResultSource late(bench.context, "ipc://" + (bench.folder / "results").string());
  WireState state;
  REQUIRE(eventually([&] {
    const auto message = late.receive(100ms);
    return message && decode_state(*message, state) == WireStatus::ok && state.counters.received == 1;
  }));
  CHECK(state.model.checksum == 99);
  CHECK(state.model.simulations == std::vector<std::string>{"run_004"});
  CHECK(state.max_points == 1000);
  CHECK(state.queue_slots == 16);
  CHECK(state.start_ns > 0);
  CHECK(state.publish_ns >= state.start_ns);
  static_cast<void>(bench.finish());
}

TEST_CASE("sequence numbers on the results socket have no gap") {
  Bench bench;
  std::optional<std::uint64_t> last;
  for (std::uint64_t id = 0; id < 50; ++id) {
    bench.send(id, 3);
    while (true) {
      const auto message = bench.subscriber.receive(30s);
      REQUIRE(message);
      WireResult result;
      WireState state;
      const bool is_state = decode_state(*message, state) == WireStatus::ok;
      if (!is_state) REQUIRE(decode_result(*message, result) == WireStatus::ok);
      const std::uint64_t sequence = is_state ? state.sequence : result.sequence;
      if (last) CHECK(sequence == *last + 1);
      last = sequence;
      if (!is_state) break;
    }
  }
  static_cast<void>(bench.finish());
}

TEST_CASE("with random stalls of the matcher the tally is exact") {
  std::mt19937 random(7);
  for (int round = 0; round < 3; ++round) {
    PipelineConfig config = Bench::small();
    config.queue_slots = 1 + random() % 4;
    config.matchers = 1 + static_cast<std::uint32_t>(round);
    Bench bench({}, config);
    std::uint64_t sent = 0;
    for (; sent < 300; ++sent) {
      if (random() % 50 == 0) bench.engine.set_delay(std::chrono::microseconds(random() % 5000));
      bench.send(sent, 1 + random() % 20);
    }
    const Counters counters = bench.finish();
    CHECK(counters.received == sent);
    CHECK(counters.adds_up());
    CHECK(counters.missed == 0);
    check_published_as_counted(bench, counters);
  }
}

TEST_CASE("the closing tally as text and as JSON") {
  Counters counters;
  counters.received = 10;
  counters.by_status[static_cast<std::size_t>(WireStatus::ok)] = 6;
  counters.by_status[static_cast<std::size_t>(WireStatus::damaged)] = 3;
  counters.by_status[static_cast<std::size_t>(WireStatus::queue_full)] = 1;
  CHECK(tally_line(counters) ==
        "captured 10 = matched 6 (ok 6) + rejected 3 (damaged 3) + dropped 1 (queue_full 1); received 10, "
        "reordered 0, sessions 0");
  CHECK(tally_json(counters).find("\"rejected_by_reason\":{\"empty_frame\":0") != std::string::npos);
  CHECK(tally_json(counters).find("\"adds_up\":true") != std::string::npos);
  CHECK_FALSE(is_complete(counters));
  counters.received = 11;
  CHECK(tally_line(counters).starts_with("captured 11 IS NOT matched 6"));
}
