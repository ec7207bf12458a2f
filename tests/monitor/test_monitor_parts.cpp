// The parts of the monitor.
#include "tests/components/plate_parts.hpp"
#include "tests/support/eroding_plates.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tests/wire/wire_support.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/feeds/recording_feed.hpp"
#include "tools/monitor/feeds/test_log.hpp"
#include "tools/monitor/scene/packet.hpp"
#include "tools/monitor/scene/scene.hpp"
#include "tools/monitor/scene/shown_components.hpp"
#include "tools/monitor/web/access.hpp"
#include "tools/shared/matching/preview.hpp"
#include "tools/shared/recording/run_recorder.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

namespace {

WireResult result_of(std::uint64_t id, std::uint64_t session = 1) {
  WireResult result;
  result.sequence = id;
  result.session = session;
  result.frame_id = id;
  result.stamp_ns = 1'000'000'000 + static_cast<std::int64_t>(id) * 1'000'000;
  result.verdict = WireVerdict::matched;
  result.coverage = 0.5f;
  result.matches = {{{2, 7}, "run \"b\"", 0.007, 1.5f}};
  result.leading_coordinates = {1, 2, static_cast<float>(id)};
  result.elapsed_ns.total = 2'000'000;
  return result;
}

struct ReadPacket {
  nlohmann::json head;
  std::string bytes;
  std::size_t begin;
  template <class T>
  std::vector<T> section(const std::string& name) const {
    const auto& place = head["sections"][name];
    std::vector<T> values(place["count"].get<std::size_t>());
    if (!values.empty())
      std::memcpy(values.data(), bytes.data() + begin + place["offset"].get<std::size_t>(), values.size() * sizeof(T));
    return values;
  }
};

ReadPacket read(const std::string& packet) {
  std::uint32_t length = 0;
  REQUIRE(packet.substr(0, 4) == "LBMO");
  std::memcpy(&length, packet.data() + 4, 4);
  return {nlohmann::json::parse(packet.substr(8, length)), packet, (8 + length + 7) / 8 * std::size_t{8}};
}

float to_surface_by_sampling(const Point& p, const Model& model, std::span<const float> positions) {
  float least = 1e30f;
  const auto at = [&](std::uint32_t node, std::size_t k) { return positions[node * std::size_t{3} + k]; };
  for (std::uint32_t e = 0; e < model.elements(); ++e)
    for (int i = 0; i <= 20; ++i)
      for (int j = 0; j <= 20; ++j) {
        // Quads of the plates are flat: bilinear points lie on them.
        const float u = static_cast<float>(i) / 20, v = static_cast<float>(j) / 20;
        const std::uint32_t* n = &model.element_nodes()[std::size_t{e} * 4];
        float squared = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const float x =
              (1 - u) * ((1 - v) * at(n[0], k) + v * at(n[3], k)) + u * ((1 - v) * at(n[1], k) + v * at(n[2], k));
          const float d = x - (k == 0 ? p.x : k == 1 ? p.y : p.z);
          squared += d * d;
        }
        least = std::min(least, squared);
      }
  return std::sqrt(least);
}

}  // namespace

TEST_CASE("addresses to serve on") {
  CHECK(http::parse_address("127.0.0.1:8080", "--http").is_loopback);
  CHECK(http::parse_address("localhost:0", "--http").host == "127.0.0.1");
  CHECK(http::parse_address("[::1]:80", "--http").is_loopback);
  CHECK(!http::parse_address("0.0.0.0:8080", "--http").is_loopback);
  CHECK(!http::parse_address("[::]:8080", "--http").is_loopback);
  CHECK(!http::parse_address("192.168.1.4:65535", "--http").is_loopback);
  for (const std::string& text : std::vector<std::string>{"", "8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536",
                                                          "127.0.0.1:-1", "127.0.0.1:80x", "rig:8080", "::1:80",
                                                          "[::1]", "127.evil.example:80", "[127.0.0.1]:80"})
    CHECK_MESSAGE(
        error_of([&] { static_cast<void>(http::parse_address(text, "--http")); }).status == Status::bad_config, text);
}

TEST_CASE("tokens are long and differ") {
  CHECK(random_token().size() == 32);
  CHECK(random_token() != random_token());
  CHECK(http::query_value("/?a=1&token=xy&b=", "token") == "xy");
  CHECK(http::query_value("/?a=1&token=xy&b=", "b").empty());
  CHECK(http::query_value("/token=1", "token").empty());
  CHECK(http::query_value("/?mytoken=1", "token").empty());
}

TEST_CASE("the sections of a packet can be read") {
  for (std::size_t padding = 0; padding < 8; ++padding) {
    Packet packet;
    packet.add("a", std::vector<float>{1.5f, -2});
    packet.add("none", std::vector<std::uint32_t>{});
    packet.add("b", std::vector<std::uint16_t>{7});
    packet.add("c", std::vector<std::uint32_t>{1, 2, 3});
    const auto seen = read(packet.finish({{"text", std::string(padding, 'x')}}));
    CHECK(seen.section<float>("a") == std::vector<float>{1.5f, -2});
    CHECK(seen.section<std::uint32_t>("none").empty());
    CHECK(seen.section<std::uint16_t>("b") == std::vector<std::uint16_t>{7});
    CHECK(seen.section<std::uint32_t>("c") == std::vector<std::uint32_t>{1, 2, 3});
    CHECK(seen.begin % 8 == 0);
  }
}

TEST_CASE("a log is bounded, covers the whole test, and has a new epoch when rows change") {
  TestLog log(16);
  LogCursor cursor;
  std::size_t read_rows = 0;
  for (std::uint64_t id = 0; id < 1000; ++id) {
    log.add(result_of(id));
    CHECK(log.rows().size() <= 16);
    if (id == 9) {
      const auto first = read(next_rows(log, cursor, 4));
      CHECK(first.head["first"] == 0);
      CHECK(first.section<float>("rows").size() == 4 * TestLog::row_values);
      CHECK(read(next_rows(log, cursor, 100)).head["first"] == 4);
      CHECK(next_rows(log, cursor, 100).empty());
    }
  }
  CHECK(log.results() == 1000);
  CHECK(log.rows().front()[TestLog::frame] == 0);
  CHECK(log.rows().back()[TestLog::frame] >= 1000 - 2 * static_cast<float>(log.every()));
  for (std::size_t i = 1; i < log.rows().size(); ++i)
    CHECK(log.rows()[i][TestLog::frame] - log.rows()[i - 1][TestLog::frame] == static_cast<float>(log.every()));
  const auto anew = read(next_rows(log, cursor, 100));
  CHECK(anew.head["first"] == 0);
  read_rows = anew.section<float>("rows").size() / TestLog::row_values;
  CHECK(read_rows == log.rows().size());
}

TEST_CASE("a new sender begins a new test, a frame without a sender does not; the end is recorded") {
  TestLog log;
  log.add(result_of(5));
  log.add(result_of(6));
  WireResult damaged;
  damaged.status = WireStatus::damaged;
  log.add(damaged);
  CHECK(log.session() == 1);
  CHECK(log.rows().size() == 3);
  WireResult end = result_of(7);
  end.status = WireStatus::end_of_stream;
  log.add(end);
  CHECK(log.is_complete());
  CHECK(log.rows().size() == 3);
  log.add(result_of(0, 2));
  CHECK(!log.is_complete());
  CHECK(log.rows().size() == 1);
  CHECK(log.rows().front()[TestLog::time_s] == 0);
}

// Regression: another sender's end erased the running test, and the next test of a session continued the complete one.
TEST_CASE("the end of another sender's stream changes nothing; a frame after the own end begins a test") {
  TestLog log;
  const auto end = [](std::uint64_t session) {
    WireResult result = result_of(9, session);
    result.status = WireStatus::end_of_stream;
    return result;
  };
  log.add(end(2));
  CHECK(log.rows().empty());
  log.add(result_of(5));
  log.add(result_of(6));
  log.add(end(2));
  CHECK(log.session() == 1);
  CHECK(log.rows().size() == 2);
  CHECK_FALSE(log.is_complete());
  log.add(end(1));
  CHECK(log.is_complete());
  log.add(result_of(7));
  CHECK(log.rows().size() == 1);
  CHECK_FALSE(log.is_complete());
}

// Regression: the curves of a session's last test replaced those before.
TEST_CASE("a recording shows the curves of each test of a session") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  {
    RunRecorder recorder(folder / "run.mcap", {}, {});
    Encoder encoder;
    const auto record = [&](WireResult result) {
      result.publish_ns = static_cast<std::int64_t>(result.frame_id + 1);
      recorder.result(encoder.result(result), result);
    };
    for (const std::uint64_t test : {0u, 1u}) {
      for (std::uint64_t id = 0; id < 3 + test; ++id) record(result_of(10 * test + id));
      WireResult end = result_of(10 * test + 9);
      end.status = WireStatus::end_of_stream;
      record(end);
    }
    CHECK(recorder.finish().is_sound());
  }
  const auto feed = make_recording_feed(folder / "run.mcap", open_models({(folder / "plates.lbea").string()}));
  const auto frames_of = [&](const std::string& session) {
    const auto response = feed->respond("/api/recording/rows?session=" + session + "&first=0");
    REQUIRE(response);
    return read(response->body).section<float>("rows").size() / TestLog::row_values;
  };
  CHECK(frames_of("1") == 3);
  CHECK(frames_of("1.2") == 4);
  CHECK(frames_of("1.3") == 0);
  CHECK(frames_of("1.0") == 0);
  const auto last = feed->respond("/api/recording/frame?number=5");
  REQUIRE(last);
  CHECK(read(last->body).head["test"]["session"] == "1.2");
}

// Regression: the difference of such stamps is not in the range of their type.
TEST_CASE("times that are far apart are subtracted and added without overflow") {
  constexpr auto most = std::numeric_limits<std::int64_t>::max(), least = std::numeric_limits<std::int64_t>::min();
  TestLog log;
  WireResult first = result_of(0);
  first.stamp_ns = least;
  log.add(first);
  CHECK(log.seconds(most) == doctest::Approx(1.8446744e10));
  CHECK(difference_ns(least, most) == doctest::Approx(-1.8446744e19));
  CHECK(difference_ns(1'700'000'000'000'000'001, 1'700'000'000'000'000'000) == 1);
  CHECK(saturated_sum(most, 1) == most);
  CHECK(saturated_sum(least, -1) == least);
  CHECK(saturated_sum(most, least) == -1);
}

TEST_CASE("curves as CSV: one line per row, quoted names, empty unknown values") {
  TestLog log;
  log.add(result_of(0));
  WireResult refused = result_of(1);
  refused.status = WireStatus::bad_cloud;
  refused.verdict = WireVerdict::refused;
  log.add(refused);
  const std::vector<std::string> names{"a", "b", "run \"b\""};
  const std::string csv = to_csv(log, names);
  CHECK(std::ranges::count(csv, '\n') == 3);
  CHECK(contains(csv, "\n0,0,matched,ok,\"run \"\"b\"\"\",7,1.5,,,,,,,,,,,,0.5,,1,2,0,2,"));
  CHECK(contains(csv, "\n0.001,1,refused,bad_cloud,,,,"));
}

TEST_CASE("health: rates, latency, lost results, ages") {
  Health health;
  const auto begin = Health::Clock::now();
  for (int i = 0; i <= 100; ++i) {
    WireResult result = result_of(static_cast<std::uint64_t>(i));
    result.counters.received = static_cast<std::uint64_t>(i);
    health.add(result, begin + std::chrono::milliseconds(20 * i));
  }
  WireResult late = result_of(111);
  late.elapsed_ns.total = 40'000'000;
  health.add(late, begin + std::chrono::milliseconds(2020));
  const auto report = health.report(begin + std::chrono::milliseconds(2520));
  CHECK(report["rate"].get<double>() == doctest::Approx(50).epsilon(0.05));
  CHECK(report["results_lost_here"] == 10);
  CHECK(report["heard_ms"] == 500);
  CHECK(report["latency"]["p50_ms"].get<double>() == doctest::Approx(2));
  CHECK(report["latency"]["p99_ms"].get<double>() < 40);
  CHECK(health.report(begin + std::chrono::minutes(1))["rate"] == 0.0);
}

TEST_CASE("health of several rigs: rate, age, coverage and pose of each, also of one that has sent nothing") {
  Health health;
  const auto begin = Health::Clock::now();
  WireState state;
  state.rigs = {{"left", "", 0, {}}, {"right", "", 2'500'000, {}}};
  state.rigs[1].counters.by_status[static_cast<std::size_t>(WireStatus::out_of_step)] = 3;
  health.add(state, begin);
  WireResult result = result_of(0);
  result.rigs.resize(1);
  result.rigs[0].rig = "left";
  result.rigs[0].coverage = 0.75f;
  result.rigs[0].is_used = true;
  result.rigs[0].pose_shift = 1.5f;
  for (int i = 0; i <= 100; ++i) health.add(result, begin + std::chrono::milliseconds(20 * i));
  const auto rigs = health.report(begin + std::chrono::milliseconds(2500))["rigs"];
  REQUIRE(rigs.size() == 2);
  CHECK(rigs[0]["name"] == "left");
  CHECK(rigs[0]["rate"].get<double>() == doctest::Approx(50).epsilon(0.05));
  CHECK(rigs[0]["last_frame_ms"] == 500);
  CHECK(rigs[0]["coverage"] == 0.75);
  CHECK(rigs[0]["pose_shift"] == 1.5);
  CHECK(rigs[1]["last_frame_ms"].is_null());
  CHECK(rigs[1]["clock_offset_ms"] == 2.5);
  CHECK(rigs[1]["counters"]["dropped"] == 3);
}

TEST_CASE("shapes are parsed from text; anything else is refused") {
  const auto shape = parse_shape("3:17:0.75,4:16:0.25");
  REQUIRE(shape);
  CHECK((*shape)[0].sample == Sample{3, 17});
  CHECK((*shape)[1].weight == 0.25f);
  for (const std::string& text : std::vector<std::string>{"", ",", "1", "1:2", "1:2:", "1:2:x", "-1:2:1", "1:2:1;",
                                                          "1:2:nan", "1:2:1:1", "99999999999:0:1", "1:2:inf"})
    CHECK_MESSAGE(!parse_shape(text), text);
  std::string many;
  for (int i = 0; i < 1000; ++i) many += "0:0:0.1,";
  CHECK(!parse_shape(many));
}

TEST_CASE("scenes of a model: meshes blend, distances are those from the surface, clouds come back") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  const Model model = Model::open(folder / "plates.lbea");
  const Shape half{{{0, 5}, 0.5f}, {{1, 5}, 0.5f}};
  REQUIRE(is_shape_of(model, half));
  CHECK(!is_shape_of(model, {{{0, 6}, 1.0f}}));
  CHECK(!is_shape_of(model, {{{0, 5}, std::nanf("")}}));
  const auto between = positions_of(model, half);
  for (std::size_t i = 0; i < between.size(); ++i)
    CHECK(between[i] == doctest::Approx((model.node_positions(model.sample_index({0, 5}))[i] +
                                         model.node_positions(model.sample_index({1, 5}))[i]) /
                                        2));

  const auto surface = model.node_positions(model.sample_index({1, 5}));
  std::vector<std::array<std::uint32_t, 4>> elements(model.elements());
  std::memcpy(elements.data(), model.element_nodes().data(), model.element_nodes().size_bytes());
  const SurfaceTree tree(surface, elements);
  const auto distance_at = [&](const Point& p) {
    return std::min(10.0f, static_cast<float>(tree.nearest({double{p.x}, double{p.y}, double{p.z}}, 10).distance));
  };
  float longest = 0;  // diagonal of an element
  for (std::uint32_t e = 0; e < model.elements(); ++e) {
    const float *a = &surface[model.element_nodes()[e * std::size_t{4}] * std::size_t{3}],
                *c = &surface[model.element_nodes()[e * std::size_t{4} + 2] * std::size_t{3}];
    longest = std::max(longest, std::hypot(a[0] - c[0], a[1] - c[1], a[2] - c[2]));
  }
  const float apart = longest / 20 / 2;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> offset(-8, 8);
  for (std::size_t i = 0; i < 60; ++i) {
    const std::size_t node = i * 3 % model.nodes();
    const Point p{surface[node * 3] + offset(random), surface[node * 3 + 1] + offset(random),
                  surface[node * 3 + 2] + offset(random)};
    // The oracle looks at points `apart` at most from the nearest one: it says too much, at most by the hypotenuse.
    const float found = distance_at(p), sampled = std::min(10.0f, to_surface_by_sampling(p, model, surface));
    CHECK(found <= sampled + 1e-3f);
    CHECK(sampled <= std::hypot(found, apart) + 1e-3f);
  }
  CHECK(distance_at({1e6f, 0, 0}) == 10);
  CHECK(distance_at({-1e30f, 1e30f, 0}) == 10);

  WireResult result = result_of(3);
  result.model_checksum = model.checksum();
  result.matches = {{{1, 5}, "plate_1", 0, 1}, {{1, 4}, "plate_1", 0, 2}, {{3, 5}, "plate_3", 0, 3}};
  const std::vector<Point> cloud{{surface[0], surface[1], surface[2]}, {1e9f, 0, 0}};
  SceneBuilder scenes(model, ranges_of(model));
  const auto scene = read(scenes.build({result, std::make_shared<const std::vector<Point>>(cloud)}, {}));
  CHECK(scene.section<float>("match") == std::vector<float>(surface.begin(), surface.end()));
  CHECK(scene.head["scene"]["meshes"]["ghost"]["shape"][0][0] == 3);
  CHECK(scene.head["scene"]["cloud"]["elsewhere"] == 1);
  const auto points = scene.section<std::uint16_t>("cloud");
  REQUIRE(points.size() == 4);
  for (std::size_t k = 0; k < 3; ++k) {
    const float lo = scene.head["scene"]["lo"][k], hi = scene.head["scene"]["hi"][k];
    CHECK(std::abs(lo + static_cast<float>(points[k]) / 65535 * (hi - lo) - surface[k]) < (hi - lo) / 65000);
  }
  CHECK(points[3] == 0);
  // Regression: distances were measured from the estimate of the previous frame.
  result.model_checksum += 1;
  const auto other = read(scenes.build({result, std::make_shared<const std::vector<Point>>(cloud)}, {}));
  CHECK(!other.head["sections"].contains("match"));
  CHECK(other.section<std::uint16_t>("cloud")[3] == 65535);
}

TEST_CASE("scenes name the elements that a shape has lost; points in the hole are measured from its rim") {
  const TemporaryFolder folder;
  bake_model(eroding_plates(2, 2, 1), bent_plates_description(), folder / "plates.lbea");
  const Model model = Model::open(folder / "plates.lbea");
  SceneBuilder scenes(model, ranges_of(model));
  const std::uint32_t whole = model.sample_index({0, 1});
  const float* middle = &model.node_positions(whole)[3 * patch_nodes()[4]];
  const auto cloud = std::make_shared<const std::vector<Point>>(1, Point{middle[0], middle[1], middle[2]});
  WireResult result = result_of(3);
  result.model_checksum = model.checksum();
  result.matches = {{{0, 1}, "whole_0", 0, 1}, {{3, 1}, "eroding_1", 0, 2}};
  const auto with_whole = read(scenes.build({result, cloud}, {}));
  CHECK_FALSE(with_whole.head["sections"].contains("match_eroded"));
  CHECK(with_whole.section<std::uint32_t>("ghost_eroded").size() == 16);
  CHECK(with_whole.section<std::uint16_t>("cloud")[3] == 0);
  result.matches = {{{1, 1}, "eroding_0", 0, 1}};
  const auto with_hole = read(scenes.build({result, cloud}, {}));
  const std::vector<std::size_t> patch = patch_elements();
  CHECK(std::ranges::equal(with_hole.section<std::uint32_t>("match_eroded"), patch));
  CHECK(with_hole.section<std::uint32_t>("estimate_eroded").size() == 16);
  CHECK(with_hole.section<std::uint16_t>("cloud")[3] > 60'000);  // 20 mm to the rim; more than 10 mm count alike
}

TEST_CASE("components are put together: each with its own mesh, and the cloud with the distance from the nearest one") {
  const std::vector<NamedModel> models{{"clamped", "", part_of_plates({0, -INFINITY, 80})},
                                       {"free", "", part_of_plates({0, 120, INFINITY})}};
  const ShownComponents shown(models);
  AssembledMoment moment;
  std::vector<Point> cloud;
  for (const NamedModel& named : models) {
    WireResult& result = moment.results.emplace_back(result_of(3));
    result.component = named.name;
    result.model_checksum = named.model.checksum();
    result.matches = {{{1, 5}, "plate", 0, 1}};
    const auto nodes = named.model.node_positions(named.model.sample_index({1, 5}));
    cloud.push_back({nodes[0], nodes[1], nodes[2]});
    CHECK(shown.concerned(result) == std::vector<std::size_t>{cloud.size() - 1});
  }
  cloud.push_back({cloud[0].x, cloud[0].y, cloud[0].z + 4});  // mm
  moment.cloud = std::make_shared<const std::vector<Point>>(cloud);
  const auto packet = read(shown.build(moment, {}, {{{"number", 0}}, {{"number", 1}}}));
  for (std::size_t i = 0; i < 2; ++i) {
    const auto bytes = packet.section<char>("component" + std::to_string(i));
    const auto part = read({bytes.begin(), bytes.end()});
    CHECK(part.head["number"] == i);
    const auto nodes = models[i].model.node_positions(models[i].model.sample_index({1, 5}));
    CHECK(part.section<float>("estimate") == std::vector<float>(nodes.begin(), nodes.end()));
  }
  const auto points = packet.section<std::uint16_t>("cloud");
  const auto& scene = packet.head["scene"];
  REQUIRE(points.size() == 4 * cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const float lo = scene["lo"][0], hi = scene["hi"][0];
    CHECK(std::abs(lo + static_cast<float>(points[4 * i]) / 65535 * (hi - lo) - cloud[i].x) < (hi - lo) / 65000);
  }
  CHECK(points[3] == 0);
  CHECK(points[7] == 0);
  const double shown_mm = points[11] / 65535.0 * scene["distance_limit"].get<double>();
  CHECK(shown_mm > 3);  // the plate is bent, so the nearest place is not below the point
  CHECK(shown_mm < 4.01);

  WireResult of_frame = result_of(4);
  of_frame.status = WireStatus::empty_frame;
  CHECK(shown.concerned(of_frame).size() == 2);
  of_frame.component = "other";
  CHECK(shown.concerned(of_frame).empty());
}

TEST_CASE("the forecast is shown as it was published, and only then") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  const Model model = Model::open(folder / "plates.lbea");
  SceneBuilder scenes(model, ranges_of(model));
  WireResult result = result_of(3);
  result.model_checksum = model.checksum();
  TestLog log;
  log.add(result);
  CHECK_FALSE(to_json(result).contains("forecast"));
  CHECK_FALSE(read(scenes.build({result, nullptr}, {})).head["sections"].contains("final"));
  CHECK(std::isnan(log.rows().back()[TestLog::final_error_90]));

  result.forecast = {2, 7.5f, {{0, 1.25f}, {2, -0.25f}}, {0.25f, 0.75f}, {{8.5f, 0.5f, 0.875f}, {-1, 2, 0.125f}}};
  const auto forecast = to_json(result)["forecast"];
  CHECK(forecast["error_90"] == 7.5f);
  CHECK(forecast["branches"] == std::vector<float>{0.25f, 0.75f});
  CHECK(forecast["parameters"][0]["value"] == 8.5f);
  CHECK(forecast["parameters"][0]["bound_90"] == 0.5f);
  CHECK(forecast["parameters"][0]["identifiable"] == true);
  CHECK(forecast["parameters"][1]["identifiable"] == false);
  log.add(result);
  CHECK(log.rows().back()[TestLog::final_error_90] == 7.5f);
  CHECK(column_names()[TestLog::final_error_90] == "final_error_90");
  const auto end = read(scenes.build({result, nullptr}, {})).section<float>("final");
  const auto first = model.node_positions(model.sample_index({0, 5})),
             third = model.node_positions(model.sample_index({2, 5}));
  REQUIRE(end.size() == first.size());
  for (std::size_t i = 0; i < end.size(); ++i)
    CHECK(end[i] == doctest::Approx(1.25 * first[i] - 0.25 * third[i]).epsilon(1e-4));
  // Not one of another model.
  result.forecast.runs.push_back({99, 1});
  CHECK_FALSE(read(scenes.build({result, nullptr}, {})).head["sections"].contains("final"));
  result.forecast.runs.pop_back();
  ++result.model_checksum;
  CHECK_FALSE(read(scenes.build({result, nullptr}, {})).head["sections"].contains("final"));
}

TEST_CASE("channels: the page gets names, units, values and bounds; what is not known is null") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  const Model plain = Model::open(folder / "plates.lbea");
  CHECK(read(model_packet(plain, ranges_of(plain), nullptr)).head["channels"].empty());
  EnsembleDescription description = bent_plates_description();
  description.channels = {
      {"end", ChannelKind::displacement, ChannelComponent::x, 0, {ChannelPoint{true, 1020, {}}}, {}}};
  bake_model(bent_plates(), description, folder / "end.lbea");
  const Model model = Model::open(folder / "end.lbea");
  CHECK(read(model_packet(model, ranges_of(model), nullptr)).head["channels"] ==
        nlohmann::json::parse(R"([{"name": "end", "unit": "mm"}])"));

  WireResult result = result_of(3);
  CHECK_FALSE(to_json(result).contains("channels"));
  result.channels = {{{-12.5f, 0.5f}, "end", "mm", {-100, 4}}, {{7, std::nanf("")}, "speed", "mm/s"}};
  const auto seen = nlohmann::json::parse(to_json(result).dump());
  CHECK(seen["channels"] == nlohmann::json::parse(R"([
      {"name": "end", "value": -12.5, "bound_90": 0.5, "end_value": -100.0, "end_bound_90": 4.0},
      {"name": "speed", "value": 7.0, "bound_90": null, "end_value": null, "end_bound_90": null}])"));
  CHECK(seen["doubtful"] == false);
  result.verdict = WireVerdict::no_simulation_fits;
  CHECK(to_json(result)["doubtful"] == true);
}

WireResult with_channels(std::uint64_t id, std::size_t channels = 2) {
  WireResult result = result_of(id);
  for (std::size_t c = 0; c < channels; ++c)
    result.channels.push_back(
        {{static_cast<float>(100 * c + id), 0.25f}, "channel, " + std::to_string(c), c == 0 ? "mm" : "mm/s"});
  return result;
}

TEST_CASE("channels: curves have gaps at doubtful frames and where there are no values") {
  TestLog log;
  LogCursor cursor;
  log.add(result_of(0));  // as by a matcher that sent its first result before
  const auto before = read(next_rows(log, cursor, 100));
  CHECK(before.head["channels"].empty());
  CHECK(before.section<float>("channels").empty());
  for (std::uint64_t id = 1; id < 5; ++id) {
    WireResult result = with_channels(id);
    if (id == 2) result.verdict = WireVerdict::no_simulation_fits;
    if (id == 3) result.channels.pop_back();
    log.add(result);
  }
  // Rows that the browser has change: it gets all again.
  const auto after = read(next_rows(log, cursor, 3));
  CHECK(after.head["first"] == 0);
  CHECK(after.head["channels"] == nlohmann::json::parse(R"([{"name": "channel, 0", "unit": "mm"},
                                                            {"name": "channel, 1", "unit": "mm/s"}])"));
  auto values = after.section<float>("channels");
  const auto rest = read(next_rows(log, cursor, 100));
  CHECK_FALSE(rest.head.contains("channels"));
  for (const float value : rest.section<float>("channels")) values.push_back(value);
  REQUIRE(values.size() == 5 * 2 * 2);
  const auto is_known = [&](std::size_t row, std::size_t c) { return !std::isnan(values[4 * row + 2 * c]); };
  for (std::size_t row = 0; row < 5; ++row) {
    CHECK(is_known(row, 0) == (row != 0 && row != 2));
    CHECK(is_known(row, 1) == (row == 1 || row == 4));
  }
  CHECK(std::vector<float>(values.end() - 4, values.end()) == std::vector<float>{4, 0.25f, 104, 0.25f});

  const std::string csv = to_csv(log, {});
  const std::string first = csv.substr(0, csv.find('\n'));
  CHECK(
      first.ends_with(",\"channel, 0 [mm]\",\"channel, 0 bound_90 [mm]\",\"channel, 1 [mm/s]\","
                      "\"channel, 1 bound_90 [mm/s]\""));
  CHECK(csv.ends_with(",4,0.25,104,0.25\n"));
  // The next test may have others.
  WireResult next = with_channels(0, 1);
  next.session = 2;
  log.add(next);
  CHECK(log.channels().size() == 1);
  CHECK(log.channel_values().size() == 1);
}

TEST_CASE("channels: the log of many channels holds fewer rows, evenly spaced") {
  constexpr std::size_t channels = 1000;
  TestLog log;
  for (std::uint64_t id = 0; id < 700; ++id) log.add(result_of(id));  // without channels
  REQUIRE(log.rows().size() == 700);
  for (std::uint64_t id = 700; id < 3000; ++id) log.add(with_channels(id, channels));
  CHECK(log.channel_values().size() <= TestLog::most_channel_values);
  CHECK(log.channel_values().size() == log.rows().size() * channels);
  CHECK(log.rows().size() > TestLog::most_channel_values / channels / 2);
  for (std::size_t row = 0; row < log.rows().size(); ++row) {
    const std::uint64_t id = log.ids()[row];
    CHECK(id == row * log.every());
    const ChannelValue last = log.channel_values()[row * channels + channels - 1];
    if (id >= 700) CHECK(last.value == static_cast<float>(100 * (channels - 1) + id));
    if (id < 700) CHECK(std::isnan(last.value));
  }
}

TEST_CASE("thinning keeps the cloud's extent, leaves out what is not finite, and moves it") {
  std::vector<Point> points;
  for (int i = 0; i < 1000; ++i) points.push_back({static_cast<float>(i), 0, 0});
  points[500].y = std::nanf("");
  RigidTransform up = identity_transform;
  up[11] = 5;
  thin(points, 100, up);
  CHECK(points.size() == 99);
  CHECK(points.front().x == 0);
  CHECK(points.back().x == 990);
  CHECK(points.front().z == 5);
  thin(points, 1000, identity_transform);
  CHECK(points.size() == 99);
  points.clear();
  thin(points, 10, identity_transform);
  CHECK(points.empty());
}

TEST_CASE("remaining recording time at the current rate") {
  using namespace std::chrono_literals;
  Health health;
  const auto begin = Health::Clock::now();
  const auto after = [&](std::chrono::seconds time, std::optional<WireRecording> recording) {
    WireState state;
    state.recording = recording;
    health.add(state, begin + time);
    return health.report(begin + time)["server"]["recording"];
  };
  CHECK(after(0s, {}).is_null());
  const auto first = after(1s, WireRecording{RecordingPhase::armed, 1'000, 5'000'000'000});
  CHECK(first["phase"] == "armed");
  CHECK(first["free_bytes"] == 5'000'000'000);
  CHECK(first["seconds_left"].is_null());  // no rate yet
  const auto second = after(5s, WireRecording{RecordingPhase::recording, 400'001'000, 4'600'000'000});
  CHECK(second["bytes_per_s"] == 1e8);
  CHECK(second["seconds_left"] == 46);
  // Bytes written more than ten seconds ago do not count.
  CHECK(after(20s, WireRecording{RecordingPhase::recording, 400'001'000, 4'600'000'000})["seconds_left"].is_null());
  CHECK(after(22s, WireRecording{RecordingPhase::recording, 600'001'000, 4'400'000'000})["seconds_left"] == 44);
  CHECK(after(23s, WireRecording{RecordingPhase::recording, 700'001'000, WireRecording::unknown})["free_bytes"]
            .is_null());
  // A new file starts a new rate.
  CHECK(after(24s, WireRecording{RecordingPhase::recording, 5, 4'400'000'000})["bytes_per_s"] == 0);
  CHECK(after(25s, {}).is_null());
}
