// lbea-serve with two rigs, and their cameras, which send what the demo's rig measures of a run.
#pragma once

#include "adapters/clouds/point_cloud.hpp"
#include "tests/mcap/bench.hpp"

namespace lbea::test {

/// What the demo's rig measures of a run that is not in the model, state by state.
struct Measured {
  Measured() {
    const TemporaryFolder folder;
    const Outcome outcome =
        run_program(LBEA_SENSE " " LBEA_TEST_DATA "/rail-demo/experiment/run_043 --out frames --sensor " + rail_pose,
                    folder.path());
    REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
    for (std::size_t step = 0; step < states; ++step) {
      const std::string digits = std::to_string(step);
      const auto file = folder / ("frames/frame_" + std::string(5 - digits.size(), '0') + digits + ".ply");
      clouds.push_back(io::read_point_cloud(file).points);
    }
  }
  static constexpr std::size_t states = 21;
  std::vector<std::vector<Point>> clouds;
};

inline const std::vector<std::vector<Point>>& clouds() {
  static const Measured measured;
  return measured.clouds;
}

class RigCamera {
 public:
  RigCamera(WireContext& context, const std::string& endpoint, std::uint64_t session)
      : sink_(context, endpoint), session_(session) {
    REQUIRE(sink_.wait_ready(30s));
  }
  void send(const std::vector<Point>& points, std::int64_t stamp_ns) {
    REQUIRE(sink_.send(encoder_.frame({next_id_++, stamp_ns, points}, session_), 30s));
  }
  /// Another cloud with the id of the latest frame.
  void repeat_id(const std::vector<Point>& points, std::int64_t stamp_ns) {
    --next_id_;
    send(points, stamp_ns);
  }
  void say_hello() { REQUIRE(sink_.tell(encoder_.control({session_, ControlKind::hello, next_id_, 0}), 30s)); }
  void end() { REQUIRE(sink_.send(encoder_.end_of_stream(session_, next_id_), 30s)); }
  /// The sender program ends without goodbye, and another one begins.
  void restart() {
    ++session_;
    next_id_ = 0;
  }

 private:
  FrameSink sink_;
  std::uint64_t session_, next_id_ = 0;
  Encoder encoder_;
};

/// A plate where the component is.
inline std::vector<Point> other_component() {
  std::vector<Point> points = clouds().front();
  for (Point& point : points) point = {point.x, point.y, points.front().z};
  return points;
}

class Rigs {
 public:
  explicit Rigs(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{LBEA_SERVE,
                                       LBEA_MODEL,
                                       "--frames",
                                       "left=" + left(),
                                       "--frames",
                                       "right=" + right(),
                                       "--pose",
                                       "left=" + rail_pose,
                                       "--pose",
                                       "right=" + rail_pose,
                                       "--results",
                                       bench.results(),
                                       "--json",
                                       "--record",
                                       bench.file("run.mcap"),
                                       "--wait-us",
                                       "1000000",
                                       "--queue",
                                       "64"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    server = bench.start(arguments, "serve", "ready: frames of left on " + left());
    source.emplace(context, bench.results());
    REQUIRE(source->receive(30s));
  }
  [[nodiscard]] std::string left() const { return "ipc://" + bench.file("left"); }
  [[nodiscard]] std::string right() const { return "ipc://" + bench.file("right"); }
  /// The next result with this property.
  template <class Property>
  WireResult next(const Property& is_wanted) {
    WireResult result;
    for (const auto begin = std::chrono::steady_clock::now(); std::chrono::steady_clock::now() - begin < 30s;) {
      const auto message = source->receive(100ms);
      if (message && decode_result(*message, result) == WireStatus::ok && is_wanted(result)) return result;
    }
    FAIL("no result");
    return result;
  }
  /// Of the capture with this frame of the left rig.
  WireResult next_of(std::size_t left_frame) {
    return next([&](const WireResult& result) {
      return !result.rigs.empty() && result.rigs[0].rig == "left" && result.rigs[0].frame_id == left_frame;
    });
  }
  void receive_end() {
    static_cast<void>(next([](const WireResult& result) {
      return result.status == WireStatus::end_of_stream && result.session == ~std::uint64_t{1};
    }));
  }

  Bench bench;
  WireContext context;
  std::unique_ptr<Process> server;
  std::optional<ResultSource> source;
};

inline std::vector<std::string> used(const WireResult& result) {
  std::vector<std::string> names;
  for (const WireRigFrame& frame : result.rigs)
    if (frame.is_used) names.push_back(frame.rig);
  return names;
}

using Names = std::vector<std::string>;
inline constexpr std::size_t states = Measured::states;
inline constexpr std::int64_t between_states_ns = 750'000;

}  // namespace lbea::test
