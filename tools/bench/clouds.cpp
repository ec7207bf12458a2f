#include "tools/bench/clouds.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "tools/shared/cli/cloud_files.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
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

class Generator {
 public:
  explicit Generator(std::span<const Point> ordinary)
      : ordinary_(ordinary),
        center_(ordinary[ordinary.size() / 2]),
        middle_(middle_of(ordinary)),
        central_(nearest_to(middle_, ordinary)) {}

  std::vector<BenchCloud> all() {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    add("equal points", [&](std::size_t) { return center_; });
    add("two places in turn", [&](std::size_t i) { return i % 2 == 0 ? center_ : ordinary_.front(); });
    add("1,000 copies of each point", [&](std::size_t i) { return some(i / 1'000); });
    add("500 copies of each point, shuffled", [&](std::size_t i) { return some(i % (ordinary_.size() / 500 + 1)); });
    add("half of the points equal", [&](std::size_t i) { return i % 2 == 0 ? center_ : ordinary_[i]; });
    add("few places, a rounding apart", [&](std::size_t) { return moved(center_, std::round(2 * uniform()) * 1e-5f); });
    add("exponentially spaced", [&](std::size_t i) { return moved_along(center_, 20 * std::exp(-60 * share(i))); });
    add("exponentially spaced shells", [&](std::size_t) { return on_sphere(center_, 20 * std::exp(-30 * uniform())); });
    for (const float radius : {1.0f, 1e-2f, 1e-4f, 1e-5f})
      add("a ball of radius " + std::to_string(radius), [&, radius](std::size_t) { return moved(center_, radius); });
    for (const float radius : {1e-5f, 1e-6f, 1e-8f, 1e-30f, 1e-40f})
      add("the origin and at most 1e" + std::to_string(std::lround(std::log10(radius))) + " about it",
          [&, radius](std::size_t) { return moved({}, radius); });
    add("32 tiny balls", [&](std::size_t i) { return moved(some(i % 32), 1e-3f); });
    for (const float radius : {5.0f, 20.0f, 60.0f})
      add("a sphere of radius " + std::to_string(std::lround(radius)),
          [&, radius](std::size_t) { return on_sphere(center_, radius); });
    for (const float radius : {0.03f, 1.0f, 45.0f})
      for (std::size_t axis = 0; axis < 3; ++axis)
        add("a ring of radius " + (radius < 1 ? std::string("0.03") : std::to_string(std::lround(radius))) + " about " +
                "xyz"[axis],
            [&, radius, axis](std::size_t) { return on_ring(middle_, radius, axis); });
    for (std::size_t axis = 0; axis < 3; ++axis)  // a hollow component has no vertices near its middle
      add(std::string("a ring about the surface and ") + "xyz"[axis],
          [&, axis](std::size_t) { return on_ring(central_, 1, axis); });
    const auto ends = std::ranges::minmax(ordinary_, {}, &Point::x);
    add("a cap about the far end", [&](std::size_t) { return on_cap(ends.min, ends.max); });
    add("a line", [&](std::size_t i) { return moved_along(center_, 100 * share(i)); });
    add("shuffled", [&](std::size_t i) { return some(i); });
    add("120 copies of each point, shuffled", [&](std::size_t i) { return some(i % (ordinary_.size() / 120 + 1)); });
    add("every second point not a number", [&](std::size_t i) { return i % 2 == 0 ? ordinary_[i] : Point{nan, 0, 0}; });
    for (const float radius : {1e-3f, 0.1f})
      add("a sphere of radius 1e" + std::to_string(std::lround(std::log10(radius))),
          [&, radius](std::size_t) { return on_sphere(middle_, radius); });
    add("a ring of radius 0.1 about the origin", [&](std::size_t) { return on_ring({}, 0.1f, 0); });
    return std::move(clouds_);
  }

 private:
  void add(std::string name, const std::function<Point(std::size_t)>& point) {
    BenchCloud cloud{std::move(name), 0, {}};
    for (std::size_t i = 0; i < ordinary_.size(); ++i) cloud.points.push_back(point(i));
    clouds_.push_back(std::move(cloud));
  }
  /// In -1..1, independent of the standard library.
  float uniform() {
    return 2 * static_cast<float>(random_() - std::minstd_rand::min()) / static_cast<float>(std::minstd_rand::max()) -
           1;
  }
  [[nodiscard]] float share(std::size_t i) const {
    return static_cast<float>(i) / static_cast<float>(ordinary_.size());
  }
  [[nodiscard]] const Point& some(std::size_t i) const { return ordinary_[i * 7'919 % ordinary_.size()]; }
  Point moved(const Point& p, float reach) {
    const float x = uniform(), y = uniform(), z = uniform();
    return {p.x + reach * x, p.y + reach * y, p.z + reach * z};
  }
  static Point moved_along(const Point& p, float distance) {
    return {p.x + distance, p.y + 0.2f * distance, p.z + 0.1f * distance};
  }
  Point on_sphere(const Point& p, float radius) {
    std::array<float, 3> to{};
    float length = 0;
    while (!(length > 0.1f && length <= 1)) {
      to = {uniform(), uniform(), uniform()};
      length = std::hypot(to[0], to[1], to[2]);
    }
    const float scale = radius / length;
    return {p.x + scale * to[0], p.y + scale * to[1], p.z + scale * to[2]};
  }

  /// About the axis through the middle of the cloud: every point of the ring is nearly as near to what is on the axis.
  Point on_ring(const Point& p, float radius, std::size_t axis) {
    const float angle = std::numbers::pi_v<float> * uniform();
    std::array<float, 3> at{p.x, p.y, p.z};
    at[(axis + 1) % 3] += radius * std::cos(angle);
    at[(axis + 2) % 3] += radius * std::sin(angle);
    return {at[0], at[1], at[2]};
  }
  /// At one end of the cloud, equally distant from the other one.
  Point on_cap(const Point& end, const Point& other) {
    const Point p = moved(end, 20);
    const auto distance = [&](const Point& q) { return std::hypot(q.x - other.x, q.y - other.y, q.z - other.z); };
    const float scale = distance(end) / distance(p);
    return {other.x + scale * (p.x - other.x), other.y + scale * (p.y - other.y), other.z + scale * (p.z - other.z)};
  }
  static Point middle_of(std::span<const Point> points) {
    const auto middle = [&](float Point::*axis) {
      const auto [least, most] = std::ranges::minmax(points, {}, axis);
      return std::midpoint(least.*axis, most.*axis);
    };
    return {middle(&Point::x), middle(&Point::y), middle(&Point::z)};
  }

  static Point nearest_to(const Point& middle, std::span<const Point> points) {
    return std::ranges::min(points, {},
                            [&](const Point& p) { return std::hypot(p.x - middle.x, p.y - middle.y, p.z - middle.z); });
  }

  std::span<const Point> ordinary_;
  Point center_, middle_, central_;
  std::minstd_rand random_{1};
  std::vector<BenchCloud> clouds_;
};

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

std::vector<BenchCloud> hostile_clouds(std::span<const Point> ordinary) { return Generator(ordinary).all(); }

}  // namespace lbea::tool::bench
