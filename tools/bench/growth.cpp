#include "tools/bench/growth.hpp"

#include "adapters/files/atomic_file.hpp"
#include "runtime/src/depth/combination.hpp"
#include "runtime/src/match/sample_search.hpp"
#include "tools/bench/fit/fit_answer.hpp"
#include "tools/bench/fit/fit_growth.hpp"
#include "tools/shared/text/formatted.hpp"

#include <cstdio>
#include <random>

namespace lbea::tool::bench {
namespace {

constexpr std::array<std::size_t, 10> point_counts{1'000,  2'000,   5'000,   10'000,  20'000,
                                                   50'000, 100'000, 200'000, 500'000, 1'000'000};
constexpr std::size_t most_clouds = 4;

// Fewer frames of large clouds, but enough for a median.
Schedule schedule_for(std::size_t points) {
  constexpr std::size_t points_in_all = 20'000'000;
  return {.frames = static_cast<std::uint32_t>(std::clamp<std::size_t>(points_in_all / points, 30, 300)), .warm_up = 6};
}

// Consecutive clouds from the middle of the list, as a camera delivers them: a search may start from the result of the
// previous frame.
std::vector<BenchCloud> sized_clouds(std::span<const BenchCloud> clouds, std::size_t points,
                                     std::string_view length_unit) {
  const float jitter = point_jitter(length_unit);
  const std::size_t count = std::min(most_clouds, clouds.size());
  std::vector<BenchCloud> result;
  for (const BenchCloud& cloud : clouds.subspan((clouds.size() - count) / 2, count))
    result.push_back({cloud.name, cloud.stamp_ns, resized(cloud.points, points, jitter)});
  return result;
}

void check_answer(const Model& model, const MatcherConfig& config, Pipeline& product, const BenchCloud& cloud) {
  if (const auto wrong = FrameCheck(task_of(model, config), cloud.points).disagreement(product.answer(cloud.frame())))
    throw Error(Status::bad_input, cloud.name + " with " + std::to_string(cloud.points.size()) + " points: " + *wrong);
}

constexpr std::array<std::size_t, 13> sample_counts{100,    200,    500,     1'000,   2'000,   5'000,    10'000,
                                                    20'000, 50'000, 100'000, 200'000, 500'000, 1'000'000};
constexpr float coefficient_jitter = 0.02f;  // of a coefficient's standard deviation over the samples
constexpr std::size_t searches = 100;
constexpr std::size_t clouds_used = 8;

struct Table {
  std::size_t modes = 0, stride = 0;
  std::vector<float> coefficients;  // samples x 3 x stride
};

std::vector<float> deviations(std::span<const float> table, std::size_t row) {
  std::vector<double> sum(row), squares(row);
  for (std::size_t i = 0; i < table.size(); ++i) {
    sum[i % row] += table[i];
    squares[i % row] += double{table[i]} * double{table[i]};
  }
  const double samples = static_cast<double>(table.size() / row);
  std::vector<float> result(row);
  for (std::size_t i = 0; i < row; ++i) {
    const double mean = sum[i] / samples;
    result[i] = static_cast<float>(std::sqrt(std::max(0.0, squares[i] / samples - mean * mean)));
  }
  return result;
}

// The samples of the model in their order, repeated with jitter.
Table replicated(const ReferenceView& reference, std::size_t samples) {
  Table table{reference.eigenvalues.size(), format::padded(reference.eigenvalues.size()), {}};
  const std::size_t row = 3 * table.stride;
  const std::vector<float> deviation = deviations(reference.coefficients, row);
  std::minstd_rand random(1);
  std::uniform_real_distribution<float> shift(-coefficient_jitter, coefficient_jitter);
  table.coefficients.resize(samples * row);
  for (std::size_t i = 0; i < table.coefficients.size(); ++i) {
    const bool repeats = i >= reference.coefficients.size();
    table.coefficients[i] = reference.coefficients[i % reference.coefficients.size()];
    if (repeats) table.coefficients[i] += shift(random) * deviation[i % row];
  }
  return table;
}

void search_by_loop(const Table& table, const Positions& e, BestSamples& best) {
  best.clear();
  for (std::size_t s = 0; s < table.coefficients.size() / (3 * table.stride); ++s) {
    const float* sample = table.coefficients.data() + 3 * table.stride * s;
    float sum = 0;
    for (std::size_t j = 0; j < table.modes; ++j) {
      const float x = e.planes[0][j] - sample[j], y = e.planes[1][j] - sample[table.stride + j],
                  z = e.planes[2][j] - sample[2 * table.stride + j];
      sum += std::sqrt(x * x + y * y + z * z);
    }
    best.offer(static_cast<std::uint32_t>(s), sum);
  }
}

std::vector<Positions> coefficients_of(const Model& model, MatcherConfig config, std::span<const BenchCloud> clouds) {
  config.max_points = most_points(clouds);
  config.method = Method::lbea;
  Matcher matcher(model, config);
  std::vector<Positions> found;
  for (std::size_t k = 0; k < std::min(clouds_used, clouds.size()); ++k) {
    const std::size_t cloud = k * clouds.size() / std::min(clouds_used, clouds.size());
    const MatchResult result = matcher.match(clouds[cloud].frame());
    Positions positions(model.modes());
    for (std::size_t j = 0; j < result.coefficients.size() / 3; ++j)
      positions.set(j, {result.coefficients[3 * j], result.coefficients[3 * j + 1], result.coefficients[3 * j + 2]});
    found.push_back(std::move(positions));
  }
  return found;
}

// The distances of the nearest samples may differ by the rounding of sums in another order.
void check_search(const BestSamples& product, const BestSamples& plain, std::size_t modes) {
  const double a = product.ranked().front().distance, b = plain.ranked().front().distance;
  if (std::abs(a - b) > 2 * static_cast<double>(modes + 16) * 0x1p-24 * b)
    throw Error(Status::bad_input, "search over " + std::to_string(modes) + " modes: nearest sample at " +
                                       std::to_string(a) + ", a simple loop finds one at " + std::to_string(b));
}

std::vector<GrowthRow> growth_with_points(const Model& model, const Selection& selection,
                                          std::span<const BenchCloud> clouds) {
  std::vector<GrowthRow> rows;
  for (const std::size_t points : point_counts) {
    std::fprintf(stderr, "lbea-bench: %zu points\n", points);
    const std::vector<BenchCloud> sized = sized_clouds(clouds, points, model.length_unit());
    Selection of_size = selection;
    of_size.matcher.max_points = static_cast<std::uint32_t>(points);
    const auto pipelines = make_pipelines(of_size, model);
    check_answer(model, of_size.matcher, *pipelines.front(), sized.front());
    for (const Measurement& m : measure(pipelines, sized, schedule_for(points), [](std::uint64_t) {}))
      rows.push_back({points, m.pipeline, m.stage_us(processor_stage)});
  }
  return rows;
}

std::vector<GrowthRow> growth_with_samples(const Model& model, const MatcherConfig& config,
                                           std::span<const BenchCloud> clouds) {
  const std::vector<Positions> e = coefficients_of(model, config, clouds);
  BestSamples best(config.max_matches), plain_best(config.max_matches);
  std::vector<GrowthRow> rows;
  for (const std::size_t samples : sample_counts) {
    std::fprintf(stderr, "lbea-bench: %zu samples\n", samples);
    const Table table = replicated(model.view().references.front(), samples);
    ReferenceView reference = model.view().references.front();
    reference.coefficients = table.coefficients;
    std::optional<SampleTree> tree;
    if (is_worth_a_tree(samples, best.capacity())) tree.emplace(table.coefficients, table.modes);
    std::vector<double> product_us, plain_us;
    for (std::size_t i = 0; i < searches; ++i) {
      const Positions& frame = e[i % e.size()];
      product_us.push_back(
          processor_us([&] { tree ? tree->search(frame, best) : search_lbea(reference, frame, best); }));
      plain_us.push_back(processor_us([&] { search_by_loop(table, frame, plain_best); }));
      check_search(best, plain_best, table.modes);
    }
    rows.push_back({samples, "search of S_proj", statistics_of(product_us)});
    rows.push_back({samples, "plain loop", statistics_of(plain_us)});
  }
  return rows;
}

}  // namespace

void write_growth(const std::filesystem::path& path, std::string_view size_name, const std::vector<GrowthRow>& rows) {
  io::AtomicFile file(path);
  file.write(std::string(size_name) + ",pipeline,frames,p50_us,p90_us,p99_us,max_us\n");
  for (const GrowthRow& row : rows) {
    file.write(std::to_string(row.size) + ",\"" + row.pipeline + "\"," +
               formatted("%zu,%.3f,%.3f,%.3f,%.3f\n", row.us.count, row.us.p50, row.us.p90, row.us.p99, row.us.max));
  }
  file.commit();
}

std::vector<std::filesystem::path> measure_growth(const std::filesystem::path& folder, const Model& model,
                                                  const Selection& selection, std::span<const BenchCloud> clouds) {
  std::filesystem::create_directories(folder);
  std::vector<std::filesystem::path> files;
  const auto write = [&](const std::string& size_name, const std::vector<GrowthRow>& rows) {
    files.push_back(folder / ("growth_" + size_name + ".csv"));
    write_growth(files.back(), size_name, rows);
  };
  write("points", growth_with_points(model, selection, clouds));
  if (selection.matcher.method != Method::fit) {
    write("samples", growth_with_samples(model, selection.matcher, clouds));
    return files;
  }
  write("samples", growth_of_proposals(model, clouds, selection.matcher.T_reference_sensor));
  write("cells", growth_with_cells(model, selection.matcher, clouds));
  write("candidates", growth_with_candidates(model, selection.matcher, clouds));
  return files;
}

}  // namespace lbea::tool::bench
