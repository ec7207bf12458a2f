#include "tools/report/page/frame_curves.hpp"

#include <algorithm>

namespace lbea::tool {

Chart chart_over_time(Rows rows, std::string title, std::string y_unit, std::string explanation) {
  Chart chart;
  chart.title = std::move(title);
  chart.y_unit = std::move(y_unit);
  chart.explanation = std::move(explanation);
  chart.x_name = "time since the first frame [ms]";
  chart.abscissas = values_of(rows, [](const FrameRow& row) { return row.time_s * 1e3; });
  std::vector<double>& times = chart.abscissas;
  if (std::ranges::is_sorted(times) && !times.empty() && times.front() < times.back()) return chart;
  chart.x_name = "frame of the test";
  for (std::size_t i = 0; i < times.size(); ++i) times[i] = static_cast<double>(i);
  return chart;
}

std::vector<Curve> branch_curves(Rows rows, std::span<const float> last, std::vector<float> FrameRow::*probabilities) {
  constexpr std::size_t most = 5;
  std::vector<std::pair<float, std::size_t>> ranked;
  for (std::size_t i = 0; i < last.size() && last.size() > 1; ++i) ranked.emplace_back(-last[i], i);
  std::ranges::sort(ranked);
  std::vector<Curve> curves;
  for (std::size_t k = 0; k < std::min(most, ranked.size()); ++k)
    curves.push_back({"branch " + std::to_string(ranked[k].second), values_of(rows, [&](const FrameRow& row) {
                        const std::vector<float>& of_row = row.*probabilities;
                        return ranked[k].second < of_row.size() ? of_row[ranked[k].second] : FrameRow::unknown;
                      })});
  return curves;
}

}  // namespace lbea::tool
