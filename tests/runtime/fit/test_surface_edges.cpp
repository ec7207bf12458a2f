// The correction measures where the frame's points end at the open edges of the mesh: there alone they tell how far the
// surface moved along itself.
#include "runtime/src/fit/surface_fit.hpp"
#include "tests/runtime/fit/seen_plates.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr float pixel = 600.0f / 800;  // mm, of rig_above() on the flat plate

/// In reference coordinates, of the flat plate, which ends at x = 190.
std::vector<Point> points_of_flat_plate() {
  std::vector<Point> points = seen(bent(0), {.sigma = 0});
  for (Point& p : points) p = {p.x + 95, 45 - p.y, 600 - p.z};
  return points;
}

struct MeasuredEdges {
  std::vector<float> ends;  // of the points, along x
  std::size_t missing = 0;  // edges that were not measured
};

SurfaceFitter fitter_of(const Model& model) { return {model.view(), SensorViews::baked_into(model), 1, {}}; }

/// Of the first sample alone, which is nearly flat.
void correct_first(SurfaceFitter& fitter, const Model& model, const std::vector<Point>& points) {
  CloudIndex index(envelope_grid(model.view().envelope), static_cast<std::uint32_t>(points.size()));
  index.build(points, identity_transform);
  const std::vector<RankedSample> first{{0, 0}};
  SurfaceFit result = fitter.fit(index, first);
  fitter.correct(index, result);
}

/// Of the edges at the plate's end at x = 190.
MeasuredEdges edges_at_end(const Model& model, const std::vector<Point>& points) {
  SurfaceFitter fitter = fitter_of(model);
  correct_first(fitter, model, points);
  const SurfaceEquations equations = fitter.correction().equations();
  const std::size_t stride = fitter.correction().stride();
  const ShapeLandmarks places(model.view(), LandmarkPlaces::surface);
  REQUIRE(places.edges() > 8);
  MeasuredEdges edges;
  for (std::size_t i = places.nodes() - places.edges(); i < places.nodes(); ++i) {
    if (equations.shape[i] < 188) continue;       // the first sample is not quite flat
    const float along = equations.directions[i];  // x: the root of the robust weight
    if (along == 0)
      ++edges.missing;
    else
      edges.ends.push_back(equations.shape[i] + equations.distances[i] / along);
    CHECK(std::abs(equations.directions[stride + i]) <= 0.05f * std::abs(along));  // no edge of the other sides
  }
  return edges;
}

/// A plate of points every 0.75 mm, as wide and long as the flat plate.
std::vector<Point> noisy_plate(float sigma) {
  std::mt19937 random(1);
  std::vector<Point> points;
  for (float y = 0.375f; y < 90; y += 0.75f)
    for (float x = 0.25f; x <= 190; x += 0.75f) {
      float noise = -6;  // about normal: a sum of twelve uniform numbers
      for (int i = 0; i < 12; ++i) noise += static_cast<float>(random()) / static_cast<float>(std::mt19937::max());
      points.push_back({x, y, sigma * noise});
    }
  return points;
}

}  // namespace

TEST_CASE("open edges of the mesh are measured where the points end") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  const std::vector<Point> whole = points_of_flat_plate();
  for (const float end : {190.0f, 189.0f, 188.0f}) {  // or the sensor loses what is beyond
    std::vector<Point> points = whole;
    std::erase_if(points, [&](const Point& p) { return p.x > end; });
    const MeasuredEdges edges = edges_at_end(model, points);
    CAPTURE(end);
    CHECK(!edges.ends.empty());
    for (const float measured : edges.ends) {
      CHECK(measured <= end + 1e-3f);
      CHECK(measured > end - 2 * pixel);  // the second farthest point
    }
  }
}

TEST_CASE("an edge beyond which the points go on is not measured") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  std::vector<Point> points = points_of_flat_plate();
  const std::size_t of_plate = points.size();
  for (std::size_t i = 0; i < of_plate; ++i)
    if (points[i].x > 160) points.push_back({points[i].x + 30, points[i].y, points[i].z});
  const MeasuredEdges edges = edges_at_end(model, points);
  CHECK(edges.ends.empty());
  CHECK(edges.missing > 0);
}

// An end was accepted many cells away, where noise in the depths led the points out of the strip.
TEST_CASE("noise in the depths does not move the measured ends far") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  const float cell = 600 / model.view().depth_images->camera.focal;
  for (const float sigma : {0.2f, 0.5f}) {
    const MeasuredEdges edges = edges_at_end(model, noisy_plate(sigma));
    CAPTURE(sigma);
    CHECK(!edges.ends.empty());
    for (const float end : edges.ends) CHECK(std::abs(end - 190) < cell + 1);  // of an estimate that is wrong by 0.6
  }
}

TEST_CASE("open edges are those of one element, quads or triangles, with the element's other side") {
  // A strip of two quads and a triangle at its end; node 7 is observed by no camera.
  const std::vector<std::array<std::uint32_t, 4>> elements{{0, 1, 4, 3}, {1, 2, 5, 4}, {2, 6, 5, 5}, {0, 7, 1, 1}};
  const std::vector<std::uint32_t> observed{0, 1, 2, 3, 4, 5, 6};
  const SurfacePlaces places = surface_places(observed, elements, 8, false);
  std::vector<std::array<std::array<std::uint32_t, 2>, 2>> found;  // edge, opposite
  for (std::size_t i = 0; i < places.edges; ++i) {
    const auto* const of_edges = &places.between[places.between.size() - 3 * places.edges];
    const auto edge = of_edges[2 * places.edges + i], corner = of_edges[places.edges + i];
    CHECK(corner[0] == corner[1]);
    CHECK((corner[0] == edge[0] || corner[0] == edge[1]));
    std::array sorted{edge, of_edges[i]};
    for (auto& both : sorted) std::ranges::sort(both);
    found.push_back(sorted);
  }
  CHECK(surface_places(observed, elements, 8, true).edges == 0);
  std::ranges::sort(found);
  CHECK(found == std::vector<std::array<std::array<std::uint32_t, 2>, 2>>{{{{0, 3}, {1, 4}}},
                                                                          {{{1, 2}, {4, 5}}},
                                                                          {{{2, 6}, {5, 5}}},
                                                                          {{{3, 4}, {0, 1}}},
                                                                          {{{4, 5}, {1, 2}}},
                                                                          {{{5, 6}, {2, 2}}}});
}
