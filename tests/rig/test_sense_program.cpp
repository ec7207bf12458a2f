// The program lbea-sense, from the command line.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "tests/support/program.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

/// One recording in a separate folder.
struct Sensing {
  TemporaryFolder scratch;
  std::filesystem::path run = data() / "rail-demo" / "experiment" / "run_043";
  std::filesystem::path sensor = data() / "rail-demo" / "sensor.json";
  std::filesystem::path out = scratch / "frames";

  [[nodiscard]] std::string command(const std::string& flags) const {
    return std::string(LBEA_SENSE) + " '" + run.string() + "' --sensor '" + sensor.string() + "' --out '" +
           out.string() + "' " + flags;
  }
  [[nodiscard]] Process start(const std::string& flags) const {
    return Process({"/bin/sh", "-c", "exec " + command(flags)}, scratch / "stdout", scratch / "stderr");
  }
  int operator()(const std::string& flags) const { return start(flags).wait(); }
  [[nodiscard]] std::string printed() const { return text_of(scratch / "stdout"); }
  [[nodiscard]] std::string complaint() const { return text_of(scratch / "stderr"); }
  [[nodiscard]] std::vector<std::string> files() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(out)) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }
  [[nodiscard]] PointCloud frame(const std::string& name) const { return read_point_cloud(out / name); }

  /// truth.csv, a map from column to value per row.
  [[nodiscard]] std::vector<std::map<std::string, std::string>> truth() const {
    std::ifstream in(out / "truth.csv");
    std::string line;
    std::vector<std::string> columns;
    std::vector<std::map<std::string, std::string>> rows;
    while (std::getline(in, line)) {
      std::istringstream cells(line);
      std::vector<std::string> values;
      for (std::string cell; std::getline(cells, cell, ',');) values.push_back(cell);
      if (columns.empty()) {
        columns = values;
        continue;
      }
      REQUIRE(values.size() == columns.size());
      auto& row = rows.emplace_back();
      for (std::size_t i = 0; i < columns.size(); ++i) row[columns[i]] = values[i];
    }
    return rows;
  }
};

bool same(const std::vector<Point>& a, const std::vector<Point>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Point)) == 0;
}

}  // namespace

TEST_CASE("a recording is complete: frames, stamps, truth, sensor") {
  const Sensing sense;
  REQUIRE(sense("--steps 2:10:4") == 0);
  CHECK(sense.files() ==
        std::vector<std::string>{"frame_00000.ply", "frame_00001.ply", "frame_00002.ply", "sensor.json", "truth.csv"});
  CHECK(sense.printed().starts_with("3 frames, "));
  CHECK(text_of(sense.out / "truth.csv").starts_with("frame,file,stamp_ns,run,state,time_s\n"));
  const auto rows = sense.truth();
  REQUIRE(rows.size() == 3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    auto row = rows[i];
    CHECK(row["frame"] == std::to_string(i));
    CHECK(row["state"] == std::to_string(2 + 4 * i));
    CHECK(std::filesystem::path(row["run"]).is_absolute());
    CHECK(std::filesystem::equivalent(row["run"], sense.run));
    const PointCloud cloud = sense.frame(row["file"]);
    CHECK(cloud.stamp_ns.value_or(-1) == std::stoll(row["stamp_ns"]));
    CHECK(std::stod(row["time_s"]) * 1e9 == doctest::Approx(std::stod(row["stamp_ns"])).epsilon(1e-6));
    CHECK(cloud.points.size() > 50000);
  }
  const auto before = read_sensor_json(sense.sensor), after = read_sensor_json(sense.out / "sensor.json");
  CHECK(after.sensor.T_reference_sensor == before.sensor.T_reference_sensor);
  CHECK(after.sensor.T_reference_right == before.sensor.T_reference_right);
  CHECK(after.sensor.focal_px == before.sensor.focal_px);
  CHECK(after.noise.sigma == before.noise.sigma);
  CHECK(after.length_unit == before.length_unit);
}

TEST_CASE("the same seed gives the same frames, and every frame has different noise") {
  const Sensing one, two, other;
  REQUIRE(one("--steps 0:1 --scale 0.3 --seed 9") == 0);
  REQUIRE(two("--steps 0:1 --scale 0.3 --seed 9") == 0);
  REQUIRE(other("--steps 0:1 --scale 0.3 --seed 10") == 0);
  CHECK(text_of(one.out / "frame_00001.ply") == text_of(two.out / "frame_00001.ply"));
  CHECK_FALSE(same(one.frame("frame_00001.ply").points, other.frame("frame_00001.ply").points));
}

TEST_CASE("resolution and noise of the command line are used and recorded") {
  const Sensing plain, changed;
  REQUIRE(plain("--steps 4 --scale 0.5 --noise 0 --outliers 0") == 0);
  REQUIRE(changed("--steps 4 --scale 0.5 --noise 0.4 --outliers 0 --dropout 0.5 --background 0.1") == 0);
  const auto clean = static_cast<double>(plain.frame("frame_00000.ply").points.size());
  const auto noisy = static_cast<double>(changed.frame("frame_00000.ply").points.size());
  CHECK(clean > 10000);
  CHECK(clean < 30000);
  CHECK(noisy > 0.48 * clean);
  CHECK(noisy < 0.58 * clean);
  const auto described = read_sensor_json(changed.out / "sensor.json");
  CHECK(described.sensor.width_px == 360);
  CHECK(described.sensor.height_px == 150);
  CHECK(described.sensor.focal_px == 675);
  CHECK(described.noise.sigma == 0.4f);
  CHECK(described.noise.outliers == 0);
  CHECK(described.noise.dropout == 0.5f);
  CHECK(described.noise.background == 0.1f);
}

TEST_CASE("a rate makes frames at equal distances in time between the stored states") {
  const Sensing sense;
  REQUIRE(sense("--rate 4000 --frames 7 --scale 0.2 --json") == 0);
  const auto rows = sense.truth();
  REQUIRE(rows.size() == 7);
  for (std::size_t i = 0; i < rows.size(); ++i) CHECK(rows[i].at("stamp_ns") == std::to_string(250'000 * i));
  const double state = std::stod(rows[2].at("state"));
  CHECK(state > 0);
  CHECK(state < 1);  // the run stores a state per 0.75 ms
  CHECK(sense.printed().find("\"frames\":7") != std::string::npos);
}

TEST_CASE("a file of a numbered series stands for all of them, as is said, or for itself") {
  Sensing sense;
  for (int i = 1; i <= 3; ++i)
    std::ofstream(sense.scratch / ("shape" + std::to_string(i) + ".obj"))
        << "v 0 0 0\nv 100 0 " << i << "\nv 100 100 0\nv 0 100 0\nf 1 2 3 4\n";
  sense.run = sense.scratch / "shape2.obj";
  REQUIRE(sense("") == 0);
  CHECK(sense.truth().size() == 3);
  CHECK_MESSAGE(sense.complaint().find("shape3.obj are read as the states of one run") != std::string::npos,
                sense.complaint());
  sense.out = sense.scratch / "alone";
  REQUIRE(sense("--single-file") == 0);
  CHECK(sense.truth().size() == 1);
  CHECK(sense.complaint() == "");
}

TEST_CASE("usage errors and failures have different exit codes") {
  const Sensing sense;
  for (const std::string flags : {"--steps 3:1", "--steps x", "--scale 0", "--rate -1", "--frames 0", "--noise -1",
                                  "--outliers 1.5", "--no-such-flag", "extra"}) {
    CAPTURE(flags);
    CHECK(sense(flags) == 2);
    CHECK_FALSE(std::filesystem::exists(sense.out));
  }
  // The greatest number, of 309 digits, was named as the limit.
  CHECK(sense("--scale 0") == 2);
  CHECK(sense.complaint().starts_with("--scale: 0 is not a number greater than 0\n"));
  CHECK(sense("--noise -1") == 2);
  CHECK(sense.complaint().starts_with("--noise: -1 is not a number of at least 0\n"));
  CHECK(sense("--help") == 0);
  CHECK(sense.printed().find("Example") != std::string::npos);
  CHECK(sense("--version") == 0);
}

TEST_CASE("missing and conflicting files are named in one sentence, and nothing is left behind") {
  Sensing sense;
  const auto check_fails = [&](const std::string& flags, const std::string& names) {
    CAPTURE(names);
    CHECK(sense(flags) == 1);
    const std::string complaint = sense.complaint();
    CHECK(complaint.starts_with("lbea-sense: error: "));
    CHECK(std::count(complaint.begin(), complaint.end(), '\n') == 1);
    CHECK(complaint.find(names) != std::string::npos);
    CHECK_FALSE(std::filesystem::exists(sense.out));
  };
  check_fails("--steps 2:100", "100");
  check_fails("--scale 1e-9", "scale");
  SUBCASE("run") { check_fails("", (sense.run = sense.scratch / "no_run").string()); }
  SUBCASE("sensor") { check_fails("", (sense.sensor = sense.scratch / "no.json").string()); }
  SUBCASE("folder") {
    REQUIRE(sense("--steps 0 --scale 0.1") == 0);
    const std::string truth = text_of(sense.out / "truth.csv");
    CHECK(sense("--steps 1 --scale 0.1") == 1);
    CHECK(sense.complaint().find("already holds a recording") != std::string::npos);
    CHECK(text_of(sense.out / "truth.csv") == truth);
  }
}

TEST_CASE("after Ctrl-C the written frames are complete and have their truth") {
  const Sensing sense;
  Process process = sense.start("--rate 1000000 --scale 0.2");
  const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!std::filesystem::exists(sense.out / "frame_00003.ply") && std::chrono::steady_clock::now() < patience)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  process.signal(SIGINT);
  CHECK(process.wait() == 1);
  CHECK(sense.complaint().find("stopped after ") != std::string::npos);
  const auto rows = sense.truth();
  CHECK(rows.size() >= 4);
  CHECK(sense.files().size() == rows.size() + 2);
  for (const auto& row : rows) CHECK(sense.frame(row.at("file")).points.size() > 500);
}

TEST_CASE("Ctrl-C was ignored while the run was surveyed") {
  Sensing sensing;
  sensing.run = sensing.scratch / "large.obj";
  std::string text;
  for (int i = 0; i < 400'000; ++i)
    text += "v 0.00000" + std::to_string(i) + " 1 2.000000000000000000000000000000000\n";
  std::ofstream(sensing.run) << text << "f 1 2 3\n";
  Process process = sensing.start("");
  // It has read the file, and parses it.
  const std::string counters = "/proc/" + std::to_string(process.id()) + "/io";
  const auto bytes_read = [&] {
    const std::string all = text_of(counters);
    return all.empty() ? 0 : std::stoull(all.substr(all.find(':') + 1));
  };
  while (process.is_running() && bytes_read() < text.size()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  process.signal(SIGINT);
  CHECK(process.wait() == 128 + SIGINT);
}
