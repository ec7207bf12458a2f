// Charts of the frames' numbers over the time of a test.
#pragma once

#include "tools/report/content/test_record.hpp"
#include "tools/report/page/chart.hpp"

namespace lbea::tool {

using Rows = std::span<const FrameRow>;

/// Without curves. The abscissas are times, or numbers of frames when the stamps do not increase.
[[nodiscard]] Chart chart_over_time(Rows rows, std::string title, std::string y_unit, std::string explanation);

/// Probabilities of the branches that are the likeliest of `last`; none for a single branch.
[[nodiscard]] std::vector<Curve> branch_curves(Rows rows, std::span<const float> last,
                                               std::vector<float> FrameRow::*probabilities);

template <class Value>
[[nodiscard]] std::vector<double> values_of(Rows rows, Value value) {
  std::vector<double> values;
  values.reserve(rows.size());
  for (const FrameRow& row : rows) values.push_back(static_cast<double>(value(row)));
  return values;
}
template <class Number>
[[nodiscard]] auto member_value(float Number::*member, double factor = 1) {
  return [member, factor](const FrameRow& row) { return double{row.*member} * factor; };
}

}  // namespace lbea::tool
