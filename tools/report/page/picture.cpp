#include "tools/report/page/picture.hpp"

#include "tools/report/page/chart.hpp"
#include "tools/report/page/html.hpp"
#include "tools/shared/text/formatted.hpp"

#include <cmath>

namespace lbea::tool {

DistanceScale::DistanceScale(double largest) : limit_(rounded_up(largest)) {}

io::Color DistanceScale::of(float distance) const {
  return std::isfinite(distance) ? color_of(double{distance} / limit_) : unmeasured;
}

std::vector<io::Color> DistanceScale::of(std::span<const float> distances) const {
  std::vector<io::Color> colors;
  for (const float distance : distances) colors.push_back(of(distance));
  return colors;
}

std::string color_bar(const DistanceScale& scale, const std::string& unit, const char* explanation) {
  constexpr int steps = 32;
  constexpr double length = 300, bar_left = 10;
  std::string svg = "<div class=\"bar\"><svg viewBox=\"0 0 420 40\" role=\"img\" aria-label=\"Color scale\">";
  for (int i = 0; i < steps; ++i) {
    const io::Color c = color_of((i + 0.5) / steps);
    svg +=
        formatted("<rect x=\"%.2f\" y=\"2\" width=\"%.2f\" height=\"14\" fill=\"#%02x%02x%02x\"/>",
                  bar_left + i * length / steps, length / steps + 0.3, unsigned{c[0]}, unsigned{c[1]}, unsigned{c[2]});
  }
  for (const double share : {0.0, 0.5, 1.0})
    svg += formatted("<text x=\"%.1f\" y=\"31\" text-anchor=\"middle\">", bar_left + share * length) +
           number_text(share * scale.limit()) + "</text>";
  return svg + formatted("<text x=\"%.0f\" y=\"14\">", bar_left + length + 10) + escaped(unit) +
         "</text></svg></div><p class=\"note\">" + explanation + " Larger distances have the last color.</p>\n";
}

std::string picture_figure(const io::Picture& pixels, const std::string& alternative, const std::string& caption) {
  return "<figure><img src=\"" + data_url(pixels) +
         formatted("\" width=\"%u\" height=\"%u\" alt=\"", pixels.width, pixels.height) + escaped(alternative) +
         "\"><figcaption>" + caption + "</figcaption></figure>\n";
}

}  // namespace lbea::tool
