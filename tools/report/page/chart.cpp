#include "tools/report/page/chart.hpp"

#include "tools/report/page/html.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace lbea::tool {
namespace {

// Units of the SVG.
constexpr double width = 560, height = 230, left = 58, right = 12, top = 10, bottom = 40;

struct Style {
  const char *color, *dashes;
};
/// Distinguishable without color too, and with contrast 4.5 on white.
constexpr std::array<Style, 6> styles{{{"#0064a4", ""},
                                       {"#b84500", "7 3"},
                                       {"#00754f", "2 3"},
                                       {"#a0477d", "9 3 2 3"},
                                       {"#6b5a00", "4 2"},
                                       {"#5a5f66", "1 2"}}};
const Style& style_of(std::size_t curve) { return styles[curve % styles.size()]; }

struct Axis {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void include(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  void widen() {
    if (low > high) low = 0, high = 1;
    if (low < high) return;
    const double around = low == 0 ? 1 : std::abs(low) * 0.1;
    low -= around;
    high += around;
  }
};

class Plot {
 public:
  explicit Plot(const Chart& chart) : chart_(chart) {
    for (const double x : chart.abscissas) x_.include(x);
    if (chart.from_zero) y_.include(0);
    for (const Curve& curve : chart.curves)
      for (const double y : curve.values) y_.include(y);
    for (const Limit& limit : chart.limits) y_.include(limit.value);
    for (const Band& band : chart.bands) include(band);
    x_.widen();
    y_.widen();
    y_.high += 0.04 * (y_.high - y_.low);
    if (chart.most > 0) y_.high = chart.most;
  }
  [[nodiscard]] std::string svg() const;

 private:
  void include(const Band& band) {
    if (band.curve >= chart_.curves.size()) return;
    const std::vector<double>& values = chart_.curves[band.curve].values;
    for (std::size_t i = 0; i < std::min(values.size(), band.half_widths.size()); ++i)
      for (const double sign : {-1.0, 1.0}) y_.include(values[i] + sign * band.half_widths[i]);
  }
  [[nodiscard]] double column(double x) const {
    return left + (x - x_.low) / (x_.high - x_.low) * (width - left - right);
  }
  [[nodiscard]] double line(double y) const {
    const double share = std::clamp((y - y_.low) / (y_.high - y_.low), 0.0, 1.0);
    return height - bottom - share * (height - top - bottom);
  }
  [[nodiscard]] std::size_t size(const std::vector<double>& values) const {
    return std::min(values.size(), chart_.abscissas.size());
  }
  [[nodiscard]] std::string axes() const;
  [[nodiscard]] std::string band(const Band& band) const;
  [[nodiscard]] std::string curve(std::size_t number) const;
  [[nodiscard]] std::vector<std::size_t> shown(const std::vector<double>& values) const;
  const Chart& chart_;
  Axis x_, y_;
};

std::string text_at(double x, double y, const char* anchor, const std::string& escaped_text) {
  return formatted("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor) + escaped_text + "</text>";
}

/// With as many decimals as the distance of the ticks needs.
std::string tick_text(double value, const std::vector<double>& ticks) {
  if (ticks.size() < 2) return number_text(value);
  const double step = ticks[1] - ticks[0], place = std::floor(std::log10(step) + 1e-9);
  if (place < -4 || place > 5) return formatted("%.3g", value);
  return formatted("%.*f", std::max(0, -static_cast<int>(place)), std::abs(value) < step / 2 ? 0.0 : value);
}

std::string Plot::axes() const {
  std::string svg;
  const std::vector<double> lines = round_numbers(y_.low, y_.high, 4), columns = round_numbers(x_.low, x_.high, 7);
  for (const double y : lines) {
    svg += formatted("<path class=\"grid\" d=\"M%.1f %.1fH%.1f\"/>", left, line(y), width - right);
    svg += text_at(left - 6, line(y) + 4, "end", tick_text(y, lines));
  }
  for (const double x : columns) {
    svg += formatted("<path class=\"grid\" d=\"M%.1f %.1fV%.1f\"/>", column(x), top, height - bottom);
    svg += text_at(column(x), height - bottom + 16, "middle", tick_text(x, columns));
  }
  svg += text_at((left + width - right) / 2, height - 6, "middle", escaped(chart_.x_name));
  const double middle = (top + height - bottom) / 2;
  return svg + formatted("<text transform=\"translate(13 %.1f) rotate(-90)\" text-anchor=\"middle\">", middle) +
         escaped(chart_.y_unit) + "</text>";
}

/// The positions to draw: all, or of long curves in every column the first, the lowest, the highest, and one in a gap.
std::vector<std::size_t> Plot::shown(const std::vector<double>& values) const {
  std::vector<std::size_t> all;
  const std::size_t count = size(values);
  constexpr std::size_t most = 1500;
  if (count <= most) {
    for (std::size_t i = 0; i < count; ++i) all.push_back(i);
    return all;
  }
  for (std::size_t begin = 0, end = 0; begin < count; begin = end) {
    while (end < count && std::lround(column(chart_.abscissas[end])) == std::lround(column(chart_.abscissas[begin])))
      ++end;
    end = std::max(end, begin + 1);  // an abscissa that is not finite
    std::vector<std::size_t> kept{begin};
    std::size_t low = begin, high = begin;
    for (std::size_t i = begin; i < end; ++i) {
      if (!std::isfinite(values[i])) kept.push_back(i);
      if (values[i] < values[low] || !std::isfinite(values[low])) low = i;
      if (values[i] > values[high] || !std::isfinite(values[high])) high = i;
    }
    if (kept.size() > 2) kept.resize(2);
    kept.insert(kept.end(), {low, high});
    std::ranges::sort(kept);
    all.insert(all.end(), kept.begin(), std::unique(kept.begin(), kept.end()));
  }
  return all;
}

/// One outline per uninterrupted part.
std::string Plot::band(const Band& band) const {
  const std::vector<double>& values = chart_.curves[band.curve].values;
  std::string path, lower;
  const auto close = [&] {
    if (!lower.empty()) path += lower + "Z";
    lower.clear();
  };
  for (const std::size_t i : shown(values)) {
    const double half = i < band.half_widths.size() ? band.half_widths[i] : std::numeric_limits<double>::quiet_NaN();
    if (!std::isfinite(values[i] + half + chart_.abscissas[i])) {
      close();
      continue;
    }
    const double x = column(chart_.abscissas[i]);
    path += formatted("%c%.1f %.1f", lower.empty() ? 'M' : 'L', x, line(values[i] + half));
    lower = formatted("L%.1f %.1f", x, line(values[i] - half)) + lower;
  }
  close();
  return "<path fill=\"" + std::string(style_of(band.curve).color) + "\" fill-opacity=\"0.18\" d=\"" + path + "\"/>";
}

/// A single value between gaps is a dot.
std::string Plot::curve(std::size_t number) const {
  const std::vector<double>& values = chart_.curves[number].values;
  std::string path;
  bool is_open = false;
  for (const std::size_t i : shown(values)) {
    const bool is_known = std::isfinite(values[i] + chart_.abscissas[i]);
    if (is_known) {
      const double x = column(chart_.abscissas[i]), y = line(values[i]);
      path += is_open ? formatted("L%.1f %.1f", x, y) : formatted("M%.1f %.1fh0.01", x, y);
    }
    is_open = is_known;
  }
  const Style& style = style_of(number);
  return formatted("<path class=\"curve\" stroke=\"%s\" stroke-dasharray=\"%s\" d=\"", style.color, style.dashes) +
         path + "\"/>";
}

std::string Plot::svg() const {
  std::string svg = formatted("<svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" aria-label=\"", width, height) +
                    escaped(chart_.title) + "\">" + axes();
  for (const Band& shaded : chart_.bands)
    if (shaded.curve < chart_.curves.size()) svg += band(shaded);
  for (std::size_t i = 0; i < chart_.curves.size(); ++i) svg += curve(i);
  for (const Limit& limit : chart_.limits) {
    svg += formatted("<path class=\"limit\" d=\"M%.1f %.1fH%.1f\"/>", left, line(limit.value), width - right);
    svg += text_at(width - right - 4, line(limit.value) - 4, "end", escaped(limit.name));
  }
  return svg + "</svg>";
}

std::string legend_of(const Chart& chart) {
  std::string legend = "<ul class=\"legend\">";
  for (std::size_t i = 0; i < chart.curves.size(); ++i)
    legend += formatted(
                  "<li><svg viewBox=\"0 0 34 8\" aria-hidden=\"true\"><path class=\"curve\" stroke=\"%s\" "
                  "stroke-dasharray=\"%s\" d=\"M1 4H33\"/></svg>",
                  style_of(i).color, style_of(i).dashes) +
              escaped(chart.curves[i].name) + "</li>";
  for (const Band& band : chart.bands)
    legend += formatted(
                  "<li><svg viewBox=\"0 0 34 8\" aria-hidden=\"true\"><path fill=\"%s\" fill-opacity=\"0.18\" d=\"M1 "
                  "0H33V8H1Z\"/></svg>",
                  style_of(band.curve).color) +
              escaped(band.name) + "</li>";
  return legend + "</ul>";
}

}  // namespace

bool Chart::has_values() const {
  return std::ranges::any_of(curves, [](const Curve& curve) {
    return std::ranges::any_of(curve.values, [](double value) { return std::isfinite(value); });
  });
}

std::vector<double> round_numbers(double low, double high, int count) {
  const double step = rounded_up((high - low) / std::max(count, 1));
  std::vector<double> numbers;
  constexpr int most = 50;  // where adding the step changes nothing
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && numbers.size() < most; ++k)
    numbers.push_back(k * step);
  if (numbers.empty()) numbers.push_back(low);
  return numbers;
}

double rounded_up(double value) {
  if (!(value > 0) || !std::isfinite(value)) return 1;
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (value <= factor * power * (1 + 1e-9)) return factor * power;
  return 10 * power;
}

std::string figure_of(const Chart& chart) {
  return "<figure><figcaption><h3>" + escaped(chart.title) + "</h3><p>" + escaped(chart.explanation) +
         "</p></figcaption>" + Plot(chart).svg() + legend_of(chart) + "</figure>\n";
}

}  // namespace lbea::tool
