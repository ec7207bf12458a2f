#include "tools/bench/fit/fit_growth.hpp"

#include "runtime/src/fit/surface_fit.hpp"
#include "tools/bench/nanoflann_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace lbea::tool::bench {
namespace {

constexpr std::size_t clouds_compared = 8, repetitions = 12;

// The clouds' depth images, and the samples that eq. 3 proposes for them.
struct Proposed {
  std::vector<float> observed;
  std::vector<RankedSample> samples;
};

std::vector<BenchCloud> some_of(std::span<const BenchCloud> clouds) {
  std::vector<BenchCloud> some;
  const std::size_t count = std::min(clouds_compared, clouds.size());
  for (std::size_t k = 0; k < count; ++k) some.push_back(clouds[k * clouds.size() / count]);
  return some;
}

/// Calls work(index, proposed samples) for each cloud.
template <typename Work>
void for_each_cloud(const Model& model, const MatcherConfig& config, std::span<const BenchCloud> clouds,
                    const Work& work) {
  const std::vector<BenchCloud> some = some_of(clouds);
  MatcherConfig proposed = proposing(config);
  proposed.max_points = most_points(some);
  const auto proposer = kernels_pipeline(model, proposed, kernels(), "proposals");
  CloudIndex index(envelope_grid(model.view().envelope), proposed.max_points);
  for (const BenchCloud& cloud : some) {
    const Answer answer = proposer->answer(cloud.frame());
    index.build(cloud.points, config.T_reference_sensor);
    work(index, answer.ranked);
  }
}

/// Each cell from the nearest one.
template <typename Depth>
std::vector<Depth> resampled(std::span<const Depth> image, const DepthCamera& from, const DepthCamera& to,
                             Depth empty) {
  std::vector<Depth> cells(padded_cells(to), empty);
  for (std::size_t row = 0; row < to.rows; ++row)
    for (std::size_t column = 0; column < to.columns; ++column)
      cells[row * to.columns + column] =
          image[row * from.rows / to.rows * from.columns + column * from.columns / to.columns];
  return cells;
}

/// Images of another size.
struct Resized {
  DepthCamera camera;
  std::vector<std::uint16_t> depths;
  std::vector<std::uint32_t> filled_cells;

  Resized(const DepthImages& images, double factor) : camera(images.camera) {
    const double along = std::sqrt(factor);
    camera.columns = static_cast<std::uint32_t>(std::lround(along * images.camera.columns));
    camera.rows = static_cast<std::uint32_t>(std::lround(along * images.camera.rows));
    for (std::size_t s = 0; s < images.depths.size() / padded_cells(images.camera); ++s) {
      const auto image = resampled(images.of_sample(s), images.camera, camera, empty_cell);
      depths.insert(depths.end(), image.begin(), image.end());
      filled_cells.push_back(static_cast<std::uint32_t>(
          std::ranges::count_if(image, [](std::uint16_t depth) { return depth != empty_cell; })));
    }
  }
  [[nodiscard]] std::span<const std::uint16_t> of_sample(std::uint32_t sample) const {
    return std::span(depths).subspan(sample * padded_cells(camera), camera.cells());
  }
};

float plain_mean_square(std::span<const float> observed, std::span<const std::uint16_t> image,
                        const CellPrices& prices) {
  float squares = 0, filled = 0;
  for (std::size_t c = 0; c < image.size(); ++c) {
    const bool in_frame = observed[c] >= 0, in_sample = image[c] != empty_cell;
    if (!in_frame && !in_sample) continue;
    const float difference = std::min(std::abs(observed[c] - static_cast<float>(image[c])), prices.cap);
    squares += square(in_frame && in_sample ? difference : prices.one_sided);
    filled += 1;
  }
  return squares / std::max(filled, 1.0f);
}

std::vector<RankedSample> rank_plainly(const Resized& images, const Proposed& frame, const CellPrices& prices) {
  std::vector<RankedSample> compared = frame.samples;
  for (RankedSample& one : compared)
    one.distance = plain_mean_square(frame.observed, images.of_sample(one.sample), prices);
  return least(std::move(compared), FitSettings{}.candidates);
}

std::vector<GrowthRow> ranking_times(const Resized& images, const DepthMetric& metric,
                                     const std::vector<Proposed>& frames) {
  DepthRanking ranking(images.camera, FitSettings{}.candidates, metric);
  const CellPrices prices = prices_of(metric, images.camera);
  std::vector<double> product_us, plain_us;
  for (std::size_t i = 0; i < repetitions * frames.size(); ++i) {
    const Proposed& frame = frames[i % frames.size()];
    std::vector<float> observed = frame.observed;
    std::vector<RankedSample> plain;
    float best = 0;
    product_us.push_back(processor_us(
        [&] { best = ranking.rank(observed, images.depths, frame.samples, nullptr, images.filled_cells); }));
    plain_us.push_back(processor_us([&] { plain = rank_plainly(images, frame, prices); }));
    const float tolerance = static_cast<float>(images.camera.cells()) * 0x1p-23f * best;
    if (!(std::abs(best - plain.front().distance) <= tolerance))
      throw Error(Status::bad_input, "depth images of " + std::to_string(images.camera.cells()) +
                                         " cells: the least mean square is " + std::to_string(best) + ", should be " +
                                         std::to_string(plain.front().distance));
  }
  return {{images.camera.cells(), "ranking of the proposed", statistics_of(product_us)},
          {images.camera.cells(), "plain loops", statistics_of(plain_us)}};
}

std::vector<std::vector<float>> images_of(const Model& model, std::span<const BenchCloud> clouds,
                                          const RigidTransform& T_reference_sensor) {
  const std::vector<BenchCloud> some = some_of(clouds);
  CloudIndex index(envelope_grid(model.view().envelope), most_points(some));
  FrameDepthImage image(model.view().depth_images->camera);
  std::vector<std::vector<float>> images;
  for (const BenchCloud& cloud : some) {
    index.build(cloud.points, T_reference_sensor);
    image.build(index);
    images.emplace_back(image.cells().begin(), image.cells().end());
  }
  return images;
}

/// Each repetition of a sample is moved by up to 10 mm along the line of sight, and tilted by as much about both axes
/// of the image.
std::vector<std::uint16_t> repeated_images(const DepthImages& images, std::size_t samples) {
  const DepthCamera& camera = images.camera;
  const std::size_t stride = padded_cells(camera), different = images.depths.size() / stride;
  std::vector<std::uint16_t> depths(samples * stride, empty_cell);
  std::mt19937 random;
  const float most = images.metric.cap / 4 / camera.depth_step;
  std::uniform_real_distribution<float> steps(-most, most);
  for (std::size_t s = 0; s < samples; ++s) {
    const bool is_moved = s >= different;
    const float shift = is_moved ? steps(random) : 0, by_column = is_moved ? steps(random) : 0,
                by_row = is_moved ? steps(random) : 0;
    const auto image = images.of_sample(s % different);
    for (std::size_t cell = 0; cell < camera.cells(); ++cell) {
      if (image[cell] == empty_cell) continue;
      const auto place = [](std::size_t i, std::uint32_t count) {
        return static_cast<float>(i) / static_cast<float>(count) - 0.5f;
      };
      const float depth = static_cast<float>(image[cell]) + shift +
                          by_column * place(cell % camera.columns, camera.columns) +
                          by_row * place(cell / camera.columns, camera.rows);
      depths[s * stride + cell] = static_cast<std::uint16_t>(std::clamp(depth, 1.0f, 65'535.0f));
    }
  }
  return depths;
}

float least_plainly(std::span<const std::uint32_t> cells, std::span<const float> frame, const DepthImages& images,
                    const CellPrices& prices) {
  std::vector<float> observed;
  for (const std::uint32_t cell : cells) observed.push_back(frame[cell]);
  std::vector<std::uint16_t> of_sample(cells.size());
  float least = std::numeric_limits<float>::infinity();
  for (std::size_t s = 0; s < images.depths.size() / padded_cells(images.camera); ++s) {
    const auto image = images.of_sample(s);
    std::ranges::transform(cells, of_sample.begin(), [&](std::uint32_t cell) { return image[cell]; });
    least = std::min(least, plain_mean_square(observed, of_sample, prices));
  }
  return least;
}

}  // namespace

std::vector<GrowthRow> growth_with_cells(const Model& model, const MatcherConfig& config,
                                         std::span<const BenchCloud> clouds) {
  const DepthImages& images = *model.view().depth_images;
  FrameDepthImage image(images.camera);
  std::vector<GrowthRow> rows;
  for (const double factor : {0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
    const Resized resized(images, factor);
    std::vector<Proposed> frames;
    for_each_cloud(model, config, clouds, [&](const CloudIndex& index, std::span<const RankedSample> proposed) {
      image.build(index);
      const std::span<const float> cells = image.cells();
      frames.push_back(
          {resampled(cells, images.camera, resized.camera, nothing_seen), {proposed.begin(), proposed.end()}});
    });
    for (GrowthRow& row : ranking_times(resized, images.metric, frames)) rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<GrowthRow> growth_of_proposals(const Model& model, std::span<const BenchCloud> clouds,
                                           const RigidTransform& T_reference_sensor) {
  const DepthImages& images = *model.view().depth_images;
  const CellPrices prices = prices_of(images.metric, images.camera);
  const std::vector<std::uint32_t> cells = thinned_cells(images);
  const std::vector<std::vector<float>> frames = images_of(model, clouds, T_reference_sensor);
  std::vector<GrowthRow> rows;
  for (const std::uint32_t samples : {300u, 1'000u, 3'000u, 10'000u, 30'000u, 100'000u, 300'000u, 1'000'000u}) {
    DepthImages repeated = images;
    const std::vector<std::uint16_t> depths = repeated_images(images, samples);
    repeated.depths = depths;
    ThinnedImages thinned(repeated);
    SelectedSamples selected(std::min(FitSettings{}.proposals, samples));
    BestSamples best(8);
    std::vector<double> product_us, plain_us;
    for (std::size_t i = 0; i < repetitions * frames.size(); ++i) {
      const std::vector<float>& frame = frames[i % frames.size()];
      float least = std::numeric_limits<float>::infinity();
      product_us.push_back(processor_us([&] { thinned.propose(frame, best, selected); }));
      if (i >= frames.size()) continue;  // minutes, of a million samples
      plain_us.push_back(processor_us([&] { least = least_plainly(cells, frame, repeated, prices); }));
      // Whole steps are compared. Of many samples, nearly the best ones are found.
      const double found = std::sqrt(best.ranked()[0].distance), exact = std::sqrt(least);
      const double most = 2 + (samples > ThinnedImages::most_compared ? 1.1 : 1) * exact;
      if (!(found >= exact - 2 && found <= most))
        throw Error(Status::bad_input, std::to_string(samples) + " samples: the least thinned root mean square is " +
                                           std::to_string(found) + ", should be " + std::to_string(exact));
    }
    rows.push_back({samples, "proposals by thinned images", statistics_of(product_us)});
    rows.push_back({samples, "plain loop", statistics_of(plain_us)});
  }
  return rows;
}

std::vector<GrowthRow> growth_with_candidates(const Model& model, const MatcherConfig& config,
                                              std::span<const BenchCloud> clouds) {
  std::vector<GrowthRow> rows;
  for (const std::uint32_t candidates : {6u, 12u, 24u, 48u, 96u}) {
    FitSettings settings;
    settings.candidates = candidates;
    SurfaceFitter fitter(model.view(), SensorViews::baked_into(model), config.max_matches, settings);
    std::vector<double> us;
    for_each_cloud(model, config, clouds, [&](const CloudIndex& index, std::span<const RankedSample> proposed) {
      const auto fit = [&] {
        SurfaceFit result = fitter.fit(index, proposed);
        fitter.correct(index, result);
      };
      for (std::size_t i = 0; i < repetitions; ++i) us.push_back(processor_us(fit));
    });
    rows.push_back({candidates, "fit", statistics_of(us)});
  }
  return rows;
}

}  // namespace lbea::tool::bench
