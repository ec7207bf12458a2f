// Captures of several rigs: which frames they consist of, and what the pipeline makes of them, with a fake matcher.
#include "tools/serve/pipeline/pipeline.hpp"

#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <map>
#include <random>
#include <set>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::eventually;

namespace {

constexpr std::int64_t us = 1000, ms = 1'000'000;

/// Frames of two rigs; stamps and arrivals in us.
class Grouped {
 public:
  bool add(std::uint32_t rig, std::int64_t stamp, std::int64_t arrival) {
    grouping.add({turn_++, rig, stamp * us, arrival * us});
    return grouping.take_refused().empty();
  }
  /// The stamps of the next capture, by rigs; empty if it is not complete at this time.
  std::map<std::uint32_t, std::int64_t> next(std::int64_t now, bool at_once = false) {
    std::map<std::uint32_t, std::int64_t> stamps;
    for (const WaitingFrame& frame : grouping.next(now * us, at_once)) stamps[frame.rig] = frame.stamp_ns / us;
    return stamps;
  }
  CaptureGrouping grouping{2, {.window = std::chrono::microseconds(400), .wait = 5ms}, 1000};

 private:
  std::uint64_t turn_ = 0;
};

using Stamps = std::map<std::uint32_t, std::int64_t>;

}  // namespace

TEST_CASE("a capture is complete when every rig has a frame in the window") {
  Grouped frames;
  REQUIRE(frames.add(0, 1000, 1100));
  CHECK(frames.next(1200).empty());
  CHECK(frames.grouping.deadline_ns() == 6100 * us);
  REQUIRE(frames.add(1, 1300, 1500));
  CHECK(frames.next(1500) == Stamps{{0, 1000}, {1, 1300}});
  CHECK(frames.next(1500).empty());
  CHECK_FALSE(frames.grouping.deadline_ns());
}

// Until the impact shows that a clock is 3 ms behind or ahead, stamps that are equal make a capture.
TEST_CASE("after the correction of a clock, captures consist of frames of the same time, and none is refused") {
  for (const std::int64_t behind : {3000, -3000}) {
    CAPTURE(behind);
    Grouped frames;
    std::size_t captures = 0;
    for (std::int64_t time = 0; time < 40'000; time += 1000) {
      const bool is_corrected = time > 20'000;
      if (is_corrected) frames.grouping.correct_clocks(std::vector<std::int64_t>{0, behind * us});
      CHECK(frames.add(0, time, time + 100));
      CHECK(frames.add(1, time - behind, time + 200));
      for (Stamps capture = frames.next(time + 200); !capture.empty(); capture = frames.next(time + 200)) {
        ++captures;
        if (time > 24'000) CHECK((capture.size() == 2 && capture[0] == capture[1]));
      }
    }
    CHECK(captures > 36);
  }
}

TEST_CASE("a rig that lags behind by less than the wait is in its captures") {
  Grouped frames;
  std::vector<Stamps> captures;
  for (std::int64_t now = 0; now <= 20'000; now += 1000) {
    REQUIRE(frames.add(0, now, now));
    if (now >= 3000) REQUIRE(frames.add(1, now - 3000, now));
    for (Stamps stamps = frames.next(now); !stamps.empty(); stamps = frames.next(now)) captures.push_back(stamps);
  }
  REQUIRE(captures.size() == 18);
  for (std::size_t i = 0; i < captures.size(); ++i) {
    const auto stamp = static_cast<std::int64_t>(i) * 1000;
    CHECK(captures[i] == Stamps{{0, stamp}, {1, stamp}});
  }
}

TEST_CASE("no frame waits for a slower rig whose next frame is not due") {
  Grouped frames;
  for (std::int64_t now = 0; now <= 40'000; now += 1000) {
    CAPTURE(now);
    REQUIRE(frames.add(0, now, now));
    if (now % 10'000 == 0) REQUIRE(frames.add(1, now, now));
    if (now <= 10'000)
      while (!frames.next(now + 5000).empty()) {}
    else
      CHECK(frames.next(now).size() == (now % 10'000 == 0 ? 2 : 1));
  }
}

TEST_CASE("a silent rig is waited for once, and again after it has sent a frame") {
  Grouped frames;
  for (const std::int64_t now : {-1000, 0}) {
    for (const std::uint32_t rig : {0u, 1u}) REQUIRE(frames.add(rig, now, now));
    CHECK(frames.next(now).size() == 2);
  }
  REQUIRE(frames.add(0, 1000, 1000));
  CHECK(frames.next(5999).empty());
  CHECK(frames.next(6000) == Stamps{{0, 1000}});
  REQUIRE(frames.add(0, 7000, 7000));
  CHECK(frames.next(7000) == Stamps{{0, 7000}});
  for (const std::uint32_t rig : {0u, 1u}) REQUIRE(frames.add(rig, 8000, 8000));
  CHECK(frames.next(8000).size() == 2);
  REQUIRE(frames.add(0, 9000, 9000));
  CHECK(frames.next(9000).empty());
  frames.grouping.end(1);
  CHECK(frames.next(9000) == Stamps{{0, 9000}});
}

TEST_CASE("a frame belongs to the nearer of two frames of the other rig") {
  Grouped frames;
  REQUIRE(frames.add(0, 1000, 1000));
  REQUIRE(frames.add(0, 1500, 1500));
  REQUIRE(frames.add(1, 1390, 1600));
  CHECK(frames.next(1600) == Stamps{{0, 1000}});
  CHECK(frames.next(1600) == Stamps{{0, 1500}, {1, 1390}});
}

// Regression: after a correction of a clock, each capture consisted of frames that were one interval apart.
TEST_CASE("a frame is left to the next capture if its nearest frame is still to come") {
  Grouped frames;
  for (std::int64_t time = 0; time <= 2000; time += 350)
    for (const std::uint32_t rig : {0u, 1u}) REQUIRE(frames.add(rig, time, time + 100));
  while (frames.next(2000).size() == 2) {}
  REQUIRE(frames.add(1, 2100, 2200));
  CHECK(frames.next(2200).empty());
  REQUIRE(frames.add(0, 2450, 2500));  // its rig's frame of 2100 is missing, and the other rig's of 2450 is late
  CHECK(frames.next(2500) == Stamps{{1, 2100}});
  REQUIRE(frames.add(1, 2450, 2600));
  CHECK(frames.next(2600) == Stamps{{0, 2450}, {1, 2450}});
}

TEST_CASE("a frame that arrives after later ones were matched is refused, and its rig is waited for again") {
  Grouped frames;
  REQUIRE(frames.add(0, 10'000, 10'000));
  CHECK(frames.next(15'000) == Stamps{{0, 10'000}});  // in vain
  REQUIRE(frames.add(0, 16'000, 16'000));
  CHECK(frames.next(16'000) == Stamps{{0, 16'000}});
  CHECK_FALSE(frames.add(1, 15'990, 17'000));
  REQUIRE(frames.add(0, 17'000, 17'000));
  CHECK(frames.next(17'000).empty());
  REQUIRE(frames.add(1, 16'990, 18'000));
  CHECK(frames.next(18'000) == Stamps{{0, 17'000}, {1, 16'990}});
}

namespace {

/// Frames of both rigs at 1,000 per second, the right ones 10 us before the left ones; `change` may change the stamp
/// and the arrival of a frame or leave it out (false). Counts those that are in captures, by rigs.
template <class Change>
std::array<int, 2> in_captures(int frames, const Change& change) {
  Grouped grouped;
  struct Arrival {
    std::int64_t at = 0, stamp = 0;
    std::uint32_t rig = 0;
  };
  std::vector<Arrival> arrivals;
  for (int i = 0; i < frames; ++i)
    for (const std::uint32_t rig : {0u, 1u}) {
      const std::int64_t captured = 1000 * (i + 1) - (rig == 1 ? 10 : 0);
      Arrival arrival{captured + 200 + 2000 * rig, captured, rig};
      if (change(arrival.rig, i, arrival.stamp, arrival.at)) arrivals.push_back(arrival);
    }
  std::ranges::stable_sort(arrivals, {}, &Arrival::at);
  std::array<int, 2> counts{};
  const auto match = [&](std::int64_t now) {
    for (Stamps stamps = grouped.next(now); !stamps.empty(); stamps = grouped.next(now))
      for (const auto& [rig, stamp] : stamps) ++counts[rig];
  };
  for (const Arrival& arrival : arrivals) {
    match(arrival.at);
    static_cast<void>(grouped.add(arrival.rig, arrival.stamp, arrival.at));
    match(arrival.at);
  }
  match(arrivals.back().at + 100'000);
  return counts;
}

}  // namespace

// Each of these put a rig out of step for the rest of the test.
TEST_CASE("a gap, a stall or a late start costs a rig few frames") {
  const auto right = [](const auto& change) {
    const auto counts = in_captures(200, [&](std::uint32_t rig, int i, std::int64_t& stamp, std::int64_t& at) {
      return rig == 0 || change(i, stamp, at);
    });
    CHECK(counts[0] == 200);
    return counts[1];
  };
  CHECK(right([](int, std::int64_t&, std::int64_t&) { return true; }) == 200);
  CHECK(right([](int i, std::int64_t&, std::int64_t&) { return i < 50 || i > 80; }) >= 165);
  CHECK(right([](int i, std::int64_t&, std::int64_t&) { return i > 60; }) >= 135);
  CHECK(right([](int i, std::int64_t&, std::int64_t& at) {
          if (i > 50 && i < 80) at = 82'000;  // all at once
          return true;
        }) >= 165);
}

TEST_CASE("a rig whose clock or latency is wrong takes no frames from the other one") {
  using Change = std::function<void(int, std::int64_t& stamp, std::int64_t& at)>;
  const std::vector<std::pair<std::string, Change>> changes{
      {"one stamp ahead", [](int i, std::int64_t& stamp, std::int64_t&) { stamp += i == 50 ? 900'000 : 0; }},
      {"one stamp far ahead", [](int i, std::int64_t& stamp, std::int64_t&) { stamp += i == 50 ? 3'600'000'000 : 0; }},
      {"an hour ahead", [](int, std::int64_t& stamp, std::int64_t&) { stamp += 3'600'000'000; }},
      {"an hour behind", [](int, std::int64_t& stamp, std::int64_t&) { stamp -= 3'600'000'000; }},
      {"half a second ahead", [](int, std::int64_t& stamp, std::int64_t&) { stamp += 500'000; }},
      {"the clock is set", [](int i, std::int64_t& stamp, std::int64_t&) { stamp += i >= 50 ? 500'000 : 0; }},
      {"late", [](int, std::int64_t&, std::int64_t& at) { at += 30'000; }},
      {"seconds late for a while",
       [](int i, std::int64_t&, std::int64_t& at) { at += i >= 50 && i < 100 ? 2'000'000 : 0; }},
      {"late for a while", [](int i, std::int64_t&, std::int64_t& at) { at += i >= 50 && i < 100 ? 200'000 : 0; }}};
  for (const std::uint32_t wrong : {0u, 1u})
    for (const auto& [what, change] : changes) {
      CAPTURE(what);
      CAPTURE(wrong);
      const auto counts = in_captures(400, [&](std::uint32_t rig, int i, std::int64_t& stamp, std::int64_t& at) {
        if (rig == wrong) change(i, stamp, at);
        return true;
      });
      CHECK(counts[1 - wrong] >= 390);
    }
}

TEST_CASE("another test may begin at an earlier time") {
  Grouped frames;
  REQUIRE(frames.add(0, 50'000, 50'000));
  CHECK(frames.next(50'000, true) == Stamps{{0, 50'000}});
  frames.grouping.begin_test();
  REQUIRE(frames.add(0, 0, 60'000));
  CHECK(frames.next(60'000, true) == Stamps{{0, 0}});
}

namespace {

/// Whether the frame began another test.
bool add(RigTests& tests, std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) {
  const bool begins = tests.begins(rig, session, receive_ns);
  if (begins) tests.begin();
  tests.add(rig, session, receive_ns);
  return begins;
}

}  // namespace

TEST_CASE("a test goes on while one of its senders runs") {
  RigTests tests(2, 3s);
  CHECK(add(tests, 0, 7, 0));
  CHECK_FALSE(add(tests, 1, 8, 1 * ms));
  CHECK_FALSE(add(tests, 1, 9, 2 * ms));  // restarted
  CHECK_FALSE(add(tests, 1, 10, 3 * ms));
  tests.end(1, 9);  // of the former sender
  CHECK_FALSE(tests.closes(4 * ms));
  tests.end(1, 10);
  CHECK_FALSE(tests.closes(5 * ms));
  tests.end(0, 7);
  CHECK(tests.closes(6 * ms));
  CHECK_FALSE(tests.closes(6 * ms));
  CHECK(add(tests, 1, 10, 7 * ms));  // another test by the same senders
  CHECK_FALSE(add(tests, 0, 7, 8 * ms));
}

TEST_CASE("another test begins also if a sender of the former one says nothing or goes on") {
  RigTests silent(2, 3s), restarted(2, 3s), going_on(2, 3s), paused(2, 3s);
  for (RigTests* tests : {&silent, &restarted, &going_on, &paused}) {
    CHECK(add(*tests, 0, 7, 0));
    CHECK_FALSE(add(*tests, 1, 8, 0));
  }
  CHECK(add(silent, 0, 17, 3'100 * ms));
  CHECK_FALSE(add(restarted, 0, 17, 1 * ms));
  CHECK(add(restarted, 1, 18, 2 * ms));
  CHECK_FALSE(add(restarted, 0, 17, 3 * ms));
  going_on.end(0, 7);
  CHECK_FALSE(add(going_on, 0, 7, 2 * ms));  // the other one still sends
  going_on.end(1, 8);
  going_on.end(0, 7);
  CHECK(add(going_on, 0, 7, 3 * ms));
  paused.end(1, 8);
  CHECK(paused.closes(3'100 * ms));  // the other one has sent nothing for so long
  CHECK(add(paused, 0, 7, 3'200 * ms));
}

namespace {

/// Its capture has the time of its first frame. A frame's first point has its id as x.
class FakeRigs final : public RigEngine {
 public:
  void match_alone(std::size_t rig, const Frame& frame) noexcept override {
    results_[rig] = {};
    results_[rig].points.received = static_cast<std::uint32_t>(frame.points.size());
    results_[rig].status = frame.points.empty() ? Status::empty_frame : Status::ok;
    results_[rig].is_used = !frame.points.empty();
    results_[rig].coverage = frame.points.empty() ? 0 : frame.points[0].x;
    if (stamp_ns_ == 0 || rig == 0) stamp_ns_ = frame.stamp_ns;
  }
  MatchResult combine() noexcept override {
    MatchResult result;
    result.stamp_ns = stamp_ns_.exchange(0);
    return result;
  }
  [[nodiscard]] std::span<const RigResult> rigs() const noexcept override { return results_; }
  [[nodiscard]] std::string_view simulation_name(std::uint32_t) const noexcept override { return "run"; }
  [[nodiscard]] double time_s(Sample) const noexcept override { return 0; }

 private:
  std::array<RigResult, 2> results_{};
  std::atomic<std::int64_t> stamp_ns_{0};
};

/// A pipeline of two rigs, "left" and "right", with a sender for each.
class RigBench {
 public:
  explicit RigBench(const PipelineConfig& config = two_rigs())
      : results_(context, address("results")), subscriber(context, results_.endpoint()) {
    std::vector<FrameSource> sources;
    for (const PipelineRig& rig : config.rigs) {
      sources.emplace_back(context, address(rig.name), config.limits);
      senders.emplace_back(context, sources.back().endpoint());
    }
    pipeline.emplace(config, engine, std::move(sources), std::move(results_));
    for (FrameSink& sender : senders) REQUIRE(sender.wait_ready(30s));
    REQUIRE(eventually([&] { return subscriber.receive(10ms).has_value(); }));
  }
  static PipelineConfig two_rigs() {
    PipelineConfig config;
    config.limits.max_points = 100;
    config.rigs = {{"left", 0}, {"right", 0}};
    config.description.rigs = {{"left", "", 0, {}}, {"right", "", 0, {}}};
    return config;
  }
  void send(std::size_t rig, std::uint64_t session, std::uint64_t id, std::int64_t stamp_ns, std::size_t points = 1) {
    const std::vector<Point> cloud(points, Point{static_cast<float>(id), 0, 0});
    REQUIRE(senders[rig].send(encoder.frame({id, stamp_ns, cloud}, session), 30s));
  }
  void end(std::size_t rig, std::uint64_t session, std::uint64_t next_id) {
    REQUIRE(senders[rig].send(encoder.end_of_stream(session, next_id), 30s));
  }
  /// Stops after everything has arrived and receives all results.
  void finish() {
    const auto arrived = [&] {
      const Counters counters = pipeline->counters();
      return counters.received + counters.of(WireStatus::end_of_stream);
    };
    CHECK(eventually([&] { return arrived() == senders[0].tally().sent + senders[1].tally().sent; }));
    pipeline->stop();
    while (const auto message = subscriber.receive(200ms))
      if (message_kind(*message) == MessageKind::result)
        REQUIRE(decode_result(*message, results.emplace_back()) == WireStatus::ok);
  }

  FakeRigs engine;

 private:
  std::string address(const std::string& name) const { return "ipc://" + (folder_ / name).string(); }
  test::TemporaryFolder folder_;

 public:
  WireContext context;

 private:
  ResultSink results_;

 public:
  ResultSource subscriber;
  std::vector<FrameSink> senders;
  Encoder encoder;
  std::vector<WireResult> results;
  std::optional<Pipeline> pipeline;
};

using FrameId = std::pair<std::uint64_t, std::uint64_t>;

/// How often each frame was answered.
std::map<FrameId, int> answers(const std::vector<WireResult>& results) {
  std::map<FrameId, int> counts;
  for (const WireResult& result : results)
    if (result.status != WireStatus::end_of_stream)
      for_each_frame(result, [&](std::uint64_t session, std::uint64_t id, WireStatus) { ++counts[{session, id}]; });
  return counts;
}

}  // namespace

TEST_CASE("two rigs in step: one result per capture, in order, then the ends of both streams and of the test") {
  PipelineConfig config = RigBench::two_rigs();
  config.queue_slots = 1000;
  config.grouping.wait = 1s;  // also on a loaded machine
  RigBench bench(config);
  constexpr std::uint64_t frames = 50;
  for (std::uint64_t id = 0; id < frames; ++id) {
    const std::int64_t now = wall_clock_ns();
    bench.send(0, 5, id, now);
    bench.send(1, 6, id, now + 100'000);
    std::this_thread::sleep_for(2ms);
  }
  bench.end(0, 5, frames);
  bench.end(1, 6, frames);
  bench.finish();
  REQUIRE(bench.results.size() == frames + 3);
  for (std::uint64_t i = 0; i < frames; ++i) {
    const WireResult& result = bench.results[i];
    CHECK(result.session == ~std::uint64_t{5});
    CHECK(result.frame_id == i);
    REQUIRE(result.rigs.size() == 2);
    CHECK(result.stamp_ns == result.rigs[0].stamp_ns);
    for (const std::size_t rig : {0u, 1u}) {
      CHECK(result.rigs[rig].rig == (rig == 0 ? "left" : "right"));
      CHECK(result.rigs[rig].session == 5 + rig);
      CHECK(result.rigs[rig].frame_id == i);
      CHECK(result.rigs[rig].is_used);
      CHECK(result.rigs[rig].coverage == static_cast<float>(i));
    }
  }
  CHECK(bench.results[frames].session == 5);
  CHECK(bench.results[frames + 1].session == 6);
  CHECK(bench.results[frames + 2].session == ~std::uint64_t{5});
  for (std::size_t i = frames; i < frames + 3; ++i) CHECK(bench.results[i].status == WireStatus::end_of_stream);
  for (const WireRig& rig : bench.pipeline->rigs()) {
    CHECK(rig.counters.of(WireStatus::ok) == frames);
    CHECK(rig.counters.captured() == frames);
  }
}

TEST_CASE("the session of a test's results does not depend on which rig's frame arrives first") {
  for (const std::uint32_t first : {0u, 1u}) {
    CAPTURE(first);
    PipelineConfig config = RigBench::two_rigs();
    config.grouping.wait = 1s;  // also on a loaded machine
    RigBench bench(config);
    const std::int64_t now = wall_clock_ns();
    for (const std::uint32_t rig : {first, 1 - first}) bench.send(rig, 5 + rig, 0, now + 100'000 * rig);
    bench.end(0, 5, 1);
    bench.end(1, 6, 1);
    bench.finish();
    REQUIRE(bench.results.size() == 4);
    CHECK(bench.results.front().session == ~std::uint64_t{5});
    CHECK(bench.results.back().session == ~std::uint64_t{5});
  }
}

TEST_CASE("a test whose sender went without goodbye ends when the next one begins") {
  PipelineConfig config = RigBench::two_rigs();
  config.sender_timeout = 50ms;
  RigBench bench(config);
  bench.send(0, 5, 0, wall_clock_ns());
  bench.send(1, 6, 0, wall_clock_ns());
  bench.end(0, 5, 1);
  std::this_thread::sleep_for(200ms);  // the right sender is silent
  bench.send(0, 5, 1, wall_clock_ns());
  bench.end(0, 5, 2);
  bench.finish();
  std::vector<WireStatus> statuses;
  for (const WireResult& result : bench.results)
    if (result.session == ~std::uint64_t{5}) statuses.push_back(result.status);
  statuses.erase(std::unique(statuses.begin(), statuses.end()), statuses.end());  // captures of the first frames
  CHECK(statuses == std::vector{WireStatus::ok, WireStatus::end_of_stream, WireStatus::ok, WireStatus::end_of_stream});
}

TEST_CASE("frames at a rig's pace are not dropped when another rig stops") {
  PipelineConfig config = RigBench::two_rigs();
  config.grouping.wait = 1s;  // much longer than the queue lasts
  RigBench bench(config);
  for (std::uint64_t id = 0; id < 60; ++id) {
    if (id < 5) bench.send(1, 6, id, wall_clock_ns());
    bench.send(0, 5, id, wall_clock_ns());
    std::this_thread::sleep_for(3ms);
  }
  bench.finish();
  CHECK(bench.pipeline->rigs()[0].counters.of(WireStatus::ok) == 60);
}

TEST_CASE("every frame of every rig is answered once and counted once, whatever the rigs do") {
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    CAPTURE(seed);
    std::mt19937 random(seed);
    const auto chance = [&](unsigned percent) { return random() % 100 < percent; };
    PipelineConfig config = RigBench::two_rigs();
    config.queue_slots = seed % 2 == 0 ? 2 : 16;
    config.grouping.wait = std::chrono::milliseconds(1 + random() % 4);
    RigBench bench(config);
    std::map<FrameId, std::size_t> sent;  // rigs
    std::array<std::uint64_t, 2> session{100, 200}, next_id{0, 0};
    for (int round = 0; round < 300; ++round) {
      for (const std::size_t rig : {0u, 1u}) {
        if (chance(10)) continue;
        if (chance(2)) bench.end(rig, session[rig], next_id[rig]);
        if (chance(2)) ++session[rig], next_id[rig] = 0;
        const std::int64_t late_ns = chance(10) ? static_cast<std::int64_t>(random() % 300) * ms : 0;
        const std::int64_t ahead_ns = chance(5) ? static_cast<std::int64_t>(random() % 10'000) * ms : 0;
        const FrameId frame{session[rig], next_id[rig]++};
        bench.send(rig, frame.first, frame.second, wall_clock_ns() - late_ns + ahead_ns, chance(10) ? 0 : 1);
        sent[frame] = rig;
      }
      if (chance(30)) std::this_thread::sleep_for(1ms);
    }
    bench.finish();
    const auto answered = answers(bench.results);
    CHECK(answered.size() == sent.size());
    for (const auto& [frame, count] : answered) {
      CHECK(sent.contains(frame));
      CHECK(count == 1);
    }
    std::array<std::uint64_t, 2> frames{};
    for (const auto& [frame, rig] : sent) ++frames[rig];
    const std::vector<WireRig> rigs = bench.pipeline->rigs();
    for (const std::size_t rig : {0u, 1u}) {
      CHECK(rigs[rig].counters.captured() == frames[rig]);
      CHECK(rigs[rig].counters.adds_up());
    }
    for (const WireResult& result : bench.results) {
      std::set<std::string> names;
      for (const WireRigFrame& frame : result.rigs) CHECK(names.insert(frame.rig).second);
    }
    CHECK(bench.results.back().counters.adds_up());
  }
}

TEST_CASE("a rig that floods its endpoint does not use up the other one's share of the queue") {
  PipelineConfig config = RigBench::two_rigs();
  config.queue_slots = 4;
  config.grouping.wait = 500ms;  // the flood waits for the other rig
  RigBench bench(config);
  const std::int64_t now = wall_clock_ns();
  for (std::uint64_t id = 0; id < 40; ++id) bench.send(1, 6, id, now + static_cast<std::int64_t>(id) * 10);
  for (std::uint64_t id = 0; id < 4; ++id) bench.send(0, 5, id, now + static_cast<std::int64_t>(id) * 10);
  bench.finish();
  const std::vector<WireRig> rigs = bench.pipeline->rigs();
  CHECK(rigs[0].counters.of(WireStatus::queue_full) == 0);
  CHECK(rigs[0].counters.captured() == 4);
  CHECK(rigs[1].counters.captured() == 40);
  CHECK(rigs[1].counters.adds_up());
}
