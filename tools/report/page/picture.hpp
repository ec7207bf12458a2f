// Pictures as figures of the page, with colors by distance.
#pragma once

#include "tools/report/drawing/view.hpp"

#include <string>

namespace lbea::tool {

/// Colors by distance, the same for all pictures that share it.
class DistanceScale {
 public:
  /// The limit is the next round number.
  explicit DistanceScale(double largest);
  [[nodiscard]] double limit() const noexcept { return limit_; }
  /// Gray for a distance that is not finite.
  [[nodiscard]] io::Color of(float distance) const;
  [[nodiscard]] std::vector<io::Color> of(std::span<const float> distances) const;

 private:
  double limit_;
};

/// `explanation`: markup, of one sentence.
[[nodiscard]] std::string color_bar(const DistanceScale& scale, const std::string& unit, const char* explanation);

/// `alternative`: any text; `caption`: markup.
[[nodiscard]] std::string picture_figure(const io::Picture& pixels, const std::string& alternative,
                                         const std::string& caption);

}  // namespace lbea::tool
