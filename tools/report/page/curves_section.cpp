// The numbers of the frames over the time of the test.
#include "tools/report/page/frame_curves.hpp"
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::size_t most_chances = 5;

/// Probabilities of the simulations that are the likeliest ones at any time, those likely at the end first.
std::vector<std::uint32_t> leading_simulations(Rows rows) {
  std::map<std::uint32_t, double> weights;
  for (const FrameRow& row : rows)
    for (const auto& chance : row.chances) weights[chance.simulation] += double{chance.probability};
  if (!rows.empty())
    for (auto row = rows.rbegin(); row != rows.rend(); ++row)
      if (!row->chances.empty()) {
        for (const auto& chance : row->chances)
          weights[chance.simulation] += double{chance.probability} * static_cast<double>(rows.size());
        break;
      }
  std::vector<std::pair<double, std::uint32_t>> ranked;
  for (const auto& [simulation, weight] : weights) ranked.emplace_back(-weight, simulation);
  std::ranges::sort(ranked);
  std::vector<std::uint32_t> simulations;
  for (std::size_t i = 0; i < std::min(most_chances, ranked.size()); ++i) simulations.push_back(ranked[i].second);
  return simulations;
}

/// A simulation that is not among the recorded ones of a frame is less likely than these: it is drawn as 0.
double probability_of(const FrameRow& row, std::uint32_t simulation) {
  if (row.chances.empty()) return double{FrameRow::unknown};
  const auto found = std::ranges::find(row.chances, simulation, &wire::SimulationChance::simulation);
  return found == row.chances.end() ? 0 : double{found->probability};
}

class Curves {
 public:
  explicit Curves(const TestReport& report)
      : report_(report), rows_(report.record()->rows()), unit_(report.length_unit()) {}

  [[nodiscard]] std::string html() const {
    std::string figures;
    for (const Chart& chart : {misfit(), distance(), clocks(), simulations(), branches(), turn(), shift(), coverage()})
      if (chart.has_values()) figures += figure_of(chart);
    return figures;
  }

 private:
  [[nodiscard]] Chart chart(std::string title, std::string y_unit, std::string explanation) const {
    return chart_over_time(rows_, std::move(title), std::move(y_unit), std::move(explanation));
  }
  [[nodiscard]] Chart misfit() const {
    Chart c = chart("Misfit", "misfit",
                    "Difference from the best shape, relative to that expected of an unseen run; above the limit, no "
                    "simulation fits.");
    c.curves = {{"each frame", values_of(rows_, member_value(&FrameRow::misfit))},
                {"test so far", values_of(rows_, member_value(&FrameRow::test_misfit))}};
    if (std::isfinite(report_.frame_limit)) c.limits.push_back({"limit of a frame", report_.frame_limit});
    if (std::isfinite(report_.test_limit)) c.limits.push_back({"limit of the test", report_.test_limit});
    return c;
  }
  [[nodiscard]] Chart distance() const {
    const bool is_fit = report_.state().frames > 0;
    Chart c = chart("Distance and error", unit_,
                    is_fit ? "Of the match from the estimate; and the bound below which the estimate's mean error is "
                             "in 90 % of unseen tests."
                           : "Of the best sample, by the method " + report_.settings().method + ".");
    if (!is_fit) c.y_unit = report_.settings().method == "lbea" ? unit_ + "\u00b2" : unit_;
    c.curves = {{"match from estimate", values_of(rows_, member_value(&FrameRow::distance))}};
    if (!is_fit) c.curves.front().name = "distance";
    if (is_fit)
      c.curves.push_back({"error of the estimate, 90 % bound", values_of(rows_, member_value(&FrameRow::error_90))});
    return c;
  }
  [[nodiscard]] Chart clocks() const {
    Chart c = chart(
        "Clocks", "time [ms]",
        "Time of the match in its simulation, and time since the impact by the stamps. They should run side by side.");
    c.curves = {{"match", values_of(rows_, [](const FrameRow& row) { return row.match_time_s * 1e3; })},
                {"since the impact", values_of(rows_, member_value(&FrameRow::test_time, 1e3))}};
    c.bands = {{"its standard deviation", 1, values_of(rows_, member_value(&FrameRow::test_time_sd, 1e3))}};
    return c;
  }
  [[nodiscard]] Chart simulations() const {
    Chart c = chart("Probable simulations", "probability", "Of the whole test up to each frame.");
    for (const std::uint32_t simulation : leading_simulations(rows_))
      c.curves.push_back({simulation_name(report_.names, simulation),
                          values_of(rows_, [&](const FrameRow& row) { return probability_of(row, simulation); })});
    c.most = 1.02;
    return c;
  }
  [[nodiscard]] Chart branches() const {
    Chart c = chart("Deformation branches", "probability",
                    "Groups of simulations with similar ends, by the shapes until each frame; the likeliest ones.");
    c.curves = branch_curves(rows_, report_.state().branches, &FrameRow::branches);
    c.most = 1.02;
    return c;
  }
  [[nodiscard]] Chart turn() const {
    return pose("Turn of the pose correction", "degrees", &FrameRow::pose_turn, &FrameRow::pose_turn_sd);
  }
  [[nodiscard]] Chart shift() const {
    return pose("Shift of the pose correction", unit_, &FrameRow::pose_shift, &FrameRow::pose_shift_sd);
  }
  [[nodiscard]] Chart pose(const char* title, const std::string& unit, float FitNumbers::*value,
                           float FitNumbers::*deviation) const {
    Chart c = chart(title, unit, "Estimated pose error of the rig, which is corrected.");
    c.curves = {{"correction", values_of(rows_, member_value(value))}};
    c.bands = {{"its standard deviation", 0, values_of(rows_, member_value(deviation))}};
    return c;
  }
  [[nodiscard]] Chart coverage() const {
    Chart c = chart("Coverage", "share", "Share of the surface in view that the frame shows.");
    c.curves = {{"coverage", values_of(rows_, member_value(&FrameRow::coverage))}};
    c.most = 1.02;
    return c;
  }

  const TestReport& report_;
  Rows rows_;
  std::string unit_;
};

}  // namespace

std::string curves_section(const TestReport& report) {
  if (report.record() == nullptr) return "";
  const std::size_t every = report.record()->every();
  return "<section class=\"page\" aria-label=\"Curves\"><h2>The test over time</h2>\n" +
         (every > 1 ? "<p class=\"note\">One of " + std::to_string(every) + " frames is drawn.</p>\n" : std::string()) +
         "<div class=\"charts\">\n" + Curves(report).html() + "</div></section>\n";
}

}  // namespace lbea::tool
