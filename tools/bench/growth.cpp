#include "tools/bench/growth.hpp"

#include "adapters/files/atomic_file.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace lbea::tool::bench {
namespace {

constexpr std::array<std::size_t, 10> point_counts{1'000,  2'000,   5'000,   10'000,  20'000,
                                                   50'000, 100'000, 200'000, 500'000, 1'000'000};
constexpr std::size_t most_clouds = 4;
constexpr float point_jitter = 0.1f;  // length unit: what the sensor's noise would do

// Fewer of the large ones, but enough for a median.
Schedule schedule_for(std::size_t points) {
  constexpr std::size_t points_in_all = 20'000'000;
  return {.frames = static_cast<std::uint32_t>(std::clamp<std::size_t>(points_in_all / points, 30, 300)), .warm_up = 6};
}

// From the middle of the list, one after the other as a camera delivers them: a search may begin where the frame before
// ended.
std::vector<BenchCloud> chosen(std::span<const BenchCloud> clouds, std::size_t points) {
  const std::size_t count = std::min(most_clouds, clouds.size());
  std::vector<BenchCloud> result;
  for (const BenchCloud& cloud : clouds.subspan((clouds.size() - count) / 2, count))
    result.push_back({cloud.name, cloud.stamp_ns, resized(cloud.points, points, point_jitter)});
  return result;
}

void check(const Model& model, const MatcherConfig& config, Pipeline& product, const BenchCloud& cloud) {
  const Question question{model.view(), config.method, config.T_reference_sensor, config.max_matches};
  if (const auto wrong = Judge(question, cloud.points).disagreement(product.answer(cloud.frame())))
    throw Error(Status::bad_input, cloud.name + " with " + std::to_string(cloud.points.size()) + " points: " + *wrong);
}

}  // namespace

std::vector<GrowthRow> growth_with_points(const Model& model, const MatcherConfig& config, const MakePipelines& make,
                                          std::span<const BenchCloud> clouds, const Announce& announce) {
  std::vector<GrowthRow> rows;
  for (const std::size_t points : point_counts) {
    announce(std::to_string(points) + " points");
    const std::vector<BenchCloud> sized = chosen(clouds, points);
    MatcherConfig sized_config = config;
    sized_config.max_points = static_cast<std::uint32_t>(points);
    const auto pipelines = make(sized_config);
    check(model, sized_config, *pipelines.front(), sized.front());
    for (const Measurement& m : measure(pipelines, sized, schedule_for(points), [](std::uint64_t) {}))
      rows.push_back({points, m.pipeline, m.stage_us(processor_stage)});
  }
  return rows;
}

void write_growth(const std::filesystem::path& path, std::string_view size_name, const std::vector<GrowthRow>& rows) {
  io::AtomicFile file(path);
  file.write(std::string(size_name) + ",pipeline,frames,p50_us,p90_us,p99_us,max_us\n");
  for (const GrowthRow& row : rows) {
    std::array<char, 128> numbers{};
    std::snprintf(numbers.data(), numbers.size(), "%zu,%.3f,%.3f,%.3f,%.3f", row.us.count, row.us.p50, row.us.p90,
                  row.us.p99, row.us.max);
    file.write(std::to_string(row.size) + ",\"" + row.pipeline + "\"," + numbers.data() + "\n");
  }
  file.commit();
}

}  // namespace lbea::tool::bench
