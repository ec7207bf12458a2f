// The clouds used for measurements.
#pragma once

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::tool::bench {

struct BenchCloud {
  std::string name;
  std::int64_t stamp_ns = 0;
  std::vector<Point> points;

  [[nodiscard]] Frame frame(std::uint64_t id = 0) const { return {id, stamp_ns, points}; }
};

/// Reads the clouds that find_clouds() lists. With `points`, each cloud is thinned to this number; `columns` as in
/// read_point_cloud(). Throws Error{bad_input} for a cloud without points or with fewer than `points`, and what
/// find_clouds() and read_point_cloud() throw.
[[nodiscard]] std::vector<BenchCloud> load_clouds(const std::vector<std::string>& paths,
                                                  std::optional<std::uint32_t> points, const std::string& columns = {});

/// `count` points of a cloud: evenly spaced ones, or, when it has fewer, its points repeated, each repetition moved by
/// up to `jitter` along each axis. The same arguments give the same points.
[[nodiscard]] std::vector<Point> resized(std::span<const Point> points, std::size_t count, float jitter);

/// The jitter of repeated clouds in a model's unit: 0.1 mm, similar to the noise of a sensor.
[[nodiscard]] constexpr float point_jitter(std::string_view length_unit) noexcept {
  return static_cast<float>(0.1 * units_per_mm(length_unit));
}

/// Clouds for which a search of nearest points may have to test every point for every vertex, of as many points each as
/// `ordinary`, a cloud of the component in reference coordinates: equal points, few places, tiny balls, spheres, rings,
/// exponentially spaced and denormal coordinates. The same arguments give the same points.
[[nodiscard]] std::vector<BenchCloud> hostile_clouds(std::span<const Point> ordinary);

/// Number of points of the largest cloud.
[[nodiscard]] std::uint32_t most_points(std::span<const BenchCloud> clouds);

}  // namespace lbea::tool::bench
