#include "runtime/src/match/position_search.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace lbea;

namespace {

using Vector = std::array<float, 3>;

// As many nodes as vertices, in another order.
struct Ensemble {
  std::vector<Vector> reference;
  std::vector<std::uint32_t> correspondence;
  std::vector<float> node_positions;
  ModelView model;
  ReferenceView view;

  Ensemble(std::size_t vertices, std::size_t samples) : reference(vertices), node_positions(3 * vertices * samples) {
    model.info.nodes = static_cast<std::uint32_t>(vertices);
    model.info.samples = static_cast<std::uint32_t>(samples);
    for (std::size_t i = 0; i < vertices * samples; ++i)
      correspondence.push_back(static_cast<std::uint32_t>((i % vertices * 7 + 3) % vertices));
    model.node_positions = node_positions;
    view.vertex_positions = reference;
    view.correspondence = correspondence;
  }
  Ensemble(const Ensemble&) = delete;
  void set(std::size_t sample, std::size_t vertex, const Vector& position) {
    const std::size_t n = reference.size();
    for (std::size_t axis = 0; axis < 3; ++axis)
      node_positions[3 * (n * sample + correspondence[n * sample + vertex]) + axis] = position[axis];
  }
};

Vector sum(const Vector& a, const Vector& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

// A search without bounds, by the same distances.
void search_all(const PositionSearch& search, const Positions& e, BestSamples& best) {
  best.clear();
  for (std::uint32_t s = 0; s < best.capacity(); ++s) best.offer(s, search.distance(e, s));
}

void check_same(Ensemble& ensemble, const Positions& e) {
  PositionSearch search(ensemble.model, ensemble.view);
  BestSamples all(ensemble.model.info.samples);
  search_all(search, e, all);
  for (const std::uint32_t k : {1u, 2u, 5u, 40u}) {
    CAPTURE(k);
    BestSamples best(std::min(k, ensemble.model.info.samples));
    search.search(e, best);
    REQUIRE(best.ranked().size() == best.capacity());
    for (std::size_t i = 0; i < best.capacity(); ++i) {
      CHECK(best.ranked()[i].sample == all.ranked()[i].sample);
      CHECK(best.ranked()[i].distance == all.ranked()[i].distance);
    }
  }
}

// Not a multiple of a lane, a group of one or of two lanes; nodes in another order need n not divisible by 7.
constexpr std::initializer_list<std::size_t> vertex_counts{1, 2, 15, 16, 17, 100, 1'276, 3'001};

}  // namespace

TEST_CASE("eq. 1 is the mean distance of corresponding positions") {
  // Two samples of three nodes; two vertices; the second sample lies 2 mm off everywhere.
  const std::vector<float> node_positions{0, 0, 0, 10, 0, 0, 20, 0, 0, 0, 2, 0, 10, 2, 0, 20, 2, 0};
  const std::vector<std::uint32_t> correspondence{0, 2, 0, 1};
  const std::vector<Vector> reference{{0, 0, 0}, {20, 0, 0}};
  ModelView model;
  model.info.nodes = 3;
  model.info.samples = 2;
  model.node_positions = node_positions;
  ReferenceView view;
  view.correspondence = correspondence;
  view.vertex_positions = reference;
  Positions e(2);
  e.set(0, {0, 0, 0});
  e.set(1, {20, 0, 0});
  BestSamples best(2);
  PositionSearch(model, view).search(e, best);
  CHECK(best.ranked()[0].sample == 0);
  CHECK(best.ranked()[0].distance == 0);
  CHECK(best.ranked()[1].distance == doctest::Approx((2 + std::hypot(10.0, 2.0)) / 2));
}

// The bounds differ from the distances by noise; some samples occur twice, and frames are equal to samples.
TEST_CASE("bounds exclude no sample that a search of all finds, and ties go to the lower index") {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 1);
  const auto vector = [&](float size) {
    return Vector{size * noise(random), size * noise(random), size * noise(random)};
  };
  for (const std::size_t n : vertex_counts)
    for (const std::size_t samples : {1u, 2u, 9u, 300u})
      for (const float origin : {0.0f, 1e5f}) {
        CAPTURE(n);
        CAPTURE(samples);
        CAPTURE(origin);
        Ensemble ensemble(n, samples);
        for (Vector& v : ensemble.reference) v = sum(vector(100), {origin, -origin, origin});
        for (std::size_t s = 0; s < samples; ++s) {
          const Vector shift = vector(5);
          for (std::size_t i = 0; i < n; ++i) ensemble.set(s, i, sum(sum(ensemble.reference[i], shift), vector(1)));
        }
        const auto row = static_cast<std::ptrdiff_t>(3 * n);
        if (samples > 200)
          std::copy_n(ensemble.node_positions.begin() + 20 * row, 30 * row,
                      ensemble.node_positions.begin() + 150 * row);
        for (std::size_t frame = 0; frame < 4; ++frame) {
          Positions e(n);
          const float* like = ensemble.node_positions.data() + 3 * n * (frame * 37 % samples);
          for (std::size_t i = 0; i < n; ++i) {
            const float* at = like + 3 * ensemble.correspondence[i];
            e.set(i, sum({at[0], at[1], at[2]}, vector(static_cast<float>(frame))));
          }
          check_same(ensemble, e);
        }
      }
}

// Of samples that lie equally far from the frame as a whole, bound and distance are equal but for their rounding, which
// alone decides on the order.
TEST_CASE("a bound that is as large as the distance excludes no sample by its rounding") {
  std::mt19937 random(7);
  std::normal_distribution<float> noise(0, 1);
  for (const std::size_t n : vertex_counts)
    for (const float moved : {0.0f, 3e4f}) {
      CAPTURE(n);
      CAPTURE(moved);
      constexpr std::size_t samples = 400;
      Ensemble ensemble(n, samples);
      Positions e(n);
      for (std::size_t i = 0; i < n; ++i) {
        ensemble.reference[i] = {100 * noise(random), 100 * noise(random), 100 * noise(random)};
        e.set(i, sum(ensemble.reference[i], {moved, moved, -moved}));
      }
      for (std::size_t s = 0; s < samples; ++s) {
        Vector shift{noise(random), noise(random), noise(random)};
        const float scale = 3 / std::hypot(shift[0], shift[1], shift[2]);
        for (float& x : shift) x *= scale;
        for (std::size_t i = 0; i < n; ++i) ensemble.set(s, i, sum(e[i], shift));
      }
      check_same(ensemble, e);
    }
}
