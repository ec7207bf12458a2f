// Curves as SVG within the page. Numbers that are not finite leave gaps.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace lbea::tool {

struct Curve {
  std::string name;            // any text
  std::vector<double> values;  // one per abscissa; shorter: the rest is unknown
};

/// The area of value - half_width to value + half_width around a curve of the chart.
struct Band {
  std::string name;
  std::size_t curve = 0;
  std::vector<double> half_widths;
};

/// A horizontal line.
struct Limit {
  std::string name;
  double value = 0;
};

struct Chart {
  std::string title, y_unit, x_name;  // any text
  std::string explanation;            // a sentence below the title
  std::vector<double> abscissas;
  std::vector<Curve> curves;
  std::vector<Band> bands;
  std::vector<Limit> limits;
  bool from_zero = true;  // the ordinate contains 0
  double most = 0;        // the highest ordinate; 0: that of the curves

  /// Whether any curve has a finite value.
  [[nodiscard]] bool has_values() const;
};

/// A figure element with title, explanation, curves and legend.
[[nodiscard]] std::string figure_of(const Chart& chart);

/// About `count` round numbers from low to high, at least one of them within.
[[nodiscard]] std::vector<double> round_numbers(double low, double high, int count);
/// The least of 1, 2 and 5 times a power of ten that is not below `value`; 1 for a value that is not positive.
[[nodiscard]] double rounded_up(double value);

}  // namespace lbea::tool
