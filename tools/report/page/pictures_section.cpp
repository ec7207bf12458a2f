// Frames beside the shapes that were found for them, and where the component is explained worst.
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"
#include "tools/report/page/picture.hpp"
#include "tools/shared/matching/shapes.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::uint32_t picture_width = 480, map_width = 900;
constexpr double shown_share = 0.95;  // of the distances; larger ones have the color of the limit

std::string distance_caption(const CloudComparison& comparison, const std::string& unit) {
  return "points from it: mean " + number_text(comparison.mean()) + " " + escaped(unit) + ", 95 % below " +
         number_text(comparison.quantile(0.95)) + " " + escaped(unit);
}

std::string fit_text(const wire::WireResult& result, const std::string& unit) {
  std::string text = std::string(wire::to_string(result.verdict));
  if (std::isfinite(result.fit.misfit)) text += ", misfit " + number_text(double{result.fit.misfit});
  if (std::isfinite(result.fit.error_90))
    text += ", estimate within " + number_text(double{result.fit.error_90}) + " " + unit + " (90 %)";
  return text + ", " + number_text(100 * double{result.coverage}) + " % of the surface seen";
}

double largest_shown(const FrameStudy& study) {
  double largest = 0;
  for (const StudiedFrame& frame : study.frames)
    for (const CloudComparison* comparison : {&frame.to_match, &frame.to_estimate})
      if (const double distance = comparison->quantile(shown_share); frame.is_shown && std::isfinite(distance))
        largest = std::max(largest, distance);
  return largest;
}

/// Pictures of frames, in the same view and colors.
class FramePictures {
 public:
  explicit FramePictures(const TestReport& report)
      : report_(report), view_(report.T_reference_view, picture_width), scale_(largest_shown(report.frames)) {
    for (const StudiedFrame& frame : report.frames.frames) {
      view_.include(frame.match);
      view_.include(frame.estimate);
    }
  }
  [[nodiscard]] std::string bar() const {
    return color_bar(
        scale_, report_.length_unit(),
        "Distance between measured points and shape; on meshes the mean per element. Gray: no point was measured "
        "there.");
  }
  [[nodiscard]] std::string measured(const StudiedFrame& frame) const;
  [[nodiscard]] std::string match(const StudiedFrame& frame) const;
  /// Empty without an estimate.
  [[nodiscard]] std::string estimate(const StudiedFrame& frame) const;
  [[nodiscard]] std::string moment(const StudiedFrame& frame) const {
    return "<div class=\"moment\"><h3>" + time_text(frame.time_s) + " (frame " + std::to_string(frame.result.frame_id) +
           ")</h3><p class=\"note\">" + escaped(fit_text(frame.result, report_.length_unit())) +
           "</p>\n<div class=\"trio\">\n" + measured(frame) + match(frame) + estimate(frame) + "</div></div>\n";
  }

 private:
  const TestReport& report_;
  View view_;
  DistanceScale scale_;
};

std::string FramePictures::measured(const StudiedFrame& frame) const {
  // Points beyond the reach are of the background.
  std::vector<Point> points;
  std::vector<io::Color> colors;
  for (std::size_t i = 0; i < frame.points.size(); ++i)
    if (const float distance = frame.to_estimate.point_distances()[i]; std::isfinite(distance)) {
      points.push_back(frame.points[i]);
      colors.push_back(scale_.of(distance));
    }
  return picture_figure(picture_of_cloud(view_, points, colors), "Measured cloud at " + time_text(frame.time_s),
                        "<strong>Measured</strong>, colored by distance from the " +
                            std::string(frame.result.fit.estimate.empty() ? "match" : "estimate"));
}

std::string FramePictures::match(const StudiedFrame& frame) const {
  const Sample sample = frame.result.matches.empty() ? Sample{} : frame.result.matches.front().sample;
  const std::string name = simulation_name(report_.names, sample.simulation);
  return picture_figure(picture_of_mesh(view_, frame.match, without_eroded(report_.frames.elements, frame.match_eroded),
                                        scale_.of(frame.to_match.element_distances())),
                        "Matched simulation " + name + " at " + time_text(frame.time_s),
                        "<strong>Match</strong>: " + escaped(name) + ", step " + std::to_string(sample.time_step) +
                            " at " + time_text(frame.match_time_s) + "; " +
                            distance_caption(frame.to_match, report_.length_unit()));
}

std::string FramePictures::estimate(const StudiedFrame& frame) const {
  if (frame.result.fit.estimate.empty()) return "";
  return picture_figure(
      picture_of_mesh(view_, frame.estimate, without_eroded(report_.frames.elements, frame.estimate_eroded),
                      scale_.of(frame.to_estimate.element_distances())),
      "Estimate at " + time_text(frame.time_s),
      "<strong>Estimate</strong>, a blend of simulations at " + time_text(frame.estimate_time_s) + " of their time; " +
          distance_caption(frame.to_estimate, report_.length_unit()));
}

double largest_distance(std::span<const float> a, std::span<const float> b) {
  float largest = 0;
  for (std::size_t i = 0; i + 2 < std::min(a.size(), b.size()); i += 3)
    largest = std::max(largest, std::hypot(a[i] - b[i], a[i + 1] - b[i + 1], a[i + 2] - b[i + 2]));
  return double{largest};
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

std::string end_section(const TestReport& report) {
  if (report.frames.frames.empty()) return "";
  const FramePictures pictures(report);
  const StudiedFrame& last = report.frames.frames.back();
  std::string html = "<section aria-label=\"End\"><h2>How it ended</h2>\n<p>The last frame, at " +
                     time_text(last.time_s) + ". Since the undeformed state, the component moved by up to " +
                     number_text(largest_distance(last.estimate, report.regions.initial)) + " " +
                     escaped(report.length_unit()) + ".</p>\n" + pictures.bar() + "<div class=\"quad\">\n" +
                     pictures.measured(last);
  const std::string estimate = pictures.estimate(last);
  return html + (estimate.empty() ? pictures.match(last) : estimate) + "</div></section>\n";
}

std::string pictures_section(const TestReport& report) {
  if (report.record() == nullptr) return "";
  std::string html = "<section class=\"page\" aria-label=\"Frames\"><h2>The test in pictures</h2>\n" + note_of(report);
  if (report.frames.frames.empty()) return html + "</section>\n";
  const FramePictures pictures(report);
  html += pictures.bar();
  for (const StudiedFrame& frame : report.frames.frames)
    if (frame.is_shown) html += pictures.moment(frame);
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
  html += color_bar(scale, report.length_unit(), "Mean distance. Gray: no point was measured there.");
  html +=
      "<div class=\"scroll\" tabindex=\"0\"><table><thead><tr><th scope=\"col\" class=\"number\">Region</th><th "
      "scope=\"col\" "
      "class=\"number\">Part</th><th scope=\"col\" class=\"number\">Center x, y, z [" +
      unit + "]</th><th scope=\"col\" class=\"number\">Mean [" + unit +
      "]</th><th scope=\"col\" class=\"number\">Highest [" + unit +
      "]</th><th scope=\"col\" class=\"number\">at</th></tr></thead>\n<tbody>" + region_rows(report) +
      "</tbody></table></div>\n";
  return html + "</section>\n";
}

}  // namespace lbea::tool
