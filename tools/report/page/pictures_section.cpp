// Frames beside the shapes that were found for them, and where the component is explained worst.
#include "tools/report/drawing/view.hpp"
#include "tools/report/page/chart.hpp"
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"
#include "tools/shared/cli/formatted.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::uint32_t picture_width = 480, map_width = 900;
constexpr double shown_share = 0.95;  // of the distances; larger ones have the color of the limit

/// Colors by distance, the same for all pictures that share it.
class DistanceScale {
 public:
  explicit DistanceScale(double largest) : limit_(rounded_up(largest)) {}
  [[nodiscard]] double limit() const noexcept { return limit_; }
  [[nodiscard]] io::Color of(float distance) const {
    return std::isfinite(distance) ? color_of(double{distance} / limit_) : unmeasured;
  }
  [[nodiscard]] std::vector<io::Color> of(std::span<const float> distances) const {
    std::vector<io::Color> colors;
    for (const float distance : distances) colors.push_back(of(distance));
    return colors;
  }

 private:
  double limit_;
};

/// `what`: markup-free.
std::string color_bar(const DistanceScale& scale, const std::string& unit, const char* what) {
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
         "</text></svg></div><p class=\"note\">" + what +
         " Larger distances have the last color; gray: no point was measured there.</p>\n";
}

std::string picture(const io::Picture& pixels, const std::string& alternative, const std::string& caption) {
  return "<figure><img src=\"" + data_url(pixels) +
         formatted("\" width=\"%u\" height=\"%u\" alt=\"", pixels.width, pixels.height) + escaped(alternative) +
         "\"><figcaption>" + caption + "</figcaption></figure>\n";
}

std::string distance_caption(const CloudComparison& comparison, const std::string& unit) {
  return "points: mean " + number_text(comparison.mean()) + " " + escaped(unit) + ", 95 % below " +
         number_text(comparison.quantile(0.95)) + " " + escaped(unit);
}

std::string fit_text(const wire::WireResult& result, const std::string& unit) {
  std::string text = std::string(wire::to_string(result.verdict));
  if (std::isfinite(result.fit.misfit)) text += ", misfit " + number_text(double{result.fit.misfit});
  if (std::isfinite(result.fit.error_90))
    text += ", estimate within " + number_text(double{result.fit.error_90}) + " " + unit + " (90 %)";
  return text + ", " + number_text(100 * double{result.coverage}) + " % of the surface seen";
}

std::string moment(const TestReport& report, const StudiedFrame& frame, const View& view, const DistanceScale& scale) {
  const std::string unit = report.length_unit(), at = time_text(frame.time_s);
  const auto& elements = report.frames.elements;
  // A distance for each point within reach; the others are of the background.
  std::vector<Point> points;
  std::vector<io::Color> colors;
  for (std::size_t i = 0; i < frame.points.size(); ++i)
    if (const float distance = frame.to_estimate.point_distances()[i]; std::isfinite(distance)) {
      points.push_back(frame.points[i]);
      colors.push_back(scale.of(distance));
    }
  const Sample sample = frame.result.matches.empty() ? Sample{} : frame.result.matches.front().sample;
  const std::string name = simulation_name(report.names, sample.simulation);
  const bool has_estimate = !frame.result.fit.estimate.empty();
  std::string html = "<div class=\"moment\"><h3>" + at + " (frame " + std::to_string(frame.result.frame_id) +
                     ")</h3><p class=\"note\">" + escaped(fit_text(frame.result, unit)) +
                     "</p>\n<div class=\"trio\">\n";
  html += picture(
      picture_of_cloud(view, points, colors), "Measured cloud at " + at,
      "<strong>Measured</strong>, colored by distance from the " + std::string(has_estimate ? "estimate" : "match"));
  html += picture(picture_of_mesh(view, frame.match, elements, scale.of(frame.to_match.element_distances())),
                  "Matched simulation " + name + " at " + at,
                  "<strong>Match</strong>: " + escaped(name) + ", step " + std::to_string(sample.time_step) + " at " +
                      time_text(frame.match_time_s) + "; " + distance_caption(frame.to_match, unit));
  if (has_estimate)
    html += picture(picture_of_mesh(view, frame.estimate, elements, scale.of(frame.to_estimate.element_distances())),
                    "Estimate at " + at,
                    "<strong>Estimate</strong> between simulations, at " + time_text(frame.estimate_time_s) + "; " +
                        distance_caption(frame.to_estimate, unit));
  return html + "</div></div>\n";
}

double largest_shown(const FrameStudy& study) {
  double largest = 0;
  for (const StudiedFrame& frame : study.frames)
    for (const CloudComparison* comparison : {&frame.to_match, &frame.to_estimate})
      if (const double distance = comparison->quantile(shown_share); frame.is_shown && std::isfinite(distance))
        largest = std::max(largest, distance);
  return largest;
}

std::string note_of(const TestReport& report) {
  std::string note = report.T_reference_view == identity_transform
                         ? "Drawn from obliquely above, because the sensor's pose is unknown"
                         : "Drawn as the sensor looks";
  note += "; clouds are thinned and not corrected by the estimated pose error.";
  if (!report.frames.missing.empty()) note += " " + report.frames.missing;
  return "<p class=\"note\">" + escaped(note) + "</p>\n";
}

std::string marks(const RegionMap& map, const View& view) {
  std::string svg;
  for (std::size_t i = 0; i < map.worst.size(); ++i) {
    const View::Place at = view.place_of(map.worst[i].center);
    svg += formatted("<circle cx=\"%.1f\" cy=\"%.1f\" r=\"15\" fill=\"#fff\" stroke=\"#1d2126\" stroke-width=\"2\"/>",
                     at.column, at.line);
    svg += formatted(
        "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\" style=\"font-size:19px;font-weight:bold\">%zu</text>",
        at.column, at.line + 7, i + 1);
  }
  return svg;
}

std::string region_rows(const TestReport& report) {
  std::string rows;
  for (std::size_t i = 0; i < report.regions.worst.size(); ++i) {
    const Region& region = report.regions.worst[i];
    rows += "<tr>" + number_cell(std::to_string(i + 1)) + number_cell(std::to_string(region.part)) +
            number_cell(number_text(double{region.center.x}, 4) + ", " + number_text(double{region.center.y}, 4) +
                        ", " + number_text(double{region.center.z}, 4)) +
            number_cell(number_text(region.mean)) + number_cell(number_text(region.highest)) +
            number_cell(time_text(region.highest_time_s)) + "</tr>\n";
  }
  return rows;
}

}  // namespace

std::string pictures_section(const TestReport& report) {
  if (report.record() == nullptr) return "";
  std::string html = "<section class=\"page\" aria-label=\"Frames\"><h2>The test in pictures</h2>\n" + note_of(report);
  if (report.frames.frames.empty()) return html + "</section>\n";
  View view(report.T_reference_view, picture_width);
  for (const StudiedFrame& frame : report.frames.frames) {
    view.include(frame.match);
    view.include(frame.estimate);
  }
  const DistanceScale scale(largest_shown(report.frames));
  html += color_bar(scale, report.length_unit(),
                    "Distance between measured points and shape; on meshes the mean per element.");
  for (const StudiedFrame& frame : report.frames.frames)
    if (frame.is_shown) html += moment(report, frame, view, scale);
  return html + "</section>\n";
}

std::string regions_section(const TestReport& report) {
  const RegionMap& map = report.regions;
  if (map.worst.empty()) return "";
  View view(report.T_reference_view, map_width);
  view.include(map.initial);
  const DistanceScale scale(map.worst.front().mean);
  const io::Picture picture =
      picture_of_mesh(view, map.initial, report.frames.elements, scale.of(map.element_distances));
  const std::string unit = escaped(report.length_unit());
  std::string html =
      "<section class=\"page\" aria-label=\"Regions\"><h2>Where the estimate explains the test worst</h2>\n<p>Mean "
      "distance between the "
      "measured points and the estimate over " +
      std::to_string(report.frames.frames.size()) +
      " frames, on the undeformed component. It contains noise and pose error of the measurement.</p>\n";
  html += "<div class=\"map\">" +
          formatted(
              "<svg viewBox=\"0 0 %u %u\" role=\"img\" aria-label=\"Map of the regions\"><image width=\"%u\" "
              "height=\"%u\" href=\"",
              picture.width, picture.height, picture.width, picture.height) +
          data_url(picture) + "\"/>" + marks(map, view) + "</svg></div>\n";
  html += color_bar(scale, report.length_unit(), "Mean distance.");
  html +=
      "<div class=\"scroll\"><table><thead><tr><th scope=\"col\" class=\"number\">Region</th><th scope=\"col\" "
      "class=\"number\">Part</th><th scope=\"col\" class=\"number\">Center x, y, z [" +
      unit + "]</th><th scope=\"col\" class=\"number\">Mean [" + unit +
      "]</th><th scope=\"col\" class=\"number\">Highest [" + unit +
      "]</th><th scope=\"col\" class=\"number\">at</th></tr></thead>\n<tbody>" + region_rows(report) +
      "</tbody></table></div>\n";
  return html + "</section>\n";
}

}  // namespace lbea::tool
