#include "tools/bench/clouds.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "tools/shared/cli/cloud_files.hpp"

#include <algorithm>
#include <random>

namespace lbea::tool::bench {
namespace {

BenchCloud load(const std::filesystem::path& file, std::optional<std::uint32_t> points, const std::string& columns) {
  io::PointCloud cloud = io::read_point_cloud(file, columns);
  const std::size_t size = cloud.points.size();
  if (size == 0) throw Error(Status::bad_input, file.string() + ": has no points; leave it out");
  if (points && size < *points)
    throw Error(Status::bad_input, file.string() + ": has " + std::to_string(size) + " points, fewer than the " +
                                       std::to_string(*points) + " requested; request fewer or leave it out");
  return {file.filename().string(), cloud.stamp_ns.value_or(0),
          points ? resized(cloud.points, *points, 0) : std::move(cloud.points)};
}

}  // namespace

std::vector<BenchCloud> load_clouds(const std::vector<std::string>& paths, std::optional<std::uint32_t> points,
                                    const std::string& columns) {
  std::vector<BenchCloud> clouds;
  for (const std::filesystem::path& file : find_clouds(paths)) clouds.push_back(load(file, points, columns));
  return clouds;
}

std::vector<Point> resized(std::span<const Point> points, std::size_t count, float jitter) {
  std::vector<Point> result(count);
  std::minstd_rand random(1);
  const auto shift = [&] {  // in -jitter..jitter, independent of the standard library
    const auto steps = static_cast<float>(random() - std::minstd_rand::min());
    return jitter * (2 * steps / static_cast<float>(std::minstd_rand::max()) - 1);
  };
  for (std::size_t i = 0; i < count; ++i) {
    const bool repeats = i >= points.size();
    const std::size_t from = count <= points.size() ? i * points.size() / count : i % points.size();
    result[i] = points[from];
    if (repeats) result[i] = {result[i].x + shift(), result[i].y + shift(), result[i].z + shift()};
  }
  return result;
}

std::uint32_t most_points(std::span<const BenchCloud> clouds) {
  std::size_t most = 0;
  for (const BenchCloud& cloud : clouds) most = std::max(most, cloud.points.size());
  return static_cast<std::uint32_t>(most);
}

}  // namespace lbea::tool::bench
