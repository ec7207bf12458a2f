// The depth images' inner loops against plain ones in double precision, and against each other bit by bit.
#include "runtime/src/depth/image_comparison.hpp"
#include "runtime/src/depth/shape_regression.hpp"
#include "runtime/src/kernels/kernels.hpp"
#include "tests/runtime/match/brute_force.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>
#include <vector>

using namespace lbea;

namespace {

std::vector<const Kernels*> all_kernels() {
  std::vector<const Kernels*> found;
  for (const Kernels* const* k = available_kernels(); *k != nullptr; ++k) found.push_back(*k);
  return found;
}

struct Images {
  std::vector<float> observed;
  std::vector<std::uint16_t> sample;
};

Images random_images(std::size_t cells, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> depth(1, 65'535), coin(0, 3);
  Images images;
  for (std::size_t i = 0; i < cells; ++i) {
    const int kind = coin(random), hidden = coin(random);
    images.observed.push_back(kind > 0     ? static_cast<float>(depth(random)) + 0.25f
                              : hidden > 0 ? nothing_seen
                                           : not_observed);
    images.sample.push_back(coin(random) == 0 ? std::uint16_t{0} : static_cast<std::uint16_t>(depth(random)));
  }
  return images;
}

}  // namespace

TEST_CASE("cells cost their capped difference, or the price of the silhouette, or nothing where something hid them") {
  const CellPrices prices{4'000, 2'500};
  for (const std::size_t cells : {32u, 64u, 3'072u}) {
    const Images images = random_images(cells, static_cast<unsigned>(cells));
    double squares = 0, filled = 0;
    std::vector<double> residuals;
    for (std::size_t i = 0; i < cells; ++i) {
      const bool in_frame = images.observed[i] >= 0,
                 in_sample = images.sample[i] > 0 && images.observed[i] != not_observed;
      const double difference = static_cast<double>(images.sample[i]) - static_cast<double>(images.observed[i]);
      const double residual = in_frame && in_sample ? std::clamp(difference, -4'000.0, 4'000.0)
                              : in_frame            ? -2'500.0
                              : in_sample           ? 2'500.0
                                                    : 0.0;
      residuals.push_back(residual);
      squares += residual * residual;
      filled += in_frame || in_sample ? 1 : 0;
    }
    const CellSums first =
        all_kernels().front()->compare_depths(images.observed.data(), images.sample.data(), cells, prices);
    for (const Kernels* code : all_kernels()) {
      const CellSums sums = code->compare_depths(images.observed.data(), images.sample.data(), cells, prices);
      CHECK(std::memcmp(&sums, &first, sizeof(sums)) == 0);
      CHECK(static_cast<double>(sums.squares) == doctest::Approx(squares).epsilon(1e-5));
      CHECK(static_cast<double>(sums.filled) == filled);
      std::vector<float> got(cells);
      code->subtract_depths(images.observed.data(), images.sample.data(), cells, prices, got.data());
      for (std::size_t i = 0; i < cells; ++i) CHECK(std::abs(static_cast<double>(got[i]) - residuals[i]) < 0.01);
    }
  }
}

TEST_CASE("lines give the sums of whole images in units; a comparison is given up only when the limit is exceeded") {
  constexpr std::size_t cells = 3'072, line = ImageLines::cells;
  for (const CellPrices prices : {CellPrices{4'000, 2'500}, CellPrices{30'000, 20'000}}) {
    Images images = random_images(cells, 5);
    std::ranges::replace(images.observed, not_observed, nothing_seen);
    for (std::size_t begin = 0; begin < cells; begin += 3 * line)
      std::fill_n(images.observed.begin() + static_cast<std::ptrdiff_t>(begin), line, nothing_seen);
    const auto filled_cells =
        static_cast<double>(std::ranges::count_if(images.sample, [](std::uint16_t depth) { return depth != 0; }));
    const CellSums whole = kernels().compare_depths(images.observed.data(), images.sample.data(), cells, prices);
    const double mean = static_cast<double>(whole.squares) / static_cast<double>(whole.filled);
    const double one_sided = static_cast<double>(prices.one_sided) * static_cast<double>(prices.one_sided);
    LineComparison comparison(cells, prices);
    comparison.set_filled_lines(images.observed);
    const auto compared = [&](const Kernels& code, double bound) {
      return comparison.compare(code, images.sample.data(), static_cast<float>(bound), images.sample.data());
    };
    const LineSums first = compared(*all_kernels().front(), one_sided);
    CHECK(static_cast<double>(first.counted) < filled_cells);
    for (const Kernels* code : all_kernels()) {
      const LineSums sums = compared(*code, one_sided);
      CHECK(std::memcmp(&sums, &first, sizeof(sums)) == 0);
      const double beside = filled_cells - static_cast<double>(sums.counted);
      CHECK(static_cast<double>(sums.filled) + beside == static_cast<double>(whole.filled));
      // Each cost differs by less than two units of at most four steps.
      const double squares = static_cast<double>(sums.squares) + one_sided * beside;
      CHECK(std::abs(std::sqrt(squares / static_cast<double>(whole.filled)) - std::sqrt(mean)) < 8);
      CHECK(std::isfinite(compared(*code, mean).squares));
      CHECK(std::isinf(compared(*code, 0.2 * mean).squares));
    }
  }
}

TEST_CASE("cells that are not observed are evidence for the whole frame alone, by one comparison") {
  constexpr std::size_t cells = 3'072;
  const CellPrices prices{4'000, 2'500};
  const Images images = random_images(cells, 6);
  std::vector<float> whole = images.observed;
  std::ranges::replace(whole, not_observed, nothing_seen);
  const auto root_mean = [&](const std::vector<float>& observed) {
    return std::sqrt(static_cast<double>(mean_square(kernels(), observed, images.sample.data(), prices)));
  };
  LineComparison comparison(cells, prices);
  comparison.set_frame(images.observed);
  for (const Kernels* code : all_kernels()) {
    const LineSums sums =
        comparison.compare(*code, images.sample.data(), std::numeric_limits<float>::infinity(), images.sample.data());
    const double by_whole = static_cast<double>(sums.squares) / static_cast<double>(sums.filled);
    CHECK(std::abs(std::sqrt(by_whole) - root_mean(whole)) < 2);  // steps: depths are rounded
    CHECK(std::abs(std::sqrt(static_cast<double>(comparison.observed_mean(sums))) - root_mean(images.observed)) < 2);
  }
}

TEST_CASE(
    "a frame's image is the mean depth of the points in each cell; single points and those beside it count for "
    "nothing") {
  // A camera at the origin that looks along z; the plane z = 500 in cells of 5 mm.
  DepthCamera camera{.focal = 100,
                     .center_column = 16,
                     .center_row = 16,
                     .depth_origin = 400,
                     .depth_step = 0.01f,
                     .columns = 32,
                     .rows = 32};
  std::vector<Point> points;
  for (int row = 4; row < 20; ++row)
    for (int column = 4; column < 20; ++column)
      for (int i = 0; i < 8; ++i)
        points.push_back({5.0f * (static_cast<float>(column - 16) + 0.5f), 5.0f * (static_cast<float>(row - 16) + 0.5f),
                          500 + 0.1f * static_cast<float>(i - 4)});
  points.push_back({5.0f * 10.5f, 5.0f * 10.5f, 500});  // alone in its cell: an outlier
  points.push_back({200, 0, 500});                      // beside the image
  points.push_back({0, 0, -500});                       // behind the camera
  const std::array<std::array<float, 3>, 2> box{{{-300, -300, -600}, {300, 300, 600}}};
  CloudIndex index(bounding_grid(box, 4'096), 4'096);
  REQUIRE(index.build(points, identity_transform).used == points.size());
  FrameDepthImage view(camera);
  view.build(index);
  for (std::uint32_t row = 0; row < 32; ++row)
    for (std::uint32_t column = 0; column < 32; ++column) {
      const float cell = view.cells()[row * 32 + column];
      const bool on_plane = row >= 4 && row < 20 && column >= 4 && column < 20;
      CHECK((cell >= 0) == on_plane);
      if (on_plane) CHECK(400 + 0.01f * cell == doctest::Approx(499.95f).epsilon(1e-5));
    }
}

TEST_CASE("products with rows in 16 bits are exact within half a step of each column") {
  constexpr std::size_t rows = 7, columns = 50;
  std::mt19937 random(36);
  std::normal_distribution<float> value(0, 1);
  std::vector<float> numbers(rows * columns), vector(columns), products(rows);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = i % columns == 20 ? 0.0f : std::ldexp(value(random), static_cast<int>(i % columns) - 25);
  for (float& v : vector) v = value(random);
  double bound = 0;
  for (std::size_t c = 0; c < columns; ++c) {
    double greatest = 0;
    for (std::size_t r = 0; r < rows; ++r) greatest = std::max(greatest, std::abs(double{numbers[r * columns + c]}));
    bound += greatest * std::abs(double{vector[c]}) * (0.5 / 32'767 + 1e-5);  // and the rounding of floats
  }
  ShortRows shorts(numbers, columns);
  REQUIRE(shorts.count() == rows);
  for (const Kernels* k : all_kernels()) {
    shorts.multiply(*k, vector, products);
    for (std::size_t r = 0; r < rows; ++r) {
      const double exact = std::inner_product(vector.begin(), vector.end(), &numbers[r * columns], 0.0);
      CHECK(std::abs(double{products[r]} - exact) <= bound);
    }
  }
}

TEST_CASE("rows of zeros, and no rows, have products of zero") {
  const std::vector<float> zeros(3 * 20), vector(20, 5.0f);
  std::vector<float> products(3, 1.0f);
  ShortRows(zeros, 20).multiply(kernels(), vector, products);
  CHECK(products == std::vector<float>(3, 0.0f));
  ShortRows none({}, 20);
  none.multiply(kernels(), vector, {});
  CHECK(none.count() == 0);
}
