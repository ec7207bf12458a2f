#include "tools/bench/clouds.hpp"

#include "adapters/clouds/point_cloud.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <random>
#include <string_view>

namespace lbea::tool::bench {
namespace {

namespace fs = std::filesystem;

bool is_cloud(const fs::directory_entry& entry) {
  constexpr std::array<std::string_view, 5> extensions{".ply", ".xyz", ".txt", ".csv", ".asc"};
  return entry.is_regular_file() &&
         std::ranges::find(extensions, entry.path().extension().string()) != extensions.end();
}

std::vector<fs::path> clouds_in(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (is_cloud(entry)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

BenchCloud load(const fs::path& file, std::optional<std::uint32_t> points) {
  io::PointCloud cloud = io::read_point_cloud(file);
  const std::size_t size = cloud.points.size();
  if (size == 0) throw Error(Status::bad_input, file.string() + ": has no points; leave it out");
  if (points && size < *points)
    throw Error(Status::bad_input, file.string() + ": has " + std::to_string(size) + " points, fewer than the " +
                                       std::to_string(*points) + " requested; request fewer or leave it out");
  return {file.filename().string(), cloud.stamp_ns.value_or(0),
          points ? resized(cloud.points, *points, 0) : std::move(cloud.points)};
}

}  // namespace

// In a folder with PLY files only these are clouds: the others are tables such as truth.csv.
std::vector<BenchCloud> load_clouds(const std::vector<std::string>& paths, std::optional<std::uint32_t> points) {
  std::vector<BenchCloud> clouds;
  for (const fs::path path : paths) {
    if (!fs::exists(path))
      throw Error(Status::file_not_found, path.string() + ": no such file or folder; check the path");
    std::vector<fs::path> files = fs::is_directory(path) ? clouds_in(path) : std::vector{path};
    const auto is_ply = [](const fs::path& file) { return file.extension() == ".ply"; };
    if (files.size() > 1 && std::ranges::any_of(files, is_ply)) std::erase_if(files, std::not_fn(is_ply));
    if (files.empty())
      throw Error(Status::file_not_found,
                  path.string() + ": no clouds in this folder (.ply .xyz .txt .csv .asc); give another one");
    for (const fs::path& file : files) clouds.push_back(load(file, points));
  }
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
