// The quantities of interest: their last values, their peaks, their ratings and their curves.
#include "tools/report/page/frame_curves.hpp"
#include "tools/report/page/html.hpp"
#include "tools/report/page/page.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

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

std::string score_text(double score) { return formatted("%.2f", score); }

std::string rating_row(const TestChannel& channel, const StudiedChannel& studied) {
  const std::string name = "<tr><td>" + escaped(channel.name) + "</td>";
  if (!studied.rating) return name + "<td colspan=\"6\">Not rated: " + escaped(studied.why_not) + ".</td></tr>\n";
  const ObjectiveRating& rating = *studied.rating;
  std::string cells =
      number_cell(score_text(rating.overall)) + "<td>" + std::string(grade_of(rating.overall)) + "</td>";
  for (const double score : {rating.corridor, rating.phase, rating.magnitude, rating.slope})
    cells += number_cell(score_text(score));
  return name + cells + "</tr>\n";
}

/// Empty without a simulation or without any value.
std::string ratings_of(const TestReport& report) {
  const std::span<const TestChannel> channels = report.record()->channels().channels();
  const ChannelStudy& study = report.channels;
  std::string rows;
  for (std::size_t c = 0; c < std::min(channels.size(), study.channels.size()); ++c)
    if (channels[c].last) rows += rating_row(channels[c], study.channels[c]);
  if (rows.empty() || !study.simulation) return "";
  return "<p>Rating by ISO/TS 18571, from 0 to 1: how far simulation " +
         escaped(simulation_name(report.names, *study.simulation)) +
         " alone gives the values of the test, which may combine several simulations. Where it is poor, do not read "
         "the quantity from that simulation.</p>\n<div class=\"scroll\" tabindex=\"0\"><table><thead><tr><th "
         "scope=\"col\">Quantity</th>" +
         number_head("Rating") + "<th scope=\"col\">Grade</th>" + number_head("Corridor") + number_head("Phase") +
         number_head("Magnitude") + number_head("Slope") + "</tr></thead>\n<tbody>" + rows + "</tbody></table></div>\n";
}

/// At the frames' times; unknown before its first and after its last sample.
Curve simulation_curve(const TestReport& report, Rows rows, std::size_t place) {
  const ChannelStudy& study = report.channels;
  if (place >= study.channels.size() || study.channels[place].simulation.empty() || !study.impact_s) return {};
  const Signal& signal = study.channels[place].simulation;
  return {simulation_name(report.names, *study.simulation) + " alone", values_of(rows, [&](const FrameRow& row) {
            const double time_s = study.since_impact(row.time_s);
            if (!row.is_matched() || time_s < signal.begin_s() || time_s > signal.end_s())
              return double{FrameRow::unknown};
            return resampled(signal, {time_s, 0, 1}).front();
          })};
}

/// A curve and its band, if any frame has a value. value_of: gives a ChannelValue of a ChannelOfFrame.
template <class ValueOf>
void add_interval(Chart& chart, Rows rows, std::size_t place, const char* name, const char* band,
                  const ValueOf& value_of) {
  const auto part = [&](float ChannelValue::*member) {
    return values_of(rows, [&](const FrameRow& row) {
      return place < row.channels.size() ? value_of(row.channels[place]).*member : FrameRow::unknown;
    });
  };
  const auto has_any = [](const std::vector<double>& values) {
    return std::ranges::any_of(values, [](double value) { return std::isfinite(value); });
  };
  Curve curve{name, part(&ChannelValue::value)};
  std::vector<double> bounds = part(&ChannelValue::bound_90);
  if (!has_any(curve.values)) return;
  if (has_any(bounds)) chart.bands.push_back({band, chart.curves.size(), std::move(bounds)});
  chart.curves.push_back(std::move(curve));
}

Chart chart_of(const TestReport& report, const TestChannel& channel, std::size_t place) {
  const Rows rows = report.record()->rows();
  Chart chart = chart_over_time(rows, channel.name, channel.unit, "");
  add_interval(chart, rows, place, "value", "90 % interval",
               [](const ChannelOfFrame& of_frame) -> const ChannelValue& { return of_frame; });
  add_interval(chart, rows, place, "forecast of the end", "90 % interval of the end",
               std::mem_fn(&ChannelOfFrame::end));
  if (Curve alone = simulation_curve(report, rows, place); !alone.values.empty())
    chart.curves.push_back(std::move(alone));
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

std::string channel_charts(const TestReport& report) {
  const std::span<const TestChannel> channels = report.record()->channels().channels();
  std::string figures, note;
  for (std::size_t c = 0; c < std::min(most_curves, channels.size()); ++c)
    if (const Chart chart = chart_of(report, channels[c], c); channels[c].last && chart.has_values())
      figures += figure_of(chart);
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
         bounds_note(record.channels()) + doubtful_note(record) + table_of(record.channels()) + ratings_of(report) +
         channel_charts(report) + "</section>\n";
}

}  // namespace lbea::tool
