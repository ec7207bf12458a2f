#include "tools/eval/experiments.hpp"

#include "precompute/registration/alignment.hpp"
#include "precompute/rig/counter_random.hpp"
#include "tools/shared/matching/transformed.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace lbea::tool {
namespace {

void need_two(std::size_t runs) {
  if (runs < 2)
    throw Error(Status::bad_config,
                "an evaluation needs at least two runs, one as a simulation and one as an experiment; there are " +
                    std::to_string(runs));
}

Split without(std::size_t runs, std::vector<std::size_t> experiments) {
  std::ranges::sort(experiments);
  Split split{{}, std::move(experiments)};
  for (std::size_t run = 0; run < runs; ++run)
    if (!std::ranges::binary_search(split.experiments, run)) split.simulations.push_back(run);
  return split;
}

std::vector<std::size_t> random_order(std::size_t runs, std::uint64_t seed) {
  std::vector<std::size_t> order(runs);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = runs - 1; i > 0; --i)
    std::swap(order[i], order[bake::splitmix(bake::splitmix(seed) ^ i) % (i + 1)]);
  return order;
}

constexpr double patch_radius = 0.07;  // share of the diagonal of the box

/// Random numbers in [0, 1).
class Sequence {
 public:
  explicit Sequence(std::uint64_t seed) : key_(bake::splitmix(seed)) {}
  double next() { return static_cast<double>(bake::splitmix(key_ ^ ++count_) >> 11) * 0x1p-53; }

 private:
  std::uint64_t key_, count_ = 0;
};

double squared_distance(const Point& a, const Point& b) {
  const double x = double{a.x} - double{b.x}, y = double{a.y} - double{b.y}, z = double{a.z} - double{b.z};
  return x * x + y * y + z * z;
}

/// Rounded to whole points.
std::size_t share_of(const std::vector<Point>& points, double share) {
  return static_cast<std::size_t>(std::lround(static_cast<double>(points.size()) * std::clamp(share, 0.0, 1.0)));
}

/// Removes the `most` points that are nearest to `place`, except those beyond `radius`.
void remove_nearest(std::vector<Point>& points, const Point& place, std::size_t most, double radius) {
  std::vector<double> distances;
  for (const Point& p : points) distances.push_back(squared_distance(p, place));
  auto sorted = distances;
  std::ranges::nth_element(sorted, sorted.begin() + static_cast<std::ptrdiff_t>(most - 1));
  const double limit = std::min(radius * radius, sorted[most - 1]);
  std::size_t at = 0;
  std::erase_if(points, [&](const Point&) { return distances[at++] <= limit; });
}

double diagonal(const std::vector<Point>& points) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Point low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};
  for (const Point& p : points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return points.empty() ? 0 : std::sqrt(squared_distance(low, high));
}

using Vec = std::array<double, 3>;

constexpr std::uint32_t along = 60, around = 48;  // number of nodes
constexpr double final_length = 0.6;

struct Box {
  Vec low, size;
  std::size_t axis = 0;  // the longest side
};

Box box_of(std::span<const float> positions) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Box box{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  for (std::size_t i = 0; i < positions.size(); ++i) {
    box.low[i % 3] = std::min(box.low[i % 3], double{positions[i]});
    box.size[i % 3] = std::max(box.size[i % 3], double{positions[i]});
  }
  for (std::size_t i = 0; i < 3; ++i) {
    box.size[i] -= box.low[i];
    if (box.size[i] > box.size[box.axis]) box.axis = i;
  }
  return box;
}

Eigen::Isometry3d pose_error(const Disturbance& disturbance, double share, const Point& center, std::uint64_t seed) {
  Sequence random(seed);
  const auto direction = [&random] {
    const double z = 2 * random.next() - 1, angle = 2 * std::numbers::pi * random.next(), flat = std::sqrt(1 - z * z);
    return Eigen::Vector3d(flat * std::cos(angle), flat * std::sin(angle), z);
  };
  bake::Vector6 motion;
  motion << share * disturbance.pose_error_deg * std::numbers::pi / 180 * direction(),
      share * disturbance.pose_error * direction();
  return bake::motion_about({double{center.x}, double{center.y}, double{center.z}}, 1, motion);
}

/// Points in the unit cube: u along the component, v around it.
using UnitSurface = Vec (*)(double u, double v);

Vec tube(double u, double v) {
  return {u, 0.5 + 0.5 * std::cos(2 * std::numbers::pi * v), 0.5 + 0.5 * std::sin(2 * std::numbers::pi * v)};
}
Vec narrow_box(double u, double v) {
  const double side = std::floor(4 * v), at = 4 * v - side;
  const std::array<std::array<double, 2>, 5> corners{{{0.3, 0}, {0.7, 0}, {0.7, 1}, {0.3, 1}, {0.3, 0}}};
  const auto& a = corners[static_cast<std::size_t>(side) % 4];
  const auto& b = corners[static_cast<std::size_t>(side) % 4 + 1];
  return {u, std::lerp(a[0], b[0], at), std::lerp(a[1], b[1], at)};
}
Vec corrugated_plate(double u, double v) { return {u, v, 0.5 + 0.3 * std::sin(6 * std::numbers::pi * v)}; }
Vec ball(double u, double v) {
  const double polar = std::numbers::pi * u, r = 0.5 * std::sin(polar);
  return {0.5 - 0.5 * std::cos(polar), 0.5 + r * std::cos(2 * std::numbers::pi * v),
          0.5 + r * std::sin(2 * std::numbers::pi * v)};
}

class ShapeRun final : public bake::SimulationReader {
 public:
  ShapeRun(UnitSurface shape, const Box& box, std::vector<double> times)
      : shape_(shape), box_(box), times_(std::move(times)) {
    mesh_.positions = at(1);
    for (std::uint32_t i = 0; i < along * around; ++i) mesh_.node_ids.push_back(i + 1);
    for (std::uint32_t j = 0; j + 1 < along; ++j)
      for (std::uint32_t i = 0; i + 1 < around; ++i) {
        const std::uint32_t node = j * around + i;
        mesh_.elements.push_back({node, node + 1, node + 1 + around, node + around});
        mesh_.element_ids.push_back(static_cast<std::uint32_t>(mesh_.elements.size()));
        mesh_.element_parts.push_back(1);
      }
  }
  const bake::SimulationMesh& mesh() const noexcept override { return mesh_; }
  const std::vector<bake::SimulationField>& fields() const noexcept override { return fields_; }
  std::uint32_t states() const noexcept override { return static_cast<std::uint32_t>(times_.size()); }
  double time_s(std::uint32_t state) const override { return times_.at(state); }
  void read(std::uint32_t state, bake::SimulationState& into) override {
    into.time_s = times_.at(state);
    into.positions =
        at(std::lerp(1.0, final_length,
                     static_cast<double>(state) / static_cast<double>(std::max<std::size_t>(times_.size() - 1, 1))));
    into.alive.assign(mesh_.elements.size(), 1);
    into.fields.clear();
  }
  std::vector<std::filesystem::path> files() const override { return {}; }

 private:
  [[nodiscard]] std::vector<float> at(double length) const {
    std::vector<float> positions;
    for (std::uint32_t j = 0; j < along; ++j)
      for (std::uint32_t i = 0; i < around; ++i) {
        const Vec unit = shape_(static_cast<double>(j) / (along - 1), static_cast<double>(i) / (around - 1));
        Vec p{};
        for (std::size_t k = 0; k < 3; ++k) {
          const std::size_t axis = (box_.axis + k) % 3;
          p[axis] = box_.low[axis] + box_.size[axis] * unit[k] * (k == 0 ? length : 1);
        }
        for (const double value : p) positions.push_back(static_cast<float>(value));
      }
    return positions;
  }

  UnitSurface shape_;
  Box box_;
  std::vector<double> times_;
  bake::SimulationMesh mesh_;
  std::vector<bake::SimulationField> fields_;
};

/// Sample times of the simulation with the most samples.
std::vector<double> times_of(const Model& model) {
  std::vector<std::vector<double>> times(model.simulations());
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    times[model.sample(s).simulation].push_back(model.sample_time_s(s));
  return *std::ranges::max_element(times, {}, &std::vector<double>::size);
}

}  // namespace

Split random_split(std::size_t runs, double share, std::uint64_t seed) {
  need_two(runs);
  if (!(share > 0 && share < 1))
    throw Error(Status::bad_config,
                "the share of experiments must lie between 0 and 1, it is " + std::to_string(share));
  std::vector<std::size_t> order = random_order(runs, seed);
  const auto wanted = static_cast<std::size_t>(std::lround(share * static_cast<double>(runs)));
  order.resize(std::clamp<std::size_t>(wanted, 1, runs - 1));
  return without(runs, std::move(order));
}

Split named_split(std::span<const bake::EnsembleRun> runs, std::span<const std::string> experiments) {
  std::vector<std::size_t> chosen;
  for (const std::string& name : experiments) {
    const auto found = std::ranges::find(runs, name, &bake::EnsembleRun::name);
    if (found == runs.end())
      throw Error(Status::bad_config, "the ensemble has no run '" + name + "' to use as an experiment");
    const auto run = static_cast<std::size_t>(found - runs.begin());
    if (std::ranges::find(chosen, run) == chosen.end()) chosen.push_back(run);
  }
  Split split = without(runs.size(), std::move(chosen));
  if (split.simulations.empty())
    throw Error(Status::bad_config, "all runs are experiments; leave at least one as a simulation");
  return split;
}

std::vector<Split> leave_one_out(std::size_t runs) {
  need_two(runs);
  std::vector<Split> splits;
  for (std::size_t run = 0; run < runs; ++run) splits.push_back(without(runs, {run}));
  return splits;
}

std::vector<Split> folds(std::size_t runs, std::size_t count, std::uint64_t seed) {
  need_two(runs);
  if (count < 2 || count > runs)
    throw Error(Status::bad_config, std::to_string(count) + " folds of " + std::to_string(runs) +
                                        " runs; give a number from 2 to the number of runs");
  const std::vector<std::size_t> order = random_order(runs, seed);
  std::vector<Split> splits;
  for (std::size_t i = 0; i < count; ++i)
    splits.push_back(without(runs, {order.begin() + static_cast<std::ptrdiff_t>(i * runs / count),
                                    order.begin() + static_cast<std::ptrdiff_t>((i + 1) * runs / count)}));
  return splits;
}

bake::Ensemble subset(const bake::Ensemble& ensemble, std::span<const std::size_t> runs) {
  bake::Ensemble chosen{{}, ensemble.parameter_names, 0};
  for (const std::size_t run : runs) {
    if (run == ensemble.reference_run) chosen.reference_run = chosen.runs.size();
    chosen.runs.push_back(ensemble.runs[run]);
  }
  return chosen;
}

bake::SensingNoise disturbed(bake::SensingNoise noise, const Disturbance& disturbance) {
  noise.sigma = disturbance.noise.value_or(noise.sigma);
  noise.outliers = disturbance.outliers.value_or(noise.outliers);
  return noise;
}

std::vector<Point> hide_patches(std::vector<Point> points, double share, double radius, std::uint64_t seed) {
  const std::size_t remain = share_of(points, 1 - share);
  Sequence random(seed);
  while (points.size() > remain) {
    const Point center = points[static_cast<std::size_t>(random.next() * static_cast<double>(points.size()))];
    remove_nearest(points, center, points.size() - remain, radius);
  }
  return points;
}

std::vector<Point> hide_nearest(std::vector<Point> points, double share, const Point& place) {
  if (const std::size_t hidden = share_of(points, share); hidden > 0)
    remove_nearest(points, place, hidden, std::numeric_limits<double>::infinity());
  return points;
}

namespace {

/// Sums over the pixels above and to the left, which give the sum over a box of pixels by four of them.
class PixelSums {
 public:
  explicit PixelSums(const bake::StereoSensor& sensor)
      : sensor_(sensor), sums_((std::size_t{sensor.width_px} + 1) * (sensor.height_px + 1)) {}
  struct Sum {
    double depths = 0, points = 0;
  };
  void add(const Point& p) {
    const auto [column, row] = pixel(p);
    if (column < 0 || row < 0 || column >= width() || row >= height()) return;
    Sum& sum = at(column + 1, row + 1);
    sum.depths += double{p.z};
    sum.points += 1;
  }
  void finish() {
    const auto add_to = [](Sum& sum, const Sum& other, double sign) {
      sum.depths += sign * other.depths;
      sum.points += sign * other.points;
    };
    for (int row = 1; row <= height(); ++row)
      for (int column = 1; column <= width(); ++column) {
        Sum& sum = at(column, row);
        add_to(sum, at(column - 1, row), 1);
        add_to(sum, at(column, row - 1), 1);
        add_to(sum, at(column - 1, row - 1), -1);
      }
  }
  /// Over a square of pixels around the point's.
  [[nodiscard]] Sum around(const Point& p, int side) {
    const auto [column, row] = pixel(p);
    const int left = std::clamp(column - side / 2, 0, width()),
              right = std::clamp(column - side / 2 + side, 0, width()), top = std::clamp(row - side / 2, 0, height()),
              bottom = std::clamp(row - side / 2 + side, 0, height());
    const Sum &a = at(right, bottom), &b = at(left, bottom), &c = at(right, top), &d = at(left, top);
    return {a.depths - b.depths - c.depths + d.depths, a.points - b.points - c.points + d.points};
  }

 private:
  [[nodiscard]] int width() const { return static_cast<int>(sensor_.width_px); }
  [[nodiscard]] int height() const { return static_cast<int>(sensor_.height_px); }
  Sum& at(int column, int row) {
    return sums_[static_cast<std::size_t>(row) * (sensor_.width_px + 1) + static_cast<std::size_t>(column)];
  }
  [[nodiscard]] std::pair<int, int> pixel(const Point& p) const {
    const auto place = [&](float across, std::uint32_t size) {
      return static_cast<int>(std::floor(sensor_.focal_px * across / p.z + 0.5f * static_cast<float>(size)));
    };
    return {place(p.x, sensor_.width_px), place(p.y, sensor_.height_px)};
  }

  bake::StereoSensor sensor_;
  std::vector<Sum> sums_;
};

}  // namespace

std::vector<Point> smeared(std::vector<Point> points, const bake::StereoSensor& sensor, std::uint32_t window) {
  constexpr double least_full = 0.75;
  PixelSums sums(sensor);
  for (const Point& p : points) sums.add(p);
  sums.finish();
  std::vector<Point> kept;
  for (const Point& p : points) {
    const auto [depths, count] = sums.around(p, static_cast<int>(window));
    if (count < least_full * window * window) continue;
    const auto scale = static_cast<float>(depths / count / double{p.z});
    kept.push_back({scale * p.x, scale * p.y, scale * p.z});
  }
  return kept;
}

Point any_of_them(std::span<const Point> points, std::uint64_t seed) {
  return points[static_cast<std::size_t>(Sequence(seed).next() * static_cast<double>(points.size()))];
}

std::vector<Point> thin(std::vector<Point> points, double share, std::uint64_t seed) {
  Sequence random(seed);
  std::erase_if(points, [&](const Point&) { return random.next() >= share; });
  return points;
}

std::vector<Point> misplaced(std::vector<Point> points, const Disturbance& disturbance, double share,
                             const RigidTransform& T_reference_sensor, const Point& center, std::uint64_t seed) {
  const Eigen::Isometry3d T = bake::to_isometry(T_reference_sensor);
  const RigidTransform moved = bake::to_transform(T.inverse() * pose_error(disturbance, share, center, seed) * T);
  for (Point& p : points) p = transformed(moved, p);
  return points;
}

PoseError left_over(const RigidTransform& correction, const Disturbance& disturbance, double share, const Point& center,
                    std::uint64_t seed) {
  const Eigen::Isometry3d left = bake::to_isometry(correction) * pose_error(disturbance, share, center, seed);
  const Eigen::Vector3d middle(double{center.x}, double{center.y}, double{center.z});
  return {Eigen::AngleAxisd(left.rotation()).angle() * 180 / std::numbers::pi, (left * middle - middle).norm()};
}

std::vector<Point> disturbed(std::vector<Point> points, const Disturbance& disturbance, std::uint64_t seed,
                             const std::optional<Point>& place) {
  if (disturbance.hidden > 0) {
    const double radius = patch_radius * diagonal(points);
    points = hide_patches(std::move(points), disturbance.hidden, radius, bake::splitmix(seed ^ 1));
  }
  if (disturbance.connected > 0 && !points.empty()) {
    const Point middle = place ? *place : any_of_them(points, bake::splitmix(seed ^ 3));
    points = hide_nearest(std::move(points), disturbance.connected, middle);
  }
  if (disturbance.kept < 1) points = thin(std::move(points), disturbance.kept, bake::splitmix(seed ^ 2));
  return points;
}

std::vector<Experiment> other_components(const Model& model) {
  const Box box = box_of(model.node_positions(0));
  const auto times = times_of(model);
  std::vector<Experiment> experiments;
  for (const auto& [name, shape] : std::initializer_list<std::pair<const char*, UnitSurface>>{
           {"tube", tube}, {"narrow box", narrow_box}, {"corrugated plate", corrugated_plate}, {"ball", ball}})
    experiments.push_back(
        {name, [shape = shape, box, times] { return std::make_unique<ShapeRun>(shape, box, times); }});
  return experiments;
}

}  // namespace lbea::tool
