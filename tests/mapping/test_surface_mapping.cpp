// Runs with other meshes on the reference mesh: the plates and tubes have exact answers.
#include "precompute/mapping/mapped_run.hpp"
#include "precompute/survey/common_mesh.hpp"
#include "tests/mapping/meshes.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

SurfaceMapping mapped(const SimulationMesh& reference, const SimulationMesh& run,
                      const MappingSettings& settings = {}) {
  return map_surface(reference, run, settings, "mm");
}

}  // namespace

TEST_CASE("a plate on another mesh is where bending takes the nodes of the reference mesh") {
  constexpr double angle = 1.2, length = 190;
  const SimulationMesh reference = plate_mesh(coarse), run = plate_mesh({28, 14, 190, 91});
  const SurfaceMapping mapping = mapped(reference, run);
  CHECK(mapping.report.mapped_elements == reference.elements.size());
  CHECK(mapping.report.largest == doctest::Approx(0).epsilon(1e-9));
  std::vector<float> positions;
  carry(mapping.nodes, bent_state(run, 0, angle, length).positions, positions);
  // An arc deviates from the chord of an element of the run by its squared length over 8 radii.
  const double sagitta = (190.0 / 27) * (190.0 / 27) / 8 * angle / length;
  CHECK(largest_difference(positions, bent_state(reference, 0, angle, length).positions) < 1.01 * sagitta);
}

TEST_CASE("a mesh in another order with other numbers is mapped bit by bit") {
  const SimulationMesh reference = plate_mesh(coarse);
  const SimulationMesh run = renumbered(reference);
  REQUIRE_FALSE(has_numbers_of(reference, run));
  const SurfaceMapping mapping = mapped(reference, run);
  CHECK(mapping.report.largest == 0);
  CHECK(mapping.report.shift == 0);
  CHECK(mapping.mesh.positions == reference.positions);
  CHECK(mapping.mesh.elements == reference.elements);
  std::vector<float> positions;
  carry(mapping.nodes, bent_state(run, 0, 1, 190).positions, positions);
  CHECK(positions == bent_state(reference, 0, 1, 190).positions);
  for (std::size_t e = 0; e < reference.elements.size(); ++e)
    for (const std::uint32_t source : mapping.sources[e])
      CHECK(run.element_ids[source] == reference.element_ids[e] + renumbering);
}

TEST_CASE("which numbers are the reference run's") {
  const SimulationMesh reference = plate_mesh(coarse);
  SimulationMesh moved = reference, cut = reference, stretched = reference;
  for (float& value : moved.positions) value += 100;
  cut.elements.resize(50);
  cut.element_ids.resize(50);
  cut.element_parts.resize(50);
  stretched.element_ids[0] = 7;
  for (float& value : stretched.positions) value *= 1.3f;
  CHECK(has_numbers_of(reference, reference));
  CHECK(has_numbers_of(reference, moved));
  CHECK(has_numbers_of(reference, cut));
  CHECK_FALSE(has_numbers_of(reference, stretched));
  CHECK_FALSE(has_numbers_of(reference, plate_mesh({28, 14, 190, 90})));
}

// A point of a bowed face is not the one that is nearest: the bow moves the faces above and below in themselves.
TEST_CASE("the smooth difference of two shapes moves places along the faces") {
  constexpr double bow = 6;
  const SimulationMesh reference = tube_mesh(40, 8, 0);
  const SimulationMesh straight = tube_mesh(57, 11, 0), bowed = tube_mesh(57, 11, bow), truth = tube_mesh(40, 8, bow);
  CHECK(mapped(reference, straight).report.shift < 1e-3);
  const SurfaceMapping mapping = mapped(reference, bowed);
  CHECK(mapping.report.mapped_elements == reference.elements.size());
  CHECK(mapping.report.shift == doctest::Approx(bow).epsilon(0.05));
  CHECK(largest_difference(mapping.mesh.positions, truth.positions) < 0.05 * bow);
  CHECK(mapping.report.largest < 0.05 * bow);
}

// Beyond that, nodes would slide along the faces by several elements, at small distances from them.
TEST_CASE("shapes that differ by more than a twentieth of the diagonal are refused") {
  const SimulationMesh reference = tube_mesh(40, 8, 0);
  constexpr double diagonal = 409;  // of 400 x 60 x 60
  for (const double share : {0.03, 0.045}) {
    const double bow = share * diagonal;
    CAPTURE(bow);
    const SurfaceMapping mapping = mapped(reference, tube_mesh(57, 11, bow));
    CHECK(mapping.report.mapped_elements >= 0.95 * mapping.report.elements);
  }
  for (const double share : {0.06, 0.08, 0.1}) {
    const double bow = share * diagonal;
    CAPTURE(bow);
    check_error(error_of([&] { (void)mapped(reference, tube_mesh(57, 11, bow)); }), Status::bad_input,
                {"of the reference run's 1280 elements"});
  }
}

TEST_CASE("what the run lacks is left out and reported, not invented") {
  constexpr double radius = 12, h = 190.0 / 57, reach = 3;  // of the hole, whose border follows the run's elements
  const SimulationMesh reference = plate_mesh(coarse);
  const auto from_middle = [](double x, double y) { return std::hypot(x - 95, y - 45); };
  const SimulationMesh run =
      without(plate_mesh({58, 28, 190, 90}), [&](double x, double y) { return from_middle(x, y) < radius; });
  const SurfaceMapping mapping = mapped(reference, run);
  CHECK(mapping.report.mapped_elements == mapping.mesh.elements.size());
  CHECK(mapping.mesh.elements.size() < reference.elements.size());
  CHECK(mapping.report.largest <= reach);
  for (std::size_t e = 0; e < reference.elements.size(); ++e) {
    double nearest = INFINITY;  // of its nodes and quarters
    for (const double along : {0.0, 0.25, 0.75, 1.0})
      for (const double across : {0.0, 0.25, 0.75, 1.0}) {
        const auto [x, y] = place_on(reference, reference.elements[e], along, across);
        if ((along == 0 || along == 1) == (across == 0 || across == 1)) nearest = std::min(nearest, from_middle(x, y));
      }
    const auto& ids = mapping.mesh.element_ids;
    const bool is_mapped = std::ranges::find(ids, reference.element_ids[e]) != ids.end();
    if (nearest < radius - h / std::numbers::sqrt2 - reach) CHECK_FALSE(is_mapped);
    if (nearest > radius + h / std::numbers::sqrt2 - reach) CHECK(is_mapped);
  }
}

TEST_CASE("parts are told apart by their ids, by a table of ids, or not at all") {
  const SimulationMesh reference = two_plates(coarse, {1, 2});
  const auto parts_of_sources = [&](const std::array<std::uint32_t, 2>& parts, const MappingSettings& settings) {
    const SimulationMesh run = two_plates({28, 14, 190, 90}, parts);
    const SurfaceMapping mapping = mapped(reference, run, settings);
    std::map<std::uint32_t, std::uint32_t> source;  // part of the reference run -> of the run
    for (std::size_t e = 0; e < mapping.mesh.elements.size(); ++e)
      for (const std::uint32_t element : mapping.sources[e])
        source.emplace(mapping.mesh.element_parts[e], run.element_parts[element]);
    return std::array{std::uint32_t{mapping.report.tells_parts}, source[1], source[2]};
  };
  MappingSettings table, swapped, none;
  table.parts = {{11, 1}, {12, 2}};
  swapped.parts = {{11, 2}, {12, 1}};
  swapped.distance = 7;
  none.by_part = false;
  CHECK(parts_of_sources({1, 2}, {}) == std::array{1u, 1u, 2u});
  CHECK(parts_of_sources({11, 12}, table) == std::array{1u, 11u, 12u});
  CHECK(parts_of_sources({11, 12}, swapped) == std::array{1u, 12u, 11u});
  CHECK(parts_of_sources({11, 12}, {}) == std::array{0u, 11u, 12u});  // nearest
  CHECK(parts_of_sources({2, 1}, none) == std::array{0u, 2u, 1u});
}

TEST_CASE("a refusal counts the nodes for which nothing in the run can be theirs") {
  const SimulationMesh reference = two_plates(coarse, {1, 2}), plate = plate_mesh(coarse);
  SimulationMesh turned = plate_mesh({28, 14, 190, 90});
  for (std::size_t i = 0; i < turned.positions.size(); i += 3)
    std::swap(turned.positions[i + 1], turned.positions[i + 2]);
  const Error upright = error_of([&] { (void)mapped(plate, turned); });
  check_error(upright, Status::bad_input, {"200 of its nodes find no surface", "another place, direction or unit"});
  CHECK_FALSE(mentions(upright, "0 mm off"));
  const Error part = error_of([&] { (void)mapped(reference, two_plates({28, 14, 190, 90}, {1, 3})); });
  check_error(part, Status::bad_input, {"200 of its nodes find no surface of their part", "The others are "});
}

TEST_CASE("runs that are no variant of the component are refused with the figures") {
  const SimulationMesh reference = plate_mesh(coarse);
  const auto refusal = [&](const SimulationMesh& run) { return error_of([&] { (void)mapped(reference, run); }); };
  SimulationMesh far = plate_mesh({28, 14, 190, 90}), flat = far;
  for (std::size_t i = 2; i < far.positions.size(); i += 3) far.positions[i] += 40;
  check_error(refusal(far), Status::bad_input, {"0 of the reference run's 171 elements", "within 3 mm", "40 mm"});
  const SimulationMesh half = without(plate_mesh({28, 14, 190, 90}), [](double x, double) { return x > 80; });
  check_error(refusal(half), Status::bad_input, {"of the reference run's 171 elements", "80 %"});
  MappingSettings tolerant;
  tolerant.share = 0.3;
  CHECK(mapped(reference, half, tolerant).report.mapped_elements < 100);
  std::ranges::fill(flat.positions, 1.0f);
  check_error(refusal(flat), Status::bad_input, {"no element with an area"});
}
