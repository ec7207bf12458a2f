// Packets of the scene: meshes, clouds, what is lost.
#include "tests/components/plate_parts.hpp"
#include "tests/monitor/shown_results.hpp"
#include "tests/support/eroding_plates.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tools/monitor/scene/packet.hpp"
#include "tools/monitor/scene/scene.hpp"
#include "tools/monitor/scene/shown_components.hpp"
#include "tools/shared/matching/preview.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

namespace {

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
