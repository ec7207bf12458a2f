#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <limits>

namespace lbea {

SensorViews SensorViews::baked_into(const Model& model) {
  const auto& baked = model.view().views;
  if (baked == nullptr) return {};
  // The images live as long as the model's mapping, which the copy of the model keeps.
  auto kept = std::make_shared<std::pair<Model, ViewData>>(model, *baked);
  return SensorViews(std::shared_ptr<const ViewData>(kept, &kept->second));
}

std::uint32_t SensorViews::columns() const noexcept { return data_ ? data_->camera.columns : 0; }
std::uint32_t SensorViews::rows() const noexcept { return data_ ? data_->camera.rows : 0; }
const RigidTransform& SensorViews::T_reference_sensor() const noexcept {
  return data_ ? data_->camera.T_reference_sensor : identity_transform;
}

std::vector<float> SensorViews::depth_image(std::uint32_t sample) const {
  std::vector<float> image;
  if (!data_) return image;
  const ViewCamera& camera = data_->camera;
  for (const std::uint16_t depth : data_->of_sample(sample).first(camera.cells()))
    image.push_back(depth == empty_cell ? std::numeric_limits<float>::quiet_NaN()
                                        : camera.depth_origin + camera.depth_step * static_cast<float>(depth));
  return image;
}

float SensorViews::expected_residual(std::uint32_t sample) const noexcept {
  return data_ ? data_->expected[sample] : 0;
}
float SensorViews::misfit_limit() const noexcept { return data_ ? data_->misfit_limit : 0; }
float SensorViews::test_misfit_limit() const noexcept { return data_ ? data_->test_misfit_limit : 0; }

}  // namespace lbea
