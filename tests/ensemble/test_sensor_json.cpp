#include "adapters/rig/sensor_json.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

const std::string unit_pose = "[[1,0,0,0],[0,1,0,0],[0,0,1,0]]";

/// A whole description; `more` begins with a comma.
std::string with_pose(const std::string& pose, const std::string& more = "") {
  return "{\"T_reference_sensor\":" + pose + ",\"sensor\":{\"focal_px\":1000,\"width_px\":64,\"height_px\":32," +
         "\"T_reference_right\":" + unit_pose + "}" + more + "}";
}

SensorDescription read(const std::string& text) {
  const TemporaryFolder folder;
  return read_sensor_json(put(folder / "s.json", text));
}

void check_refused(const std::string& text, const std::string& words) {
  CAPTURE(text);
  check_error(error_of([&] { (void)read(text); }), Status::bad_input, {"s.json", words});
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

}  // namespace

TEST_CASE("the demo's sensor") {
  const auto path = data() / "rail-demo/sensor.json";
  const SensorDescription demo = read_sensor_json(path);
  CHECK(demo.length_unit == "mm");
  CHECK(demo.sensor.focal_px == 1350);
  CHECK(demo.sensor.width_px == 720);
  CHECK(demo.sensor.height_px == 300);
  CHECK(demo.noise.sigma == 0.1f);
  CHECK(demo.noise.outliers == 0.001f);
  CHECK(demo.noise.min_cos_incidence == 0.17f);
  const RigidTransform left{-0.9918357753074261f,
                            -0.0833881874726556f,
                            0.0964790392279196f,
                            100,
                            -0.1275217425395262f,
                            0.648574791453988f,
                            -0.7503925273282636f,
                            700,
                            0,
                            -0.7565693293284108f,
                            -0.653913488100344f,
                            650};
  CHECK(demo.sensor.T_reference_sensor == left);
  CHECK(read_pose(path) == left);
  CHECK(demo.sensor.T_reference_right[3] == 300);
  CHECK(demo.sensor.T_reference_right[9] == -0.7578612635612672f);
}

TEST_CASE("what is not said keeps its default") {
  const SensorDescription read_back = read(with_pose(unit_pose)), standard;
  CHECK(read_back.length_unit == standard.length_unit);
  CHECK(read_back.noise.sigma == standard.noise.sigma);
  CHECK(read_back.noise.outliers == standard.noise.outliers);
  CHECK(read_back.noise.min_cos_incidence == standard.noise.min_cos_incidence);
  CHECK(read_back.noise.dropout == standard.noise.dropout);
  CHECK(read_back.noise.background == standard.noise.background);
  CHECK(read_back.sensor.T_reference_sensor == identity_transform);
  CHECK(read_back.sensor.width_px == 64);
}

TEST_CASE("noise, in the length unit or in mm") {
  const SensingNoise noise =
      read(with_pose(unit_pose,
                     ",\"noise\":0.5,\"outliers\":0,\"min_cos_incidence\":1,\"dropout\":0.25,\"background\":2"))
          .noise;
  CHECK(noise.sigma == 0.5f);
  CHECK(noise.outliers == 0);
  CHECK(noise.min_cos_incidence == 1);
  CHECK(noise.dropout == 0.25f);
  CHECK(noise.background == 2);
  CHECK(read(with_pose(unit_pose, ",\"noise_mm\":500,\"length_unit\":\"m\"")).noise.sigma == 0.5f);
  CHECK(read(with_pose(unit_pose, ",\"noise\":0.5,\"length_unit\":\"in\"")).noise.sigma == 0.5f);
  CHECK(read(with_pose(unit_pose, ",\"noise_mm\":25.4,\"length_unit\":\"in\"")).noise.sigma == doctest::Approx(1));
  CHECK(read(with_pose(unit_pose, ",\"length_unit\":\"m\"")).noise.sigma ==
        doctest::Approx(1e-4));  // the default is 0.1 mm
  check_refused(with_pose(unit_pose, ",\"length_unit\":\"furlong\""), "give mm, cm, m, um, in or ft");
  check_refused(with_pose(unit_pose, ",\"noise_mm\":1,\"noise\":1"), "both");
}

TEST_CASE("a pose is a rotation within 1e-4 and a translation") {
  const auto turned = [](double angle, double scale) {
    const std::string c = std::to_string(scale * std::cos(angle)), s = std::to_string(scale * std::sin(angle));
    return "[[" + c + ",-" + s + ",0,1],[" + s + "," + c + ",0,2],[0,0,1,3]]";
  };
  CHECK(read(with_pose(turned(0.7, 1))).sensor.T_reference_sensor[0] == doctest::Approx(std::cos(0.7)));
  CHECK(read(with_pose(turned(0.7, 1.00004))).sensor.T_reference_sensor[11] == 3);  // rows' squares off by 8e-5
  check_refused(with_pose(turned(0.7, 1.00006)), "rotation");                       // and by 1.2e-4
  check_refused(with_pose("[[1,0,0,0],[0,1,0,0],[0,0,-1,0]]"), "rotation");         // a mirror
  check_refused(with_pose("[[1,0,0,0],[0.001,1,0,0],[0,0,1,0]]"), "rotation");
  check_refused(with_pose("[[0,0,0,0],[0,0,0,0],[0,0,0,0]]"), "rotation");
  CHECK(read(with_pose("[[1,0,0,5],[0,1,0,6],[0,0,1,7],[0,0,0,1]]")).sensor.T_reference_sensor[7] == 6);
  for (const std::string pose :
       {"1", "[]", "[1,0,0,0]", "[1,2,3]", "[[1,0,0],[0,1,0],[0,0,1]]", "[[1,0,0,0],[0,1,0,0]]",
        "[[1,0,0,\"0\"],[0,1,0,0],[0,0,1,0]]", "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,2]]"})
    check_refused(with_pose(pose), "three rows of four numbers");
  check_refused(with_pose("[[1,0,0,1e39],[0,1,0,0],[0,0,1,0]]"), "T_reference_sensor");
}

TEST_CASE("what is missing, misspelt or out of range is refused by its key") {
  const std::string whole = with_pose(unit_pose);
  for (const std::string key : {"T_reference_sensor", "sensor"})
    check_refused(replaced(whole, "\"" + key + "\"", "\"comment\""), "\"" + key + "\" is missing");
  for (const std::string key : {"focal_px", "width_px", "height_px", "T_reference_right"})
    check_refused(replaced(whole, "\"" + key + "\"", "\"axes\""), "\"sensor." + key + "\" is missing");
  check_refused(replaced(whole, "\"focal_px\"", "\"focal\""), "\"sensor.focal\" is not a key known here");
  check_refused(with_pose(unit_pose, ",\"dropuot\":0"), "\"dropuot\"");
  for (const std::string value : {"0", "-1", "\"1000\"", "null", "true"})
    check_refused(replaced(whole, "1000", value), "sensor.focal_px");
  for (const std::string value : {"0", "-64", "64.5", "1e9"})
    check_refused(replaced(whole, "64", value), "sensor.width_px");
  for (const std::string share : {"outliers", "dropout", "min_cos_incidence"}) {
    check_refused(with_pose(unit_pose, ",\"" + share + "\":1.5"), share);
    check_refused(with_pose(unit_pose, ",\"" + share + "\":-0.5"), share);
  }
  check_refused(with_pose(unit_pose, ",\"noise\":-1"), "noise");
  for (const char* unit : {"1", "\"\""})
    check_refused(with_pose(unit_pose, std::string(",\"length_unit\":") + unit), "length_unit");
}

TEST_CASE("files that are no description") {
  check_refused("", "not JSON");
  check_refused("{", "not JSON: parse error at line 1");  // without the library's name for the exception
  check_refused("[]", "not an object");
  check_refused(std::string(200'000, '['), "not JSON");
  CHECK(error_of([] { (void)read_sensor_json("/nowhere/s.json"); }).status == Status::file_not_found);
}

TEST_CASE("a pose alone, in a file with other things") {
  const TemporaryFolder folder;
  const auto file = put(folder / "p.json", "{\"camera\":\"left\",\"T_reference_sensor\":" + unit_pose + "}");
  CHECK(read_pose(file) == identity_transform);
  CHECK(error_of([&] { (void)read_pose(put(folder / "q.json", "{}")); }).status == Status::bad_input);
}
