#include "runtime/src/model/read_views.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace lbea {

using format::SectionId;

std::shared_ptr<const ViewData> read_views(const SectionReader& sections, const format::Info& info) {
  if (sections.find(SectionId::view_camera) == nullptr) return nullptr;
  const auto require = [&](bool holds, SectionId id, const char* what) {
    if (!holds) sections.fail(id, 0, what);
  };
  format::ViewCameraWords words;
  const auto numbers = sections.required<double>(SectionId::view_camera, {sizeof(words) / sizeof(double), 1, 1});
  require(std::ranges::all_of(numbers, format::is_measured<double>), SectionId::view_camera,
          "a value is not finite or beyond all measure");
  std::memcpy(&words, numbers.data(), sizeof(words));
  require(std::ranges::all_of(std::array{words.focal, words.depth_step, words.misfit_limit, words.test_misfit_limit},
                              [](double v) { return v >= 1 / format::largest_measure; }),
          SectionId::view_camera, "a value is not positive");
  const auto size = sections.required<std::uint32_t>(SectionId::view_size, {2, 1, 1});
  constexpr std::uint32_t most_along_an_axis = 1u << 14;
  require(std::ranges::all_of(size, [](std::uint32_t cells) { return cells > 0 && cells <= most_along_an_axis; }),
          SectionId::view_size, "an impossible number of cells");

  auto views = std::make_shared<ViewData>();
  std::ranges::transform(words.T_reference_sensor, views->camera.T_reference_sensor.begin(),
                         [](double v) { return static_cast<float>(v); });
  views->camera.focal = static_cast<float>(words.focal);
  views->camera.centre_column = static_cast<float>(words.centre_column);
  views->camera.centre_row = static_cast<float>(words.centre_row);
  views->camera.depth_origin = static_cast<float>(words.depth_origin);
  views->camera.depth_step = static_cast<float>(words.depth_step);
  views->camera.columns = size[0];
  views->camera.rows = size[1];
  views->misfit_limit = static_cast<float>(words.misfit_limit);
  views->test_misfit_limit = static_cast<float>(words.test_misfit_limit);
  views->depths =
      sections.required<std::uint16_t>(SectionId::view_depths, {info.samples, padded_cells(views->camera), 1});
  views->expected = sections.required<float>(SectionId::view_expected, {info.samples, 1, 1});
  require(std::ranges::all_of(views->expected, [](float v) { return v >= 0 && format::is_measured(v); }),
          SectionId::view_expected, "a value is negative or not finite");
  return views;
}

}  // namespace lbea
