// lbea-serve as a process with the demo ensemble's model; frames and results in this process.
#include "adapters/rig/sensor_json.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <lbea/inference.hpp>

#include <doctest/doctest.h>

#include <fstream>
#include <map>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::contains;
using lbea::test::eventually;
using lbea::test::Process;
using lbea::test::text_of;

namespace {

class Bench {
 public:
  std::unique_ptr<Process> start(std::vector<std::string> arguments, const std::string& name = "serve") {
    arguments.insert(arguments.begin(), LBEA_SERVE);
    return std::make_unique<Process>(arguments, file(name + ".out"), file(name + ".err"));
  }
  std::unique_ptr<Process> serve(std::vector<std::string> more = {}, const std::string& name = "serve") {
    std::vector<std::string> arguments{LBEA_MODEL, "--frames", frames(), "--results", results(), "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto process = start(arguments, name);
    REQUIRE(eventually([&] { return contains(text_of(file(name + ".err")), "ready: frames on " + frames()); }));
    return process;
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder / name).string(); }
  [[nodiscard]] std::string frames() const { return "ipc://" + file("frames"); }
  [[nodiscard]] std::string results() const { return "ipc://" + file("results"); }

  test::TemporaryFolder folder;
};

/// Sends the model's own samples as frames: all nodes, in sensor coordinates.
class Camera {
 public:
  Camera(WireContext& context, const std::string& endpoint,
         const RigidTransform& T_reference_sensor = identity_transform)
      : sink_(context, endpoint), T_(T_reference_sensor) {
    REQUIRE(sink_.wait_ready(30s));
  }
  [[nodiscard]] std::span<const std::byte> encode(std::uint64_t id, std::uint32_t sample, float scale = 1) {
    const auto positions = model_.node_positions(sample);
    points_.clear();
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3)
      points_.push_back(seen({positions[i], positions[i + 1], positions[i + 2]}, scale));
    return encoder_.frame({id, 0, points_}, 1);
  }
  bool send(std::uint64_t id, std::uint32_t sample, std::chrono::milliseconds patience = 30s, float scale = 1) {
    return sink_.send(encode(id, sample, scale), patience);
  }
  /// Half of the points are 10 m away.
  bool send_torn(std::uint64_t id, std::uint32_t sample) {
    static_cast<void>(encode(id, sample));
    for (Point& p : std::span(points_).first(points_.size() / 2)) p.z += 10'000;
    return sink_.send(encoder_.frame({id, 0, points_}, 1), 30s);
  }
  bool end(std::uint64_t next_id) { return sink_.send(encoder_.end_of_stream(1, next_id), 30s); }
  [[nodiscard]] const Model& model() const { return model_; }
  [[nodiscard]] FrameSink& sink() { return sink_; }

 private:
  [[nodiscard]] Point seen(const Point& p, float scale) const {  // the inverse of the pose
    const float x = scale * (p.x - T_[3]), y = scale * (p.y - T_[7]), z = scale * (p.z - T_[11]);
    return {T_[0] * x + T_[4] * y + T_[8] * z, T_[1] * x + T_[5] * y + T_[9] * z, T_[2] * x + T_[6] * y + T_[10] * z};
  }

  Model model_ = Model::open(LBEA_MODEL);
  FrameSink sink_;
  RigidTransform T_;
  Encoder encoder_;
  std::vector<Point> points_;
};

void wait_for_state(ResultSource& source) {
  REQUIRE(eventually([&] {
    const auto message = source.receive(100ms);
    return message && message_kind(*message) == MessageKind::state;
  }));
}

WireResult next_result(ResultSource& source) {
  WireResult result;
  while (true) {
    const auto message = source.receive(30s);
    REQUIRE(message);
    if (decode_result(*message, result) == WireStatus::ok) return result;
  }
}

std::uint64_t number_after(const std::string& text, const std::string& key) {
  const auto at = text.find("\"" + key + "\":");
  REQUIRE(at != std::string::npos);
  return std::stoull(text.substr(at + key.size() + 3));
}

}  // namespace

TEST_CASE("a sample sent as a frame is found, by either method") {
  for (const std::string method : {"lbea", "vtp"}) {
    CAPTURE(method);
    Bench bench;
    const auto server = bench.serve({"--method", method, "--matches", "3"});
    WireContext context;
    ResultSource results(context, bench.results());
    Camera camera(context, bench.frames());
    wait_for_state(results);
    const std::uint32_t samples = camera.model().samples();
    std::uint64_t id = 0;
    for (const std::uint32_t sample : {0u, samples / 3, samples / 2, samples - 1}) {
      REQUIRE(camera.send(id, sample));
      const WireResult result = next_result(results);
      CHECK(result.frame_id == id++);
      REQUIRE(result.matches.size() == 3);
      // At time step 0 all runs are equal up to their imperfections; later they differ.
      if (sample > 0) CHECK(result.matches[0].sample == camera.model().sample(sample));
      CHECK(result.matches[0].simulation_name == camera.model().simulation_name(result.matches[0].sample.simulation));
      CHECK(result.matches[0].distance <= result.matches[1].distance);
      CHECK(result.counters.received == id);
      CHECK(result.model_checksum != 0);
    }
    server->signal(SIGINT);
    CHECK(server->wait() == 0);
    CHECK(contains(text_of(bench.file("serve.out")), "\"received\":4,\"matched\":4,\"rejected\":0,\"dropped\":0"));
  }
}

TEST_CASE("SIGTERM with frames in flight: every received frame is accounted for and published") {
  for (int round = 0; round < 3; ++round) {
    Bench bench;
    const auto server = bench.serve({"--queue", "4", "--matchers", std::to_string(1 + round)});
    WireContext context;
    ResultSource results(context, bench.results());
    Camera camera(context, bench.frames());
    wait_for_state(results);
    std::atomic<bool> stop = false;
    std::thread sender([&] {
      for (std::uint64_t id = 0; !stop; ++id) {
        camera.send(id, static_cast<std::uint32_t>(id % camera.model().samples()), 10ms);
        std::this_thread::sleep_for(500us);  // so that the results, of which none may be lost here, are kept up with
      }
    });
    std::map<Fate, std::uint64_t> heard;
    std::uint64_t next_matched = 0;
    const auto hear = [&](std::chrono::milliseconds timeout) {
      const auto message = results.receive(timeout);
      WireResult result;
      if (message && decode_result(*message, result) == WireStatus::ok) {
        ++heard[fate_of(result.status)];
        if (fate_of(result.status) == Fate::matched) {
          CHECK(result.frame_id >= next_matched);
          next_matched = result.frame_id + 1;
        }
      }
      return message.has_value();
    };
    for (int i = 0; i < 100 + 40 * round; ++i) hear(30s);
    server->signal(SIGTERM);
    while (server->is_running()) hear(10ms);
    const int code = server->wait();
    stop = true;
    sender.join();
    while (hear(300ms)) {}
    const std::string tally = text_of(bench.file("serve.out"));
    CAPTURE(tally);
    CHECK(contains(tally, "\"adds_up\":true"));
    CHECK(number_after(tally, "captured") ==
          number_after(tally, "matched") + number_after(tally, "rejected") + number_after(tally, "dropped"));
    CHECK(number_after(tally, "matched") == heard[Fate::matched]);
    CHECK(number_after(tally, "rejected") == heard[Fate::rejected]);
    CHECK(number_after(tally, "dropped") == heard[Fate::dropped]);
    CHECK((code == 0) == (number_after(tally, "dropped") == 0));
  }
}

TEST_CASE("the server continues after a sender is killed in mid-frame") {
  Bench bench;
  const auto server = bench.serve();
  WireContext context;
  ResultSource results(context, bench.results());
  wait_for_state(results);
  std::ofstream(bench.file("cloud.xyz")) << "1 2 3\n4 5 6\n";
  for (int round = 0; round < 3; ++round) {
    Process sender({LBEA_SEND, bench.file("cloud.xyz"), "--to", bench.frames(), "--loop", "0"}, bench.file("out"),
                   bench.file("err"));
    for (int i = 0; i < 100; ++i) static_cast<void>(next_result(results));
    sender.signal(SIGKILL);
    CHECK(sender.wait() == 128 + SIGKILL);
  }
  Camera camera(context, bench.frames());
  REQUIRE(camera.send(7'000'000, 1));
  CHECK(eventually([&] { return next_result(results).frame_id == 7'000'000; }));
  CHECK(server->is_running());
  server->signal(SIGTERM);
  static_cast<void>(server->wait());
  CHECK(contains(text_of(bench.file("serve.out")), "\"adds_up\":true"));
}

TEST_CASE("a second instance fails; after a kill -9 the next one starts") {
  Bench bench;
  const auto first = bench.serve();
  const auto second = bench.start({LBEA_MODEL, "--frames", bench.frames(), "--results", bench.results()}, "second");
  CHECK(second->wait() == 1);
  CHECK(contains(text_of(bench.file("second.err")), "in use by another process"));
  CHECK(first->is_running());
  first->signal(SIGKILL);
  CHECK(first->wait() == 128 + SIGKILL);
  const auto third = bench.serve({}, "third");
  WireContext context;
  ResultSource results(context, bench.results());
  Camera camera(context, bench.frames());
  wait_for_state(results);
  REQUIRE(camera.send(5, 1));
  CHECK(next_result(results).frame_id == 5);
  third->signal(SIGINT);
  CHECK(third->wait() == 0);
}

TEST_CASE("the inferred field is published for every frame, from the estimate's samples") {
  Bench bench;
  const std::string endpoint = "ipc://" + bench.file("inference");
  const auto server =
      bench.serve({"--method", "fit", "--pose", LBEA_SENSOR, "--infer", "plastic_strain", "--inference", endpoint});
  WireContext context;
  ResultSource results(context, bench.results()), inferences(context, endpoint);
  Camera camera(context, bench.frames(), read_pose(LBEA_SENSOR));
  wait_for_state(results);
  const Model& model = camera.model();
  std::map<std::uint64_t, WireFit> explained;
  WireInference inference;
  for (std::uint64_t id = 0; id < 200 && explained.size() < 3;
       ++id) {  // the first ones may come before the subscription does
    REQUIRE(camera.send(id, static_cast<std::uint32_t>(11 * id % model.samples())));
    const WireResult result = next_result(results);
    const auto message = inferences.receive(id == 0 ? 1s : 100ms);
    if (!message) continue;
    REQUIRE(decode_inference(*message, inference) == WireStatus::ok);
    REQUIRE(inference.frame_id == result.frame_id);
    explained[result.frame_id] = result.fit;
    CHECK(inference.sequence == result.frame_id + 1);
    CHECK(inference.field == "plastic_strain");
    CHECK(inference.model_checksum == model.checksum());
    Inferred expected;
    infer_field(model, 0, result.fit.view(), expected);
    CHECK(inference.values == expected.mean);
    CHECK(inference.spread == expected.spread);
    CHECK(inference.bound_90 == expected.bound_90);
    CHECK(inference.values.size() == model.elements());
  }
  CHECK(explained.size() == 3);
}

TEST_CASE("frames in m for a model in mm: every frame was rejected, without a sentence and with exit code 0") {
  Bench bench;
  const auto server = bench.serve({"--pose", LBEA_SENSOR, "--queue", "32"});
  WireContext context;
  {
    Camera camera(context, bench.frames(), read_pose(LBEA_SENSOR));
    for (std::uint64_t id = 0; id < 21; ++id) REQUIRE(camera.send(id, 5, 30s, 1e-3f));
    REQUIRE(camera.end(21));
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  }
  server->signal(SIGINT);
  CHECK(server->wait() == 1);
  CHECK(number_after(text_of(bench.file("serve.out")), "rejected") == 21);
  CHECK(contains(text_of(bench.file("serve.err")),
                 "21 frames came, and none of their points is near any simulation; are they in mm"));
}

TEST_CASE("a sensor.json in m was taken for a model in mm") {
  Bench bench;
  std::string text = text_of(LBEA_SENSOR);
  text.replace(text.find("\"mm\""), 4, "\"m\"");
  std::ofstream(bench.file("sensor.json")) << text;
  for (const char* check : {"--check", "--json"}) {
    const auto server = bench.start({LBEA_MODEL, "--frames", bench.frames(), "--results", bench.results(), "--pose",
                                     bench.file("sensor.json"), check});
    CHECK(server->wait() == 1);
    CHECK(contains(text_of(bench.file("serve.out")) + text_of(bench.file("serve.err")),
                   "\"length_unit\" is \"m\", but the model's lengths are in \"mm\""));
  }
}

// Regression: a rail whose front half moved away was matched with 100 %; the log of the matcher said nothing.
TEST_CASE("a part that leaves the space of the simulations is logged") {
  Bench bench;
  const auto server = bench.serve();
  WireContext context;
  Camera camera(context, bench.frames());
  for (std::uint64_t id = 0; id < 2; ++id) REQUIRE(camera.send(id, 0));
  REQUIRE(camera.send_torn(2, 0));
  REQUIRE(camera.end(3));
  REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
  server->signal(SIGINT);
  CHECK(server->wait() == 0);
  const std::string log = text_of(bench.file("serve.err"));
  CHECK(contains(log, "frame 2: more points than in the first frame are near no simulation, 50 %"));
  CHECK_FALSE(contains(log, "frame 1: more points"));
}

// Regression: a time of impact in another unit or clock only caused wrong matches.
TEST_CASE("a stamp that is far from --trigger-ns is logged once per sender") {
  for (const bool is_far : {false, true}) {
    Bench bench;
    const auto server = bench.serve({"--trigger-ns", is_far ? "1700000000000000" : "1000000"});
    WireContext context;
    Camera camera(context, bench.frames());
    for (std::uint64_t id = 0; id < 3; ++id) REQUIRE(camera.send(id, 5));
    REQUIRE(camera.end(3));
    REQUIRE(eventually([&] { return contains(text_of(bench.file("serve.err")), "end of stream"); }));
    server->signal(SIGINT);
    CHECK(server->wait() == 0);
    const std::string log = text_of(bench.file("serve.err"));
    CHECK(contains(log, "frame 0: its stamp is 1.7e+06 s before --trigger-ns") == is_far);
    CHECK_FALSE(contains(log, "frame 1: its stamp"));
  }
}

// Regression: a model with depth images was matched by lbea, without verdict, unless the user knew --method fit.
TEST_CASE("the method is fit by default when the model has depth images for the pose") {
  for (const bool has_images : {true, false}) {
    CAPTURE(has_images);
    Bench bench;
    std::vector<std::string> options;
    if (has_images) options = {"--pose", LBEA_SENSOR};
    const auto server = bench.serve(options);
    WireContext context;
    ResultSource results(context, bench.results());
    WireState state;
    REQUIRE(eventually([&] {
      const auto message = results.receive(100ms);
      return message && decode_state(*message, state) == WireStatus::ok;
    }));
    CHECK(state.method == (has_images ? "fit" : "lbea"));
    CHECK(contains(text_of(bench.file("serve.err")), "no verdict; see --method fit") == !has_images);
    server->signal(SIGINT);
    CHECK(server->wait() == 0);
  }
}

TEST_CASE("errors are reported in a sentence") {
  Bench bench;
  const auto fails = [&](const std::vector<std::string>& arguments, int code, const std::string& sentence) {
    CAPTURE(sentence);
    CHECK(bench.start(arguments)->wait() == code);
    const std::string said = text_of(bench.file("serve.err"));
    CAPTURE(said);
    CHECK(contains(said, sentence));
  };
  const std::string frames = bench.frames(), results = bench.results();
  fails({}, 2, "model");
  fails({LBEA_MODEL, "--frames", frames}, 2, "--results");
  fails({LBEA_MODEL, "--frames", frames, "--results", results, "--method", "icp"}, 2, "--method");
  fails({LBEA_MODEL, "--frames", frames, "--results", results, "--queue", "0"}, 2, "--queue");
  fails({LBEA_MODEL, "--frames", frames, "--results", results, "--min-coverage", "1.5"}, 2, "--min-coverage");
  fails({"/no/such.lbea", "--frames", frames, "--results", results}, 1, "/no/such.lbea");
  fails({LBEA_SERVE, "--frames", frames, "--results", results}, 1, LBEA_SERVE);
  fails({LBEA_MODEL, "--frames", "tcp://0.0.0.0:5555", "--results", results}, 1, "use 127.0.0.1 instead of 0.0.0.0");
  fails({LBEA_MODEL, "--frames", frames, "--results", frames}, 2,
        "--frames and --results are both \"" + frames);  // not another process
  for (const char* none : {"nan", "inf", "-NAN"})
    fails({LBEA_MODEL, "--frames", frames, "--results", results, "--min-coverage", none}, 2, "--min-coverage");
  fails({LBEA_MODEL, "--frames", frames, "--results", results, "--trusted-distance", "inf"}, 2, "--trusted-distance");
  fails({LBEA_MODEL, "--frames", frames, "--results", results, "--infer", "plastic_strain"}, 2, "--inference");
  const auto infer = [&](const std::string& method, const std::string& field, const std::string& sentence) {
    fails({LBEA_MODEL, "--frames", frames, "--results", results, "--method", method, "--pose", LBEA_SENSOR, "--infer",
           field, "--inference", "ipc://" + bench.file("inference")},
          1, sentence);
  };
  infer("lbea", "plastic_strain", "--method fit");
  infer("fit", "temperature", "it has plastic_strain");
  CHECK(bench.start({"--help"})->wait() == 0);
  CHECK(contains(text_of(bench.file("serve.out")), "exit code is 1 when any"));
  CHECK(bench.start({"--version"})->wait() == 0);
}
