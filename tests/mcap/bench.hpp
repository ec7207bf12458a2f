// A matcher that records and a camera that sends it samples of the model. Uses real programs, sockets and files.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/support/program.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <doctest/doctest.h>
#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <optional>

namespace lbea::test {

using namespace lbea::tool;
using namespace lbea::wire;

using namespace std::chrono_literals;
using Json = nlohmann::json;

/// Programs that start during its life run on a system that differs from this one as `variable` says; see
/// other_system.cpp.
class OtherSystem {
 public:
  OtherSystem(const char* variable, const std::string& value) : variable_(variable) {
    ::setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 1);  // under the address sanitizer, its library is not first
    ::setenv("LD_PRELOAD", LBEA_OTHER_SYSTEM, 1);
    ::setenv(variable, value.c_str(), 1);
  }
  ~OtherSystem() {
    for (const char* variable : {"ASAN_OPTIONS", "LD_PRELOAD", variable_}) ::unsetenv(variable);
  }
  OtherSystem(const OtherSystem&) = delete;
  OtherSystem& operator=(const OtherSystem&) = delete;

 private:
  const char* variable_;
};

class Bench {
 public:
  std::unique_ptr<Process> start(std::vector<std::string> arguments, const std::string& name,
                                 const std::string& ready) {
    std::filesystem::remove(
        file(name + ".err"));  // otherwise the log of the last process would look like that of a ready one
    auto process = std::make_unique<Process>(arguments, file(name + ".out"), file(name + ".err"));
    REQUIRE(eventually([&] { return contains(text_of(file(name + ".err")), ready); }));
    return process;
  }
  std::unique_ptr<Process> serve(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{LBEA_SERVE, LBEA_MODEL,        "--frames", frames(),  "--results", results(),
                                       "--json",   "--record-memory", "16",       "--queue", "128"};
    // The queue's memory is allocated at the start: of the default size it takes a second.
    if (std::ranges::find(more, "--max-points") == more.end())
      arguments.insert(arguments.end(), {"--max-points", "32768"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return start(arguments, "serve", "ready: frames on " + frames());
  }
  /// lbea-record without a matcher, into `name`, from `endpoint`.
  std::unique_ptr<Process> record(const std::string& name, const std::string& endpoint) {
    return start({LBEA_RECORD, file(name), "--frames", endpoint, "--record-memory", "16", "--json"}, "record",
                 "ready: frames on");
  }
  /// Records run.mcap with lbea-record alone, or with lbea-serve.
  std::unique_ptr<Process> record_run(bool alone) {
    return alone ? record("run.mcap", frames()) : serve({"--record", file("run.mcap")});
  }
  Json inspect(const std::string& name, int exit_code) const {
    const Outcome outcome = run_program(LBEA_INSPECT " " + name + " --json", folder.path());
    CAPTURE(outcome.err);
    CHECK(outcome.exit_code == exit_code);
    return Json::parse(outcome.out);
  }
  Outcome replay(const std::string& arguments) const { return run_program(LBEA_REPLAY " " + arguments, folder.path()); }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder / name).string(); }
  [[nodiscard]] std::string frames() const { return "ipc://" + file("frames"); }
  [[nodiscard]] std::string results() const { return "ipc://" + file("results"); }
  TemporaryFolder folder;
};

/// Where the sensor of the demo is.
inline const std::string rail_pose = LBEA_TEST_DATA "/rail-demo/sensor.json";

/// Sends samples of the model as frames: all nodes, in reference coordinates.
class Camera {
 public:
  Camera(WireContext& context, const std::string& endpoint) : sink_(context, endpoint) {
    REQUIRE(sink_.wait_ready(30s));
  }
  /// Frames are in sensor coordinates from now on.
  void look_from(const std::string& sensor_json) {
    const Json pose = Json::parse(text_of(sensor_json));
    for (const Json& row : pose["T_reference_sensor"])
      for (const Json& value : row) T_reference_sensor_.push_back(value.get<double>());
  }
  void send(std::uint64_t id, std::uint64_t session = 1) {
    const auto positions = model_.node_positions(static_cast<std::uint32_t>(id % model_.samples()));
    points_.clear();
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3)
      points_.push_back(seen({positions[i], positions[i + 1], positions[i + 2]}));
    send_bytes(encoder_.frame({id, static_cast<std::int64_t>(1000 + id), points_}, session));
  }
  void send_bytes(std::span<const std::byte> bytes) { REQUIRE(sink_.send(bytes, 30s)); }
  void end(std::uint64_t next_id, std::uint64_t session = 1) { send_bytes(encoder_.end_of_stream(session, next_id)); }
  Encoder& encoder() { return encoder_; }

 private:
  [[nodiscard]] Point seen(const Point& reference) const {
    const auto& T = T_reference_sensor_;
    if (T.empty()) return reference;
    const double x = reference.x - T[3], y = reference.y - T[7], z = reference.z - T[11];
    const auto along = [&](std::size_t axis) {
      return static_cast<float>(T[axis] * x + T[axis + 4] * y + T[axis + 8] * z);
    };
    return {along(0), along(1), along(2)};
  }
  Model model_ = Model::open(LBEA_MODEL);
  std::vector<double> T_reference_sensor_;
  FrameSink sink_;
  Encoder encoder_;
  std::vector<Point> points_;
};

/// The recording in the state of lbea-serve, once it has this phase.
inline std::optional<WireRecording> recording_in(RecordingPhase phase, WireContext& context,
                                                 const std::string& results) {
  ResultSource source(context, results);
  WireState state;
  for (const auto begin = std::chrono::steady_clock::now(); std::chrono::steady_clock::now() - begin < 30s;) {
    const auto message = source.receive(100ms);
    if (message && decode_state(*message, state) == WireStatus::ok &&
        (!state.recording || state.recording->phase == phase))
      return state.recording;
  }
  return {};
}

/// Interrupts a program and returns its exit code.
inline int stop(Process& process) {
  process.signal(SIGINT);
  return process.wait();
}

/// Records `frames` frames of the demo into `name`.
inline void record(Bench& bench, const std::string& name, std::uint64_t frames, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"--record", bench.file(name)});
  const auto server = bench.serve(more);
  WireContext context;
  Camera camera(context, bench.frames());
  if (const auto pose = std::ranges::find(more, "--pose"); pose != more.end()) camera.look_from(*(pose + 1));
  for (std::uint64_t id = 0; id < frames; ++id) camera.send(id);
  camera.end(frames);
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  CHECK(stop(*server) == 0);
}

}  // namespace lbea::test
