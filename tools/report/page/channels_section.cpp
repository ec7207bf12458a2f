// The quantities of interest: their last values, their peaks and their curves.
#include "tools/report/page/frame_curves.hpp"
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::size_t most_curves = 48;

std::string moment_text(const std::optional<ChannelMoment>& moment, const std::string& unit) {
  if (!moment) return number_text(double{FrameRow::unknown});
  const std::string text = interval_text(double{moment->value}, double{moment->bound_90});
  return unit.empty() ? text : text + " " + escaped(unit);
}

std::string doubtful_note(const ChannelRecord& record) {
  if (record.left_out() == 0) return "";
  std::string reasons;
  for (const auto& [verdict, count] : record.doubtful())
    reasons += (reasons.empty() ? ": " : ", ") + std::to_string(count) + " " + std::string(wire::to_string(verdict));
  return "<p>" + std::to_string(record.left_out()) + " of " + std::to_string(record.frames()) +
         " frames are left out, because their values are doubtful" + escaped(reasons) + ".</p>\n";
}

std::string bounds_note(std::span<const TestChannel> channels) {
  const bool has_values = std::ranges::any_of(channels, [](const TestChannel& c) { return c.last.has_value(); });
  if (!has_values) return "<p>No frame has values to show.</p>\n";
  if (std::ranges::none_of(channels, &TestChannel::has_bounds))
    return "<p>The values have no bounds: only method fit gives them, for the rig's pose in the model. A peak is the "
           "value of the largest magnitude.</p>\n";
  return "<p>\u00b1: 90 % of the true values differ by less; without it, no bound is known. A peak is the value of the "
         "largest magnitude, with the bound of its frame.</p>\n";
}

std::string table_of(std::span<const TestChannel> channels) {
  std::string rows;
  for (const TestChannel& channel : channels) {
    if (!channel.last) continue;
    rows += "<tr><td>" + escaped(channel.name) + "</td>" + number_cell(moment_text(channel.last, channel.unit)) +
            number_cell(time_text(channel.last->time_s)) + number_cell(moment_text(channel.peak, channel.unit)) +
            number_cell(time_text(channel.peak->time_s)) + "</tr>\n";
  }
  if (rows.empty()) return "";
  return "<div class=\"scroll\" tabindex=\"0\"><table><thead><tr><th scope=\"col\">Quantity</th>" +
         number_head("Last value") + number_head("at") + number_head("Peak") + number_head("at") +
         "</tr></thead>\n<tbody>" + rows + "</tbody></table></div>\n";
}

Chart chart_of(Rows rows, const TestChannel& channel, std::size_t place) {
  const auto part = [&](float ChannelValue::*member) {
    return values_of(rows, [=](const FrameRow& row) {
      return place < row.channels.size() ? row.channels[place].*member : FrameRow::unknown;
    });
  };
  Chart chart = chart_over_time(rows, channel.name, channel.unit, "");
  chart.curves = {{"value", part(&ChannelValue::value)}};
  if (channel.has_bounds) chart.bands = {{"90 % interval", 0, part(&ChannelValue::bound_90)}};
  const auto lacks_bound = [place](const FrameRow& row) {
    return place < row.channels.size() && !std::isnan(row.channels[place].value) &&
           std::isnan(row.channels[place].bound_90);
  };
  if (!channel.has_bounds)
    chart.explanation = "No bound is known.";
  else if (std::ranges::any_of(rows, lacks_bound))
    chart.explanation = "Where the band is missing, no bound is known.";
  chart.from_zero = false;
  return chart;
}

std::string charts_of(const TestRecord& record) {
  const std::span<const TestChannel> channels = record.channels().channels();
  std::string figures, note;
  for (std::size_t c = 0; c < std::min(most_curves, channels.size()); ++c)
    if (const Chart chart = chart_of(record.rows(), channels[c], c); chart.has_values()) figures += figure_of(chart);
  if (channels.size() > most_curves)
    note =
        "<p>The curves of " + std::to_string(channels.size() - most_curves) + " more quantities are not drawn.</p>\n";
  return figures.empty() ? note : note + "<div class=\"charts\">\n" + figures + "</div>";
}

}  // namespace

std::string channels_section(const TestReport& report) {
  if (report.record() == nullptr || report.record()->channels().channels().empty()) return "";
  const ChannelRecord& record = report.record()->channels();
  return "<section class=\"page\" aria-label=\"Quantities\"><h2>Quantities of interest</h2>\n" +
         bounds_note(record.channels()) + doubtful_note(record) + table_of(record.channels()) +
         charts_of(*report.record()) + "</section>\n";
}

}  // namespace lbea::tool
