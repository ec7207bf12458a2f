// How far one simulation has the displacements of the test, by CWA 16799.
#include "tools/report/page/chart.hpp"
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

using Fields = std::vector<ComparedFields>;

constexpr std::array<const char*, 3> directions{"x", "y", "z"};

/// Of the one that exceeds its band most.
const ComparedFields& worst_of(const Fields& frames) {
  return *std::ranges::max_element(frames, {}, [](const ComparedFields& frame) {
    return std::abs(frame.differences[frame.largest()]) / frame.uncertainty();
  });
}

const char* answer_of(FieldAgreement agreement) {
  switch (agreement) {
    case FieldAgreement::acceptable:
      return "yes";
    case FieldAgreement::undecided:
      return "undecided";
    case FieldAgreement::not_acceptable:
      break;
  }
  return "no";
}

std::string counts_text(const FieldComparison& fields) {
  return std::to_string(fields.count(FieldAgreement::acceptable)) + " frames, " +
         std::to_string(fields.count(FieldAgreement::undecided)) + " undecided, " +
         std::to_string(fields.count(FieldAgreement::not_acceptable)) + " not";
}

std::string verdict_text(const TestReport& report) {
  const FieldComparison& fields = report.fields;
  const std::string name = "simulation " + escaped(simulation_name(report.names, *report.channels.simulation));
  const std::string answer = fields.agreement() == FieldAgreement::undecided
                                 ? "It is undecided whether " + name + " is acceptable"
                                 : "By CWA 16799, " + name + " is " +
                                       (fields.agreement() == FieldAgreement::acceptable ? "" : "not ") + "acceptable";
  return "<p><strong>" + answer + "</strong> (" + counts_text(fields) +
         "). The displacements of the surface, of the estimate and of this simulation alone at the same time since the "
         "impact, are decomposed into " +
         std::to_string(report.model.modes()) +
         " orthogonal shapes. A frame is acceptable if every coefficient is within 2 u of the test's. u combines the "
         "error of the estimate and the average residual, the part of its displacements that the shapes do not "
         "represent. A frame is undecided where u is as large as the simulations of the ensemble differ, or where the "
         "residual is larger than the error of the estimate. The estimate is a combination of simulations, so a "
         "deformation that none of them has is not compared.</p>\n";
}

std::string row_of(const ComparedFields& frame) {
  const std::size_t place = frame.largest();
  return "<tr>" + number_cell(time_text(frame.time_s)) +
         number_cell(std::to_string(frame.agreeing()) + " of " + std::to_string(frame.differences.size())) +
         number_cell(number_text(frame.differences[place])) + "<td>" + directions[place % 3] + " of shape " +
         std::to_string(place / 3 + 1) + "</td>" + number_cell(number_text(2 * frame.uncertainty())) +
         number_cell(number_text(frame.average_residual)) + number_cell(number_text(2 * frame.spread)) + "<td>" +
         answer_of(frame.agreement()) + "</td></tr>\n";
}

std::string table_of(const TestReport& report) {
  const std::string unit = " [" + escaped(report.length_unit()) + "]";
  std::string rows;
  for (const ComparedFields& frame : report.fields.frames) rows += row_of(frame);
  return "<div class=\"scroll\" tabindex=\"0\"><table><thead><tr>" + number_head("Time") + number_head("Within 2 u") +
         number_head("Largest difference" + unit) + "<th scope=\"col\">of</th>" + number_head("2 u" + unit) +
         number_head("Average residual" + unit) + number_head("2 standard deviations of the simulations" + unit) +
         "<th scope=\"col\">Acceptable</th></tr></thead>\n<tbody>" + rows + "</tbody></table></div>\n";
}

Chart chart_of(const ComparedFields& frame, const std::string& unit) {
  Chart chart;
  chart.title = "Coefficients at " + time_text(frame.time_s);
  chart.explanation =
      "Test minus simulation, in the frame whose largest difference exceeds 2 u most or comes nearest to it.";
  chart.y_unit = unit;
  chart.x_name = "shape, from coarse to fine";
  for (std::size_t mode = 0; mode < frame.differences.size() / 3; ++mode)
    chart.abscissas.push_back(static_cast<double>(mode + 1));
  for (std::size_t k = 0; k < 3; ++k) {
    Curve curve{directions[k], {}};
    for (std::size_t i = k; i < frame.differences.size(); i += 3) curve.values.push_back(frame.differences[i]);
    chart.curves.push_back(std::move(curve));
  }
  chart.limits = {{"2 u", 2 * frame.uncertainty()}, {"-2 u", -2 * frame.uncertainty()}};
  return chart;
}

}  // namespace

std::string fields_section(const TestReport& report) {
  if (report.record() == nullptr) return "";
  const std::string title =
      "<section class=\"page\" aria-label=\"Displacements\"><h2>Displacements of the surface</h2>\n";
  const FieldComparison& fields = report.fields;
  if (fields.frames.empty())
    return title + "<p>Not compared with a simulation: " + escaped(fields.why_not) + ".</p></section>\n";
  return title + verdict_text(report) + table_of(report) + "<div class=\"charts\">\n" +
         figure_of(chart_of(worst_of(fields.frames), report.length_unit())) + "</div></section>\n";
}

}  // namespace lbea::tool
