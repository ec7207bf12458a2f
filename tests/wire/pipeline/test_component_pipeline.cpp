// The pipeline with several components and fake matchers: results in order, each frame counted once.
#include "tools/serve/reports.hpp"

#include "tests/support/test_data.hpp"
#include "tests/wire/pipeline/fake_engine.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <map>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::eventually;
using lbea::test::FakeEngine;

namespace {

/// Of each frame, component c is matched, has low coverage or nothing as the digits of the first point's x say: 0,
/// 1, 2.
class FakeComponents final : public ComponentEngine {
 public:
  [[nodiscard]] std::size_t components() const noexcept override { return 2; }
  [[nodiscard]] TestEngine& test(std::size_t component) noexcept override { return engines_[component]; }
  MatchResult match(const Frame& frame, std::size_t component) noexcept override {
    const int digits = static_cast<int>(frame.points.front().x), digit = component == 0 ? digits / 10 : digits % 10;
    if (component == 0) std::this_thread::sleep_for(2ms);  // the first one is the slower one
    MatchResult result = engines_[component].match(frame, 0);
    result.status = digit == 0 ? Status::ok : digit == 1 ? Status::low_coverage : Status::empty_frame;
    result.elapsed_ns = {.index = component == 0 ? 5'000'000u : 1u};
    return result;
  }
  void track_all(std::span<const MatchResult> results) noexcept override {
    ++tracked;
    if (results.size() != 2) tracked = 1'000'000;
  }
  void begin_test() noexcept override { ++tests; }

  std::atomic<int> tracked{0}, tests{0};

 private:
  std::array<FakeEngine, 2> engines_;
};

PipelineConfig two_components() {
  PipelineConfig config;
  config.limits.max_points = 10;
  config.queue_slots = 64;
  config.state_interval = 20ms;
  config.components = {{"hood", 11}, {"fender", 22}};
  config.description.components = {{"hood", {}}, {"fender", {}}};
  config.description.model.checksum = 11;
  return config;
}

class ComponentBench {
 public:
  ComponentBench()
      : source_(context_, "ipc://" + (folder_ / "frames").string(), WireLimits{.max_points = 10}),
        sink_(context_, "ipc://" + (folder_ / "results").string()),
        sender(context_, source_.endpoint()),
        subscriber_(context_, sink_.endpoint()),
        pipeline(two_components(), engine, std::move(source_), std::move(sink_)) {
    REQUIRE(sender.wait_ready(30s));
    REQUIRE(eventually([&] { return subscriber_.receive(10ms).has_value(); }));
  }
  void send(std::uint64_t id, float digits, std::size_t points = 3, std::uint64_t session = 1) {
    const std::vector<Point> cloud(points, Point{digits, 0, 0});
    REQUIRE(sender.send(encoder.frame({id, static_cast<std::int64_t>(id) * 1'000'000, cloud}, session), 30s));
  }
  /// Until the results end with an end of stream.
  void receive() {
    WireResult result;
    do {
      const auto message = subscriber_.receive(30s);
      REQUIRE(message);
      if (message_kind(*message) != MessageKind::result) continue;
      REQUIRE(decode_result(*message, result) == WireStatus::ok);
      results.push_back(result);
    } while (results.empty() || results.back().status != WireStatus::end_of_stream);
  }

 private:
  test::TemporaryFolder folder_;
  WireContext context_;
  FrameSource source_;
  ResultSink sink_;

 public:
  FakeComponents engine;
  Encoder encoder;
  FrameSink sender;
  std::vector<WireResult> results;

 private:
  ResultSource subscriber_;

 public:
  Pipeline pipeline;
};

}  // namespace

TEST_CASE("each frame has a result of each component, in order, and is counted once, with the best of their statuses") {
  ComponentBench bench;
  const std::array<std::pair<float, WireStatus>, 7> frames{{{0, WireStatus::ok},
                                                            {2, WireStatus::ok},
                                                            {20, WireStatus::ok},
                                                            {11, WireStatus::low_coverage},
                                                            {12, WireStatus::low_coverage},
                                                            {21, WireStatus::low_coverage},
                                                            {22, WireStatus::empty_frame}}};
  for (std::uint64_t id = 0; id < frames.size(); ++id) bench.send(id, frames[id].first);
  bench.send(frames.size(), 0, 11);  // too many points: no component gets it
  REQUIRE(bench.sender.send(bench.encoder.end_of_stream(1, frames.size() + 1), 30s));
  bench.receive();
  bench.pipeline.stop();
  std::vector<WireResult> of_components;
  std::ranges::copy_if(bench.results, std::back_inserter(of_components),
                       [](const WireResult& result) { return !result.component.empty(); });
  REQUIRE(of_components.size() == 2 * frames.size());
  for (std::size_t i = 0; i < of_components.size(); ++i) {
    CHECK(of_components[i].frame_id == i / 2);
    CHECK(of_components[i].component == (i % 2 == 0 ? "hood" : "fender"));
    CHECK(of_components[i].model_checksum == (i % 2 == 0 ? 11 : 22));
    CHECK(of_components[i].counters.captured() >= i / 2 + 1);
  }
  CHECK(bench.results.size() == of_components.size() + 2);
  for (const WireResult& result : bench.results)
    if (result.component.empty()) CHECK(result.model_checksum == 0);
  const Counters counters = bench.pipeline.counters();
  std::map<WireStatus, std::uint64_t> expected{{WireStatus::too_many_points, 1}};
  for (const auto& [digits, status] : frames) ++expected[status];
  for (const auto& frames_of : expected)
    CHECK_MESSAGE(counters.of(frames_of.first) == frames_of.second, to_string(frames_of.first));
  CHECK(counters.adds_up());
  CHECK(bench.engine.tracked == static_cast<int>(frames.size()));
  CHECK(bench.engine.tests == 1);
}

TEST_CASE(
    "an end of stream ends the test of all components; a frame's time in the matcher is that of the slowest one") {
  ComponentBench bench;
  bench.send(0, 0);
  REQUIRE(bench.sender.send(bench.encoder.end_of_stream(1, 1), 30s));
  bench.receive();
  bench.send(1, 0);
  bench.send(0, 0, 3, 2);
  REQUIRE(bench.sender.send(bench.encoder.end_of_stream(2, 1), 30s));
  bench.receive();
  bench.pipeline.stop();
  CHECK(bench.engine.tests == 3);
  CHECK(bench.pipeline.match_times().sum_s() == doctest::Approx(3 * 0.005).epsilon(1e-3));
  const std::string page = metrics_page(bench.pipeline);
  CHECK(page.find("lbea_match_seconds_count 3") != std::string::npos);
}
