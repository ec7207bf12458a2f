// Depth images of samples and frames, and the ranking of samples by them.
#include "precompute/depth_images/rendered_views.hpp"
#include "runtime/src/depth/depth_ranking.hpp"
#include "runtime/src/fit/surface_fit.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/model/forged_model.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

TEST_CASE("an empty cell counts against the samples that fill it only within two cells of a filled one") {
  DepthCamera camera;
  camera.columns = 9;
  camera.rows = 7;
  std::vector<float> observed(padded_cells(camera), nothing_seen);
  observed[3 * 9 + 4] = 100;
  Surroundings(camera).limit(observed);
  for (std::size_t row = 0; row < 7; ++row)
    for (std::size_t column = 0; column < 9; ++column) {
      const bool is_near = row >= 1 && row <= 5 && column >= 2 && column <= 6;
      CHECK(observed[row * 9 + column] == (row == 3 && column == 4 ? 100 : is_near ? nothing_seen : not_observed));
    }
}

TEST_CASE("cells that something hid are excluded with their surroundings until a frame shows them") {
  DepthCamera camera;
  camera.columns = 16;
  camera.rows = 12;
  const auto cell = [&](std::size_t row, std::size_t column) { return row * camera.columns + column; };
  // The component fills all rows of columns 2 to 13; the first frame lacks it from column 8 on.
  std::vector<std::uint16_t> image(padded_cells(camera), empty_cell);
  std::vector<float> frame(padded_cells(camera), nothing_seen);
  for (std::size_t row = 0; row < camera.rows; ++row)
    for (std::size_t column = 2; column < 14; ++column) {
      image[cell(row, column)] = 100;
      if (column < 8) frame[cell(row, column)] = 100;
    }
  HiddenParts parts(camera);
  HiddenCells hidden(camera);
  CHECK_FALSE(hidden.is_confirmed_by(frame));
  parts.set_frame(frame);
  CHECK(parts.find(image) == 6 * camera.rows);
  hidden.add(parts);
  REQUIRE(hidden.is_confirmed_by(frame));
  std::vector<float> next = frame;
  hidden.exclude_from(next);
  for (std::size_t row = 0; row < camera.rows; ++row)
    for (std::size_t column = 0; column < camera.columns; ++column)
      CHECK(next[cell(row, column)] == (column >= 2 && column < 8 ? 100 : column < 2 ? nothing_seen : not_observed));
  // Only these cells and their surroundings may be hidden in the next frame: not columns 2 to 5, which it lacks as
  // well.
  std::fill_n(next.begin(), next.size(), nothing_seen);
  for (std::size_t row = 0; row < camera.rows; ++row) next[cell(row, 7)] = 100;
  hidden.exclude_from(next);
  parts.set_frame(next);
  CHECK(parts.find(image) == 11 * camera.rows);
  parts.set_frame_with_known_parts(next);
  CHECK(parts.find(image) == 7 * camera.rows);
  // A frame that shows a third of them: what hid them has moved.
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t column = 8; column < 14; ++column) frame[cell(row, column)] = 100;
  CHECK_FALSE(hidden.is_confirmed_by(frame));
  hidden.remove_shown(frame);
  CHECK(hidden.is_confirmed_by(frame));
  hidden.reset();
  CHECK_FALSE(hidden.is_confirmed_by(frame));
}

// A surface at a depth of 1000 steps, seen by cells that are 10 steps wide; an edge in front of it, 300 steps nearer.
TEST_CASE("edges that are one cell elsewhere leave no residual, two cells elsewhere they do; slopes leave all of it") {
  DepthCamera camera;
  camera.columns = 16;
  camera.rows = 8;
  camera.focal = 100;
  const CellPrices prices{400, 250};
  const std::size_t cells = padded_cells(camera);
  std::vector<float> residuals(cells), own(cells);
  struct Image {
    std::uint16_t depth;
    std::size_t end, front;  // columns: filled up to the first, in front from the second on
  };
  const auto depth_at = [&](const Image& image, std::size_t cell) {
    const std::size_t column = cell % camera.columns;
    return column >= image.end ? 0 : column >= image.front ? image.depth - 300 : image.depth;
  };
  const auto square = [&](const Image& frame, const Image& sample) {
    std::vector<float> observed(cells, nothing_seen);
    std::vector<std::uint16_t> image(cells, empty_cell);
    for (std::size_t c = 0; c < camera.cells(); ++c) {
      if (depth_at(frame, c) > 0) observed[c] = static_cast<float>(depth_at(frame, c));
      image[c] = static_cast<std::uint16_t>(depth_at(sample, c));
    }
    kernels().subtract_depths(observed.data(), image.data(), cells, prices, own.data());
    return tolerant_residuals(kernels(), camera, prices, observed, image, residuals);
  };
  const Image usual{1000, 12, 8};
  for (const std::size_t end : {11u, 13u}) CHECK(square({1000, end, 8}, usual) == 0);
  for (const std::size_t front : {7u, 9u}) CHECK(square({1000, 12, front}, usual) == 0);
  CHECK(square({1000, 10, 8}, usual) == doctest::Approx(250.0 * 250 * 8 / (12 * 8)));  // one of two columns is too far
  CHECK(square({1000, 14, 8}, usual) == doctest::Approx(250.0 * 250 * 8 / (14 * 8)));
  CHECK(square({1000, 12, 6}, usual) == doctest::Approx(300.0 * 300 * 8 * 2 / (12 * 8)));
  for (const auto depth : std::array<std::uint16_t, 4>{997, 1003, 1009, 1020}) {
    CHECK(square({depth, 12, 8}, usual) == doctest::Approx((depth - 1000.0) * (depth - 1000.0)));
    CHECK(residuals == own);
  }
}

TEST_CASE(
    "cells that all of the best fill and the sensor does not count for nothing; those that some leave empty count") {
  constexpr std::size_t cells = 32;
  DepthCamera camera;
  camera.columns = cells;
  camera.rows = 1;
  // Three images of 32 cells: all fill 0-15, two of them 16-23, none 24-31.
  std::vector<std::uint16_t> depths(3 * cells, empty_cell);
  for (std::size_t s = 0; s < 3; ++s)
    for (std::size_t c = 0; c < (s == 2 ? 16u : 24u); ++c) depths[s * cells + c] = static_cast<std::uint16_t>(100 + s);
  std::vector<float> observed(cells, nothing_seen);
  for (std::size_t c = 0; c < 8; ++c) observed[c] = 100;
  DepthRanking ranking(camera, 3, {.cap = 10, .one_sided = 2});
  const std::vector<RankedSample> all{{0, 0}, {1, 0}, {2, 0}};
  ranking.rank(observed, depths, all);
  for (std::size_t c = 0; c < cells; ++c) CHECK(observed[c] == (c < 8 ? 100.0f : c < 16 ? not_observed : nothing_seen));
  REQUIRE(ranking.ranked().size() == 3);
  CHECK(ranking.ranked()[0].sample == 0);  // 8 cells right, 8 of silhouette: 8 * 2^2 / 16
  CHECK(ranking.ranked()[0].distance == doctest::Approx(2));
  CHECK(ranking.ranked()[1].sample == 1);  // one step off in 8 cells: (8 * 1 + 8 * 2^2) / 16
  CHECK(ranking.ranked()[1].distance == doctest::Approx(2.5));
  CHECK(ranking.ranked()[2].sample == 2);  // two steps off, nothing beside it: 8 * 2^2 / 8
  CHECK(ranking.ranked()[2].distance == doctest::Approx(4));
}

TEST_CASE("samples that cannot be among the best are given up: the ranking is that of whole comparisons") {
  DepthCamera camera;
  camera.columns = 60;
  camera.rows = 40;
  const std::size_t stride = padded_cells(camera);
  constexpr std::uint32_t samples = 80, capacity = 5;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> noise(-3, 3);
  // Sample s: a rectangle of depth 1000 + s whose edges depend on s; the frame is like sample 40.
  std::vector<std::uint16_t> depths(samples * stride, empty_cell);
  std::vector<std::uint32_t> filled(samples);
  std::vector<RankedSample> all;
  for (std::uint32_t s = 0; s < samples; ++s) {
    for (std::uint32_t row = 10; row < 20 + s % 7; ++row)
      for (std::uint32_t column = s / 8; column < 30 + s / 4; ++column, ++filled[s])
        depths[s * stride + row * camera.columns + column] = static_cast<std::uint16_t>(1000 + s);
    all.push_back({(s * 37) % samples, 0});
  }
  std::vector<float> frame(stride, nothing_seen);
  for (std::size_t c = 0; c < stride; ++c)
    if (depths[40 * stride + c] != empty_cell) frame[c] = 1040 + noise(random);
  DepthRanking whole(camera, capacity, {.cap = 40, .one_sided = 25}), early = whole;
  std::vector<float> observed = frame, again = frame;
  const float least = whole.rank(observed, depths, all);
  CHECK(early.rank(again, depths, all, nullptr, filled) == least);
  CHECK(observed == again);
  REQUIRE(whole.ranked().size() == capacity);
  for (std::size_t k = 0; k < capacity; ++k) {
    CHECK(early.ranked()[k].sample == whole.ranked()[k].sample);
    CHECK(early.ranked()[k].distance == whole.ranked()[k].distance);
  }
  CHECK(whole.ranked()[0].sample == 40);
}

TEST_CASE("only parts at least five cells wide may be hidden, at the image's edges too") {
  DepthCamera camera;
  camera.columns = 20;
  camera.rows = 9;
  std::vector<std::uint16_t> image(padded_cells(camera), empty_cell);
  std::fill_n(image.begin(), camera.cells(), std::uint16_t{100});
  HiddenParts parts(camera);
  const auto found = [&](std::size_t first_row, std::size_t rows, std::size_t first_column, std::size_t column_count) {
    std::vector<float> observed(image.size(), 100);
    for (std::size_t row = first_row; row < first_row + rows; ++row)
      std::fill_n(observed.begin() + static_cast<std::ptrdiff_t>(row * camera.columns + first_column), column_count,
                  nothing_seen);
    parts.set_frame(observed);
    const std::size_t count = parts.find(image);
    std::size_t visited = 0;
    parts.visit([&](std::size_t cell) { visited += observed[cell] < 0; });
    CHECK(visited == count);
    return count;
  };
  CHECK(found(0, 9, 0, 20) == 180);
  CHECK(found(0, 5, 0, 5) == 25);
  CHECK(found(4, 5, 14, 6) == 30);
  CHECK(found(2, 4, 0, 20) == 0);
  CHECK(found(0, 9, 7, 4) == 0);
  CHECK(found(3, 0, 0, 0) == 0);  // nothing of the frames before remains
}

TEST_CASE("hidden parts are the union of all squares of five cells that only the sample fills") {
  std::mt19937 random(1);
  for (const std::uint32_t columns : {4u, 5u, 59u, 60u, 61u, 63u, 64u, 65u, 68u, 130u}) {
    CAPTURE(columns);
    DepthCamera camera;
    camera.columns = columns;
    camera.rows = 13;
    const std::size_t rows = camera.rows;
    std::vector<std::uint16_t> image(padded_cells(camera), 100);
    std::vector<float> observed(padded_cells(camera), nothing_seen);
    for (std::size_t cell = 0; cell < camera.cells(); ++cell) {
      if (random() % 40 == 0) image[cell] = empty_cell;
      if (random() % 40 == 0) observed[cell] = 100;
    }
    std::vector<bool> expected(camera.cells());
    for (std::size_t row = 0; row + 5 <= rows; ++row)
      for (std::size_t column = 0; column + 5 <= columns; ++column) {
        const auto all = [&](const auto& holds) {
          for (std::size_t i = 0; i < 25; ++i)
            if (!holds((row + i / 5) * columns + column + i % 5)) return false;
          return true;
        };
        if (all([&](std::size_t cell) { return image[cell] != empty_cell && observed[cell] < 0; }))
          static_cast<void>(all([&](std::size_t cell) { return expected[cell] = true; }));
      }
    HiddenParts parts(camera);
    parts.set_frame(observed);
    CHECK(parts.find(image) == static_cast<std::size_t>(std::ranges::count(expected, true)));
    std::size_t both = 0;
    for (std::size_t cell = 0; cell < camera.cells(); ++cell) both += image[cell] != empty_cell && observed[cell] >= 0;
    CHECK(parts.filled_by_both() == both);
    std::vector<bool> found(camera.cells());
    parts.visit([&](std::size_t cell) { found[cell] = true; });
    CHECK(found == expected);
  }
}

// The edge of a hidden part is no silhouette. Before hidden parts were found per sample, the second sample, which ends
// there but lies elsewhere, was the best one: two columns of 5 x 25^2 against 10 x 5 x 5^2.
TEST_CASE("a sample that continues behind what hides it is better than one that ends there and fits less") {
  DepthCamera camera;
  camera.columns = 32;
  camera.rows = 5;
  const std::size_t stride = padded_cells(camera);
  std::vector<std::uint16_t> depths(2 * stride, empty_cell);
  std::vector<float> observed(stride, nothing_seen);
  for (std::size_t row = 0; row < 5; ++row) {
    std::fill_n(&depths[row * 32], 20, std::uint16_t{100});
    std::fill_n(&depths[stride + row * 32], 10, std::uint16_t{105});
    std::fill_n(&observed[row * 32], row == 0 ? 8 : 10, 100.0f);  // two cells less: the edge of what hides it
  }
  Surroundings(camera).limit(observed);
  DepthRanking ranking(camera, 2, {.cap = 40, .one_sided = 25, .hidden = 4});
  const float not_seen = ranking.rank_hidden(observed, depths, std::vector<RankedSample>{{0, 0}, {1, 0}});
  REQUIRE(ranking.ranked().size() == 2);
  CHECK(ranking.ranked()[0].sample == 0);
  CHECK(ranking.ranked()[0].distance == doctest::Approx((50 * 4 * 4 + 2 * 25 * 25) / 50.0));  // relative to the others
  CHECK(not_seen == doctest::Approx((50 * 4 * 4 + 2 * 25 * 25) / 50.0));  // what the frame shows fits exactly
  const double price = ((50 * 4 * 4 + 2 * 25 * 25) / 50.0 + 1) / 8, cost = (0.5 + 5) * std::log(25.01 / 0.01);
  CHECK(ranking.price_per_cost() == doctest::Approx(price));
  CHECK(ranking.ranked()[1].distance == doctest::Approx((48 * 5 * 5 + 2 * 25 * 25) / 50.0 + price * cost));
  std::vector<float> residuals(stride, 25);
  CHECK(ranking.price_hidden(observed, std::span(depths).first(stride), residuals) == 10);  // the two columns
  CHECK(std::ranges::count(residuals, 4.0f) == 10);

  CompletedImage completed(camera);
  completed.clear();
  completed.add(0.75f, std::span(depths).first(stride), residuals, ranking.hidden_price());
  completed.add(0.25f, std::span(depths).subspan(stride), std::vector<float>(stride, 0.0f), ranking.hidden_price());
  completed.finish(observed);
  for (std::size_t c = 0; c < camera.cells(); ++c)
    CHECK(completed.cells()[c] == (c % 32 < 20 && c != 8 && c != 9 ? 100 : nothing_seen));
}

// Of frames of the ensemble's own runs of which a third was hidden, one of six was matched with the state before or
// after its own, whose hidden part is smaller by a few cells.
TEST_CASE("between samples that fit nearly exactly, the depths that the frame shows decide, not their hidden parts") {
  DepthCamera camera;
  camera.columns = 32;
  camera.rows = 5;
  const std::size_t stride = padded_cells(camera);
  std::vector<float> observed(stride, nothing_seen);
  for (std::size_t row = 0; row < 5; ++row) std::fill_n(&observed[row * 32], 10, 100.0f);
  Surroundings(camera).limit(observed);
  struct Plate {
    std::uint16_t depth;
    std::uint32_t columns;  // the frame shows 10
  };
  const auto best = [&](const Plate& first, const Plate& second) {
    std::vector<std::uint16_t> depths(2 * stride, empty_cell);
    for (std::size_t row = 0; row < 5; ++row) {
      std::fill_n(&depths[row * 32], first.columns, first.depth);
      std::fill_n(&depths[stride + row * 32], second.columns, second.depth);
    }
    DepthRanking ranking(camera, 2, {.cap = 40, .one_sided = 25, .hidden = 5});
    (void)ranking.rank_hidden(observed, depths, std::vector<RankedSample>{{0, 0}, {1, 0}});
    return ranking.ranked()[0].sample;
  };
  CHECK(best({100, 20}, {101, 15}) == 0);  // hidden: 10 x 5^2 against 5 x 5^2; depths: 0 against 1
  CHECK(best({100, 20}, {100, 15}) == 1);
  CHECK(best({104, 20}, {105, 15}) == 1);  // differences of shapes: 16 against 25
  CHECK(best({102, 20}, {100, 9}) == 0);   // cells that the sample lacks do not count as exact
}

TEST_CASE("images rendered from the model are those that the bake rendered, on any number of threads") {
  const AlignedBytes one = seen_plates_model(3, 4, 1), many = seen_plates_model(3, 4, 3);
  CHECK(std::ranges::equal(one.span(), many.span()));
  const Model model = Model::view(one.span());
  const SensorViews baked = SensorViews::baked_into(model);
  REQUIRE_FALSE(baked.empty());
  std::array<float, 3> low{1e9f, 1e9f, 1e9f}, high{-1e9f, -1e9f, -1e9f};
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    for (std::size_t i = 0; i < model.node_positions(s).size(); ++i) {
      low[i % 3] = std::min(low[i % 3], model.node_positions(s)[i]);
      high[i % 3] = std::max(high[i % 3], model.node_positions(s)[i]);
    }
  const SimulationMesh mesh = plate_mesh();
  const SensorViews rendered =
      render_depth_images(model, *make_depth_renderer(rig_above(), mesh.nodes(), mesh.elements, low, high), 2);
  CHECK(std::ranges::equal(rendered.data()->depths, baked.data()->depths));
  CHECK(std::ranges::equal(rendered.data()->expected, baked.data()->expected));
  CHECK(rendered.misfit_limit() == baked.misfit_limit());
  CHECK(rendered.test_misfit_limit() == baked.test_misfit_limit());

  AlignedBytes priced = one;
  forge(priced.span(), format::SectionId::estimate_prices, [](auto&, std::span<std::byte> section) {
    const std::array prices{0.001, 0.002, 0.003, 0.004, 0.005, 0.006};
    std::memcpy(section.data(), prices.data(), sizeof(prices));
  });
  const EstimatePrices expected{.residual = 0.001f,
                                .distance = 0.002f,
                                .change = 0.003f,
                                .change_distance = 0.004f,
                                .neighbor = 0.005f,
                                .correction = 0.006f};
  const Model other = Model::view(priced.span());
  CHECK(other.view().depth_images->prices == expected);
  const SensorViews with_its_prices =
      render_depth_images(other, *make_depth_renderer(rig_above(), mesh.nodes(), mesh.elements, low, high), 2);
  CHECK(with_its_prices.data()->prices == expected);
  forge(priced.span(), format::SectionId::estimate_prices,
        [](format::SectionEntry& entry, auto&) { ++entry.id; });  // a model of an earlier version
  CHECK(Model::view(priced.span()).view().depth_images->prices == EstimatePrices());
}

TEST_CASE("the more the weights of neighbors cost, the more equal they are") {
  const AlignedBytes bytes = seen_plates_model(6, 4);
  const Model model = Model::view(bytes.span());
  const auto greatest_weight = [&](float price) {
    const SensorViews views =
        changed(SensorViews::baked_into(model), [price](DepthImages& images) { images.prices.neighbor = price; });
    SurfaceFitter fitter(model.view(), views, 1);
    std::vector<RankedSample> all;
    for (std::uint32_t s = 0; s < model.samples(); ++s) all.push_back({s, 0});
    CloudIndex index(envelope_grid(model.view().envelope), 200'000);
    index.build(seen(bent(0.77)), rig_above().T_reference_sensor);
    const SurfaceFit fit = fitter.fit(index, all);
    return std::ranges::max(fit.estimate, {}, &WeightedSample::weight).weight;
  };
  CHECK(greatest_weight(1e4f) == doctest::Approx(1.0 / model.samples()).epsilon(0.01));
  CHECK(greatest_weight(1e-3f) > 2 * greatest_weight(1e4f));
}

// The image of the rays has a whole number of them; its middle, not the sensor's, is the principal point.
TEST_CASE("a plate in front of the camera is in the middle of its depth image, whatever the size of the sensor's") {
  StereoSensor rig = rig_above();
  rig.width_px = 442;  // cells of 5 pixels with 4 rays: 353.6 rays
  rig.height_px = 222;
  std::vector<float> positions = bent(0);  // turned, so that its edges meet the cells at all places
  for (std::size_t i = 0; i < positions.size(); i += 3) {
    const float x = positions[i] - 95, y = positions[i + 1] - 45;
    positions[i] = 95 + 0.98f * x - 0.2f * y;
    positions[i + 1] = 45 + 0.2f * x + 0.98f * y;
  }
  const SimulationMesh mesh = plate_mesh();
  const auto renderer = make_depth_renderer(rig, mesh.nodes(), mesh.elements, {-20, -30, -10}, {210, 120, 10});
  const DepthCamera& camera = renderer->camera();
  std::vector<std::uint16_t> image(padded_cells(camera));
  renderer->render(positions, {}, image);
  double shares = 0, columns = 0, rows = 0;
  for (std::size_t cell = 0; cell < camera.cells(); ++cell) {
    const double share = image[cell] == empty_cell ? 0 : double{share_of(image[cell])};
    shares += share;
    columns += share * (static_cast<double>(cell % camera.columns) + 0.5);
    rows += share * (static_cast<double>(cell / camera.columns) + 0.5);
  }
  CHECK(std::abs(columns / shares - double{camera.center_column}) < 0.01);
  CHECK(std::abs(rows / shares - double{camera.center_row}) < 0.01);
}

TEST_CASE("a flat plate's depth image is the distance of its plane, and empty beside it") {
  const AlignedBytes bytes = seen_plates_model(2, 3);
  const Model model = Model::view(bytes.span());
  const SensorViews views = SensorViews::baked_into(model);
  const auto image = views.depth_image(0);
  REQUIRE(image.size() == std::size_t{views.columns()} * views.rows());
  std::size_t filled = 0;
  for (const float depth : image) {
    if (std::isnan(depth)) continue;
    ++filled;
    CHECK(depth == doctest::Approx(600).epsilon(1e-4));
  }
  // 190 x 90 mm at 600 mm and 800 px, in cells of 4 px: 63 x 30 cells, less those the right camera does not see.
  CHECK(filled > 0.9 * 63 * 30);
  CHECK(filled < 1.1 * 64 * 31);
}
