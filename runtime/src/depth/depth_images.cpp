#include "runtime/src/depth/depth_images.hpp"

#include "runtime/src/model/model_view.hpp"
#include "runtime/src/numbers/elementary.hpp"

namespace lbea {
namespace {

RigidTransform inverse(const RigidTransform& T) noexcept {
  RigidTransform inverted;
  for (std::size_t i = 0; i < 3; ++i) {
    double shift = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      inverted[4 * i + k] = T[4 * k + i];
      shift -= double{T[4 * k + i]} * double{T[4 * k + 3]};
    }
    inverted[4 * i + 3] = static_cast<float>(shift);
  }
  return inverted;
}

/// The copy of the model keeps the mapping that holds the images.
SensorViews kept_views(const Model& model, const DepthImages& images) {
  auto kept = std::make_shared<std::pair<Model, DepthImages>>(model, images);
  return SensorViews(std::shared_ptr<const DepthImages>(kept, &kept->second));
}

/// Squared: of the axes' directions, and of the origins in units of the component's distance.
float pose_difference(const RigidTransform& pose, const DepthCamera& camera) noexcept {
  float turn = 0, shift = 0;
  for (std::size_t i = 0; i < pose.size(); ++i) {
    const float squared = square(pose[i] - camera.T_reference_sensor[i]);
    (i % 4 == 3 ? shift : turn) += squared;
  }
  return turn + shift / std::max(square(camera.depth_origin), std::numeric_limits<float>::min());
}

}  // namespace

SensorViews SensorViews::baked_into(const Model& model) {
  return model.view().depth_images == nullptr ? SensorViews() : kept_views(model, *model.view().depth_images);
}

[[gnu::cold]] SensorViews SensorViews::baked_into(const Model& model, const RigidTransform& T_reference_sensor) {
  const ModelView& view = model.view();
  if (view.depth_images == nullptr) return {};
  const auto difference = [&](const std::shared_ptr<const DepthImages>& images) {
    return pose_difference(T_reference_sensor, images->camera);
  };
  const auto nearest = std::ranges::min_element(view.more_depth_images, {}, difference);
  const bool is_first =
      nearest == view.more_depth_images.end() || difference(view.depth_images) <= difference(*nearest);
  return kept_views(model, is_first ? *view.depth_images : **nearest);
}

std::uint32_t SensorViews::columns() const noexcept { return data_ ? data_->camera.columns : 0; }
std::uint32_t SensorViews::rows() const noexcept { return data_ ? data_->camera.rows : 0; }
const RigidTransform& SensorViews::T_reference_sensor() const noexcept {
  return data_ ? data_->camera.T_reference_sensor : identity_transform;
}

[[gnu::cold]] std::vector<float> SensorViews::depth_image(std::uint32_t sample) const {
  std::vector<float> image;
  if (!data_) return image;
  const DepthCamera& camera = data_->camera;
  for (const std::uint16_t depth : data_->of_sample(sample).first(camera.cells()))
    image.push_back(depth == empty_cell ? std::numeric_limits<float>::quiet_NaN()
                                        : camera.depth_origin + camera.depth_step * static_cast<float>(depth));
  return image;
}

float SensorViews::expected_residual(std::uint32_t sample) const noexcept {
  return data_ && sample < data_->expected.size() ? data_->expected[sample] : 0;
}
float SensorViews::misfit_limit() const noexcept { return data_ ? data_->misfit_limit : 0; }
float SensorViews::test_misfit_limit() const noexcept { return data_ ? data_->test_misfit_limit : 0; }

[[gnu::cold]] double ErrorBound::per_spread_at(double spread) const noexcept {
  return growth == 0 || !(spread > 0) ? per_spread : per_spread * exponential(growth * logarithm(spread / typical));
}

CameraPlace DepthCamera::place_of(const std::array<float, 3>& position) const noexcept {
  std::array<float, 3> of_camera{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t k = 0; k < 3; ++k)
      of_camera[axis] += (position[k] - T_reference_sensor[4 * k + 3]) * T_reference_sensor[4 * k + axis];
  const float depth = of_camera[2], column = center_column + focal * of_camera[0] / depth,
              row = center_row + focal * of_camera[1] / depth;
  const bool is_inside =
      depth > 0 && column >= 0 && column < static_cast<float>(columns) && row >= 0 && row < static_cast<float>(rows);
  return {depth, is_inside ? static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column) : cells()};
}

[[gnu::cold]] FrameDepthImage::FrameDepthImage(const DepthCamera& camera)
    : raster_{camera.focal,          camera.center_column, camera.center_row, camera.depth_origin,
              1 / camera.depth_step, camera.columns,       camera.rows},
      T_sensor_reference_(inverse(camera.T_reference_sensor)),
      tallies_(camera.cells() + 1),
      points_(camera.cells()),
      cells_(padded_cells(camera), nothing_seen) {}

void FrameDepthImage::build(const CloudIndex& index) noexcept {
  std::ranges::fill(tallies_, CellTally{});
  index.add_depths(T_sensor_reference_, raster_, tallies_.data());
  const std::size_t cells = points_.size();
  float points = 0, filled = 0;
  const auto total = [this](std::size_t cell, float CellTally::Sum::*of) {
    const auto& four = tallies_[cell].of;
    return (four[0].*of + four[1].*of) + (four[2].*of + four[3].*of);
  };
  for (std::size_t c = 0; c < cells; ++c) {
    points += points_[c] = total(c, &CellTally::Sum::points);
    filled += points_[c] > 0 ? 1.0f : 0.0f;
  }
  constexpr float share_of_mean = 0.25f, fewest_per_filled = 1.582f;
  is_sparse_ = points < fewest_per_filled * filled;
  const float fewest = share_of_mean * points / std::max(filled, 1.0f);
  for (std::size_t c = 0; c < cells; ++c)
    cells_[c] = points_[c] > 0 && points_[c] >= fewest ? total(c, &CellTally::Sum::depth) / points_[c] : nothing_seen;
}

}  // namespace lbea
