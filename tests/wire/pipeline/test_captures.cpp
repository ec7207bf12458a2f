// Frames of several rigs through the pipeline, with a fake matcher: each is answered once and counted once.
#include "tools/serve/pipeline/pipeline.hpp"

#include "tests/support/test_data.hpp"
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

namespace {

/// Its capture has the time of its first rig's frame. A frame's first point has its id as x.
class FakeRigs final : public RigEngine {
 public:
  void match_alone(std::size_t rig, const Frame& frame) noexcept override {
    results_[rig] = {};
    results_[rig].points.received = static_cast<std::uint32_t>(frame.points.size());
    results_[rig].status = frame.points.empty() ? Status::empty_frame : Status::ok;
    results_[rig].is_used = !frame.points.empty();
    results_[rig].coverage = frame.points.empty() ? 0 : frame.points[0].x;
    stamps_ns_[rig] = frame.stamp_ns;
  }
  MatchResult combine() noexcept override {
    MatchResult result;
    const auto first = std::ranges::find_if(stamps_ns_, [](const auto& stamp) { return stamp.has_value(); });
    if (first != stamps_ns_.end()) result.stamp_ns = **first;
    stamps_ns_ = {};
    return result;
  }
  [[nodiscard]] std::span<const RigResult> rigs() const noexcept override { return results_; }
  [[nodiscard]] std::string_view simulation_name(std::uint32_t) const noexcept override { return "run"; }
  [[nodiscard]] double time_s(Sample) const noexcept override { return 0; }

 private:
  std::array<RigResult, 2> results_{};  // like the stamps, each written by its rig's thread
  std::array<std::optional<std::int64_t>, 2> stamps_ns_{};
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
        const std::int64_t late_ns = chance(10) ? static_cast<std::int64_t>(random() % 300) * 1'000'000 : 0;
        const std::int64_t ahead_ns = chance(5) ? static_cast<std::int64_t>(random() % 10'000) * 1'000'000 : 0;
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
