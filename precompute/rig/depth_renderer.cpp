#include "precompute/rig/depth_renderer.hpp"

#include "precompute/rig/camera.hpp"
#include "precompute/rig/rig.hpp"
#include "precompute/rig/virtual_sensor.hpp"

#include <mutex>

namespace lbea::bake {
namespace {

/// The range of a box in the image, in cells of `rays` pixels, and in depth.
struct Extent {
  double low[3], high[3];  // column, row, depth
};

Extent extent_of(const std::array<float, 3>& low, const std::array<float, 3>& high, const StereoSensor& sensor,
                 std::uint32_t rays) {
  const Pose T_sensor_reference = to_pose(sensor.T_reference_sensor, "T_reference_sensor").inverse();
  constexpr double infinity = std::numeric_limits<double>::infinity();
  Extent extent{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};
  for (unsigned corner = 0; corner < 8; ++corner) {
    const auto side = [&](unsigned axis) {
      return static_cast<double>((corner >> axis & 1u) != 0 ? high[axis] : low[axis]);
    };
    const Vec3 p = T_sensor_reference({side(0), side(1), side(2)});
    if (!(p.z > 0))
      throw Error(Status::bad_config,
                  "a part of the ensemble lies behind the sensor; check T_reference_sensor, whose third column looks "
                  "along the optical axis");
    const double place[3] = {(sensor.focal_px * p.x / p.z + sensor.width_px / 2.0) / rays,
                             (sensor.focal_px * p.y / p.z + sensor.height_px / 2.0) / rays, p.z};
    for (std::size_t i = 0; i < 3; ++i) {
      extent.low[i] = std::min(extent.low[i], place[i]);
      extent.high[i] = std::max(extent.high[i], place[i]);
    }
  }
  return extent;
}

class StereoDepthRenderer final : public DepthRenderer {
 public:
  StereoDepthRenderer(const StereoSensor& sensor, std::size_t nodes,
                      std::span<const std::array<std::uint32_t, 4>> elements, const std::array<float, 3>& low,
                      const std::array<float, 3>& high, const DepthImageResolution& resolution)
      : rays_(resolution.rays_per_cell), rig_(scaled(sensor, rays_ / cell_size(sensor, resolution)), nodes, elements) {
    crop_to(extent_of(low, high, rig_.sensor, rays_));
  }

  [[nodiscard]] const DepthCamera& camera() const noexcept override { return camera_; }

  void render(std::span<const float> positions, std::span<const std::uint8_t> present,
              std::span<std::uint16_t> image) const override {
    measure(positions, present, [&](const sensing::MeasuredPixels& measured, std::vector<Cell>& cells) {
      cells.assign(camera_.cells(), {});
      visit_points(measured, [&](std::size_t at, const Vec3& point) {
        cells[at].sum += double{static_cast<float>(point.z)};
        ++cells[at].count;
      });
      std::ranges::fill(image, empty_cell);
      for (std::size_t cell = 0; cell < cells.size(); ++cell) image[cell] = depth_of(cells[cell]);
    });
  }

  [[nodiscard]] std::vector<Point> points(std::span<const float> positions,
                                          std::span<const std::uint8_t> present) const override {
    std::vector<Point> points;
    measure(positions, present, [&](const sensing::MeasuredPixels& measured, const std::vector<Cell>&) {
      visit_points(measured, [&](std::size_t, const Vec3& point) {
        points.push_back({static_cast<float>(point.x), static_cast<float>(point.y), static_cast<float>(point.z)});
      });
    });
    return points;
  }

  [[nodiscard]] std::size_t most_points() const noexcept override { return camera_.cells() * rays_ * rays_; }

 private:
  /// Pixels.
  [[nodiscard]] static double cell_size(const StereoSensor& sensor, const DepthImageResolution& resolution) {
    return std::max(1.0, std::round(sensor.width_px / static_cast<double>(resolution.columns)));
  }
  struct Cell {
    double sum = 0;  // depths
    std::uint32_t count = 0;
  };
  struct Workspace {
    sensing::PlacedMesh mesh;
    std::vector<Cell> cells;
  };

  /// One that no other thread uses.
  [[nodiscard]] std::unique_ptr<Workspace> take_workspace() const {
    const std::lock_guard lock(mutex_);
    if (unused_.empty()) return std::make_unique<Workspace>(Workspace{sensing::PlacedMesh(rig_), {}});
    std::unique_ptr<Workspace> workspace = std::move(unused_.back());
    unused_.pop_back();
    return workspace;
  }

  /// Of `rays` rays in a row or column; before the first cell they count from 2^32 down.
  [[nodiscard]] std::vector<std::uint32_t> cells_of(std::uint32_t rays, std::uint32_t first) const {
    std::vector<std::uint32_t> cells(rays);
    for (std::uint32_t ray = 0; ray < rays; ++ray) cells[ray] = ray / rays_ - first;
    return cells;
  }

  /// The image of the rays has a whole number of them, so that its middle is not exactly the sensor's.
  void crop_to(const Extent& extent) {
    const auto columns = static_cast<double>(rig_.sensor.width_px / rays_),
               rows = static_cast<double>(rig_.sensor.height_px / rays_);
    const double left = std::clamp(std::floor(extent.low[0]), 0.0, columns),
                 right = std::clamp(std::ceil(extent.high[0]), 0.0, columns);
    const double top = std::clamp(std::floor(extent.low[1]), 0.0, rows),
                 bottom = std::clamp(std::ceil(extent.high[1]), 0.0, rows);
    if (!(left < right && top < bottom))
      throw Error(Status::bad_config,
                  "the sensor does not see the ensemble; check T_reference_sensor, focal length and image size");
    columns_ = cells_of(rig_.sensor.width_px, static_cast<std::uint32_t>(left));
    rows_ = cells_of(rig_.sensor.height_px, static_cast<std::uint32_t>(top));
    constexpr double most_steps = 65'000, least_step = 1e-9;  // the latter: a share of the depth, for flat components
    const double step = std::max((extent.high[2] - extent.low[2]) / most_steps, least_step * extent.high[2]);
    camera_.T_reference_sensor = rig_.sensor.T_reference_sensor;
    camera_.focal = rig_.sensor.focal_px / static_cast<float>(rays_);
    camera_.center_column = static_cast<float>(rig_.sensor.width_px / 2.0 / rays_ - left);
    camera_.center_row = static_cast<float>(rig_.sensor.height_px / 2.0 / rays_ - top);
    camera_.depth_origin = static_cast<float>(extent.low[2] - 16 * step);
    camera_.depth_step = static_cast<float>(step);
    camera_.columns = static_cast<std::uint32_t>(right - left);
    camera_.rows = static_cast<std::uint32_t>(bottom - top);
  }

  /// visit(what the sensor measures, cells to use).
  template <class Visit>
  void measure(std::span<const float> positions, std::span<const std::uint8_t> present, const Visit& visit) const {
    std::unique_ptr<Workspace> workspace = take_workspace();
    workspace->mesh.place({positions, present});
    visit(workspace->mesh.measured(SensingNoise{}.min_cos_incidence), workspace->cells);
    const std::lock_guard lock(mutex_);
    unused_.push_back(std::move(workspace));
  }

  /// visit(cell, point), of the points in the cells.
  template <class Visit>
  void visit_points(const sensing::MeasuredPixels& measured, const Visit& visit) const {
    for (std::size_t i = 0; i < measured.pixels.size(); ++i) {
      const std::uint32_t column = columns_[measured.pixels[i].column], row = rows_[measured.pixels[i].row];
      if (measured.seen[i] == 0 || column >= camera_.columns || row >= camera_.rows) continue;
      visit(std::size_t{row} * camera_.columns + column, measured.points[i]);
    }
  }

  // The mean depth of what both cameras see; a cell of which they see less than a quarter is empty, as in a frame.
  [[nodiscard]] std::uint16_t depth_of(const Cell& cell) const {
    if (4 * cell.count < rays_ * rays_ || cell.count == 0) return empty_cell;
    const double steps = (cell.sum / cell.count - double{camera_.depth_origin}) / double{camera_.depth_step};
    return depth_with_share(std::clamp(std::round(steps), 1.0, 65'535.0),
                            static_cast<double>(cell.count) / (rays_ * rays_));
  }

  std::uint32_t rays_;
  sensing::Rig rig_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Workspace>> unused_;  // between images
  std::vector<std::uint32_t> columns_, rows_;               // of the cells, per column and row of the rays
  DepthCamera camera_;
};

}  // namespace

std::unique_ptr<DepthRenderer> make_depth_renderer(const StereoSensor& sensor, std::size_t nodes,
                                                   std::span<const std::array<std::uint32_t, 4>> elements,
                                                   const std::array<float, 3>& low, const std::array<float, 3>& high,
                                                   const DepthImageResolution& resolution) {
  return std::make_unique<StereoDepthRenderer>(sensor, nodes, elements, low, high, resolution);
}

}  // namespace lbea::bake
