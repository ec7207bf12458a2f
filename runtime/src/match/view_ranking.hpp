// Which samples' depth images explain what a sensor saw, least residual first.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/match/nearest_samples.hpp"
#include "runtime/src/model/view_data.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

class ViewRanking {
 public:
  /// Keeps the best `capacity` samples. All memory is allocated here.
  ViewRanking(const ViewCamera& camera, std::uint32_t capacity, const ViewMetric& metric);

  /// observed: padded_cells() depths in steps; depths: the images of all samples; proposed: of which these are ranked.
  /// Cells that every one of the best fills and the sensor did not are taken for hidden, not for a hole in the
  /// component: they become `not_observed`, and count for nothing from then on. No allocation.
  void rank(std::span<float> observed, std::span<const std::uint16_t> depths,
            std::span<const RankedSample> proposed) noexcept;

  /// distance: the mean square over the cells that either image fills, in squared depth steps.
  [[nodiscard]] std::span<const RankedSample> ranked() const noexcept { return best_.ranked(); }
  [[nodiscard]] std::size_t capacity() const noexcept { return best_.capacity(); }
  [[nodiscard]] const CellPrices& prices() const noexcept { return prices_; }

 private:
  void compare(std::span<const float> observed, std::span<const std::uint16_t> depths,
               std::span<const RankedSample> proposed) noexcept;
  void hide(std::span<float> observed, std::span<const std::uint16_t> depths) noexcept;

  const Kernels& code_;
  CellPrices prices_;  // in depth steps
  BestSamples best_;
  std::vector<RankedSample> chosen_;
  std::vector<std::uint16_t> common_;  // per cell: empty where any of the best is
};

}  // namespace lbea
