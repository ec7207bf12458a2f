// Draws meshes and clouds as the sensor sees them: parallel to its optical axis, so that lengths can be compared.
#pragma once

#include "adapters/export/png.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

inline constexpr io::Color white{255, 255, 255}, unmeasured{205, 208, 214};

/// From light blue to dark red, always darker, visible on white paper; `share` is limited to 0..1.
[[nodiscard]] io::Color color_of(double share);

/// The direction in which pictures are drawn, and the part of space that they show.
class View {
 public:
  /// `T_reference_sensor`: x right, y down, z forward; the identity stands for an unknown sensor, then a view from
  /// obliquely above.
  View(const RigidTransform& T_reference_sensor, std::uint32_t width);
  /// Enlarges the shown part by these positions (count x 3). Positions that are not finite are ignored.
  void include(std::span<const float> positions);

  struct Place {
    double column = 0, line = 0, depth = 0;  // pixels from the upper left corner, length unit from the sensor
  };
  [[nodiscard]] Place place_of(const Point& point) const;
  [[nodiscard]] std::uint32_t width() const noexcept { return width_; }
  [[nodiscard]] std::uint32_t height() const;
  /// Pixels per length unit; 0 while nothing is shown.
  [[nodiscard]] double scale() const;
  /// Of a surface: 1 when it faces the sensor, 0 when it is seen edge-on.
  [[nodiscard]] double facing(const std::array<double, 3>& normal) const;

 private:
  using Vector = std::array<double, 3>;
  [[nodiscard]] Vector in_view(const Point& point) const;
  Vector right_{}, down_{}, forward_{};
  std::uint32_t width_;
  Vector low_, high_;  // of what is shown, in the directions of the view
};

/// Colors by element; elements with positions that are not finite are left out.
[[nodiscard]] io::Picture picture_of_mesh(const View& view, std::span<const float> positions,
                                          std::span<const std::array<std::uint32_t, 4>> elements,
                                          std::span<const io::Color> colors);
/// Colors by point.
[[nodiscard]] io::Picture picture_of_cloud(const View& view, std::span<const Point> points,
                                           std::span<const io::Color> colors);

}  // namespace lbea::tool
