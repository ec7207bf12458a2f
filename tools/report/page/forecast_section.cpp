// How the end was foreseen, beside what came; the parameters that explain the test.
#include "tools/report/page/frame_curves.hpp"
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"
#include "tools/report/page/picture.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::uint32_t forecast_width = 480;  // pixels
constexpr double shown_quantile = 0.95;        // of the distances; larger ones have the color of the limit

/// What the section compares with what, and what stands against it.
std::string comparison_note(const TestReport& report) {
  const ForecastStudy& study = report.forecasts;
  std::string note = "Each frame forecasts the state that ends the simulations, from the frames until then. ";
  if (study.is_compared())
    note += "It is compared with the estimate of the test's last frame, which has an error of its own.";
  else if (study.end.empty())
    note += "The recording does not contain the last frame's result to compare it with.";
  else if (!std::isfinite(study.end_share))
    note += "It is not compared, because the time of the impact is unknown.";
  else
    note += "It is not compared, because the test ends after " + formatted("%.0f %%", 100 * study.end_share) +
            " of a simulation's duration.";
  if (report.state().verdict == wire::WireVerdict::no_simulation_fits)
    note += " No simulation fits this test: forecasts and bounds hold for tests like the ensemble's only.";
  return "<p>" + escaped(note) + "</p>\n";
}

double quantile_of(std::vector<float> values, double share) {
  std::erase_if(values, [](float value) { return !std::isfinite(value); });
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return double{*at};
}

std::string moment_figure(const TestReport& report, const ForecastMoment& moment, const View& view,
                          const DistanceScale& scale) {
  const auto& elements = report.frames.elements;
  const std::string unit = escaped(report.length_unit()), at = time_text(moment.time_s);
  const bool is_compared = report.forecasts.is_compared();
  const std::vector<io::Color> colors =
      is_compared ? scale.of(moment.element_distances) : std::vector<io::Color>(elements.size(), unmeasured);
  std::string caption =
      "<strong>Forecast at " + at + "</strong>: within " + number_text(moment.error_90) + " " + unit + " (90 %)";
  if (is_compared) caption += "; " + number_text(moment.distance) + " " + unit + " from what came";
  return picture_figure(picture_of_mesh(view, moment.positions, elements, colors), "Final shape, as forecast at " + at,
                        caption);
}

std::string shapes_of(const TestReport& report) {
  const ForecastStudy& study = report.forecasts;
  View view(report.T_reference_view, forecast_width);
  double largest = 0;
  for (const ForecastMoment& moment : study.moments) {
    if (!moment.is_shown) continue;
    view.include(moment.positions);
    largest = std::max(largest, quantile_of(moment.element_distances, shown_quantile));
  }
  view.include(study.end);
  const DistanceScale scale(largest);
  std::string html;
  if (study.is_compared())
    html += color_bar(scale, report.length_unit(), "Distance of the forecast from the estimate at the end.");
  html += "<div class=\"quad\">\n";
  for (const ForecastMoment& moment : study.moments)
    if (moment.is_shown) html += moment_figure(report, moment, view, scale);
  if (!study.end.empty()) {
    const std::vector<io::Color> plain(report.frames.elements.size(), unmeasured);
    html += picture_figure(picture_of_mesh(view, study.end, report.frames.elements, plain), "Estimate at the end",
                           "<strong>What came</strong>: the estimate of the last frame");
  }
  return html + "</div>\n";
}

Chart shape_chart(const TestReport& report) {
  Chart chart;
  chart.title = "Error of the forecast final shape";
  chart.explanation =
      "Mean over the component. The bound is part of each forecast and holds in 90 % of tests like the ensemble's.";
  chart.x_name = "time since the first frame [ms]";
  chart.y_unit = report.length_unit();
  Curve bound{"90 % bound, as forecast", {}}, came{"distance from what came", {}};
  chart.abscissas.push_back(0);  // as the other charts
  for (Curve* curve : {&bound, &came}) curve->values.push_back(double{FrameRow::unknown});
  for (const ForecastMoment& moment : report.forecasts.moments) {
    chart.abscissas.push_back(moment.time_s * 1e3);
    bound.values.push_back(moment.error_90);
    came.values.push_back(moment.distance);
  }
  chart.curves.push_back(std::move(bound));
  if (report.forecasts.is_compared()) chart.curves.push_back(std::move(came));
  return chart;
}

Chart parameter_chart(const TestReport& report, std::uint32_t parameter) {
  const Rows rows = report.record()->rows();
  const auto part = [&](float ParameterForecast::*member) {
    return values_of(rows, [=](const FrameRow& row) {
      return parameter < row.parameters.size() ? row.parameters[parameter].*member : FrameRow::unknown;
    });
  };
  const std::string name(report.model.parameter_name(parameter));
  Chart chart = chart_over_time(rows, name, name, "Simulations: " + range_text(report.model, parameter) + ".");
  chart.curves = {{"forecast", part(&ParameterForecast::value)}};
  chart.bands = {{"90 % interval", 0, part(&ParameterForecast::bound_90)}};
  chart.from_zero = false;
  return chart;
}

std::string charts_of(const TestReport& report) {
  const wire::WireForecast& last = report.forecast();
  std::vector<Chart> charts{shape_chart(report)};
  Chart branches = chart_over_time(report.record()->rows(), "Branch at the end", "probability",
                                   "Forecast of the group of simulations in which the test ends.");
  branches.curves = branch_curves(report.record()->rows(), last.branches, &FrameRow::final_branches);
  branches.most = 1.02;
  charts.push_back(std::move(branches));
  for (std::uint32_t p = 0; p < report.parameters(); ++p)
    if (last.parameters[p].is_identifiable()) charts.push_back(parameter_chart(report, p));
  std::string html = "<div class=\"charts\">\n";
  for (const Chart& chart : charts)
    if (chart.has_values()) html += figure_of(chart);
  return html + "</div>\n";
}

}  // namespace

std::string forecast_section(const TestReport& report) {
  if (report.forecasts.moments.empty()) return "";
  return "<section class=\"page\" aria-label=\"Forecast\"><h2>How the end was foreseen</h2>\n" +
         comparison_note(report) + shapes_of(report) + charts_of(report) + "</section>\n";
}

std::string parameters_section(const TestReport& report) {
  if (report.parameters() == 0) return "";
  std::string rows;
  for (std::uint32_t p = 0; p < report.parameters(); ++p) {
    const ParameterForecast& forecast = report.forecast().parameters[p];
    const bool is_known = forecast.is_identifiable();
    rows += "<tr><td>" + escaped(report.model.parameter_name(p)) + "</td>" +
            number_cell(is_known ? interval_text(double{forecast.value}, double{forecast.bound_90})
                                 : "not identifiable from the shape") +
            number_cell(range_text(report.model, p)) + number_cell(formatted("%.2f", double{forecast.r2})) + "</tr>\n";
  }
  return "<section aria-label=\"Parameters\"><h2>Which parameters explain the test</h2>\n<p>Learned from the "
         "ensemble: values with 90 % intervals after the last frame. R\u00b2 is the share of a parameter's variance "
         "that the shapes explained in left-out runs" +
         formatted("; below %.1f, the shape does not tell the parameter.</p>\n", double{least_identifiable}) +
         "<div class=\"scroll\" tabindex=\"0\"><table><thead><tr><th scope=\"col\">Parameter</th>" +
         number_head("This test") + number_head("Simulations") + number_head("R\u00b2") + "</tr></thead>\n<tbody>" +
         rows + "</tbody></table></div></section>\n";
}

}  // namespace lbea::tool
