#include "tools/report/content/channels/channel_export.hpp"

#include "runtime/src/channels/learned_channels.hpp"
#include "tools/shared/text/csv_table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <ctime>

namespace lbea::tool {
namespace {

const TestRecord& require_channels(const TestReport& report) {
  if (report.record() == nullptr)
    throw Error(Status::bad_input, report.content.file.string() + ": no frame was matched, so there are no quantities");
  if (report.record()->channels().channels().empty())
    throw Error(Status::bad_input,
                report.content.file.string() +
                    ": has no quantities of interest; bake the model with [[channel]] and match again");
  return *report.record();
}

/// Of the matched frames, since the impact.
std::vector<double> times_of_frames(const TestReport& report) {
  std::vector<double> times_s;
  for (const FrameRow& row : report.record()->rows()) {
    if (!row.is_matched()) continue;
    const double time_s = report.channels.since_impact(row.time_s);
    if (!times_s.empty() && time_s <= times_s.back())
      throw Error(Status::bad_input, report.content.file.string() +
                                         ": the capture times do not increase, so there are no signals over time");
    times_s.push_back(time_s);
  }
  return times_s;
}

/// The channel of the matched frames; NaN: none.
std::vector<double> values_of_frames(const TestReport& report, std::size_t place) {
  std::vector<double> values;
  for (const FrameRow& row : report.record()->rows())
    if (row.is_matched())
      values.push_back(double{place < row.channels.size() ? row.channels[place].value : FrameRow::unknown});
  return values;
}

const ChannelInfo* find(std::span<const ChannelInfo> known, const TestChannel& channel) {
  const auto found = std::ranges::find(known, std::string_view(channel.name), &ChannelInfo::name);
  return found == known.end() ? nullptr : &*found;
}

std::vector<ChannelInfo> channels_of(const Model& model) {
  std::vector<ChannelInfo> channels;
  for (std::uint32_t c = 0; c < model.channels(); ++c) channels.push_back(model.channel(c));
  return channels;
}

// Of ChannelKind, those of nodes.
constexpr std::array<const char*, 5> dimensions{"DS", "VE", "AC", "DC", "DS"};
constexpr std::array<const char*, 5> si_units{"m", "m/s", "m/(s*s)", "m", "m"};
static_assert(!is_of_nodes(static_cast<ChannelKind>(si_units.size())) && dimensions.size() == si_units.size());
constexpr std::array<char, 4> directions{'X', 'Y', 'Z', 'R'};  // of ChannelComponent

/// Whether the unit is one of lengths. `info`: null for a channel that the model does not have.
bool has_si_unit(const ChannelInfo* info) { return info != nullptr && is_of_nodes(info->kind); }

/// Without its values. Without an SI unit, its own remains.
io::MmeChannel described(const TestChannel& channel, const ChannelInfo* info, std::size_t number) {
  io::MmeChannel mme;
  mme.name = channel.name;
  mme.unit = channel.unit;
  mme.code = {static_cast<std::uint32_t>(number), "00", '0', '0'};
  if (!has_si_unit(info)) return mme;
  const auto kind = static_cast<std::size_t>(info->kind);
  mme.unit = si_units[kind];
  mme.cfc = info->cfc;
  mme.code = {mme.code.number, dimensions[kind], directions[static_cast<std::size_t>(info->component)],
              io::mme_filter(info->cfc)};
  return mme;
}

void set_samples(io::MmeChannel& channel, EvenSamples samples, double factor) {
  channel.first_s = samples.first_s;
  channel.interval_s = samples.interval_s;
  channel.values = std::move(samples.values);
  for (double& value : channel.values) value *= factor;
}

/// UTC, of the recording's start; empty: unknown.
std::string date_of(std::int64_t ns_since_1970) {
  constexpr std::int64_t ns_per_second = 1'000'000'000;
  const auto seconds = static_cast<std::time_t>(ns_since_1970 / ns_per_second);
  std::array<char, 16> text{};
  std::tm utc{};
  if (ns_since_1970 <= 0 || ::gmtime_r(&seconds, &utc) == nullptr) return "";
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &utc);
  return text.data();
}

void add_facts(const TestReport& report, io::MmeTest& test) {
  const auto add = [&](const char* name, const std::string& value) { test.facts.emplace_back(name, value); };
  add("Type of the test", "impact, observed by 3D cameras");
  add("Date of the test", date_of(report.settings().start_ns));
  add("Comments", "lbea-report " LBEA_VERSION_STRING ", recording " + report.content.file.filename().string() +
                      ", test " + std::to_string(*report.test + 1));
  add("Comments", "verdict: " + report.explanation.word);
  if (report.channels.simulation)
    add("Comments", "source simulation: " + simulation_name(report.names, *report.channels.simulation));
  add("Comments", report.channels.impact_s ? "time 0: the impact, estimated from the frames or given"
                                           : "time 0: the first frame; the impact is not known");
}

std::string shortest(double value) {
  if (!std::isfinite(value)) return "";
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}
std::string shortest(float value) {
  if (!std::isfinite(value)) return "";
  std::array<char, 32> digits{};
  return {digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr};
}

std::string simulation_value(const ChannelStudy& study, std::size_t place, double time_s) {
  const Signal& signal = study.channels[place].simulation;
  if (!study.impact_s || signal.empty() || time_s < signal.begin_s() || time_s > signal.end_s()) return "";
  return shortest(static_cast<float>(resampled(signal, {time_s, 0, 1}).front()));
}

std::string csv_header(const TestReport& report) {
  const ChannelStudy& study = report.channels;
  std::string header = study.impact_s ? "frame,time since impact [s]" : "frame,time since first frame [s]";
  for (const TestChannel& channel : report.record()->channels().channels()) {
    const std::string unit = " [" + channel.unit + "]";
    header += "," + csv_field(channel.name + unit) + "," + csv_field(channel.name + " bound_90" + unit);
    if (study.simulation)
      header += "," + csv_field(channel.name + " " + simulation_name(report.names, *study.simulation) + unit);
  }
  return header;
}

}  // namespace

io::MmeTest mme_of(const TestReport& report) {
  const std::span<const TestChannel> channels = require_channels(report).channels().channels();
  const std::vector<ChannelInfo> known = channels_of(report.model);
  const std::vector<double> times_s = times_of_frames(report);
  const double meters = 1e-3 / units_per_mm(report.model.length_unit());
  io::MmeTest test;
  add_facts(report, test);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const ChannelInfo* info = find(known, channels[c]);
    const double factor = has_si_unit(info) ? meters : 1;
    io::MmeChannel& of_test = test.channels.emplace_back(described(channels[c], info, c + 1));
    of_test.source = "camera";
    of_test.code.filter = 'V';  // from film analysis
    set_samples(of_test, evenly_sampled(times_s, values_of_frames(report, c)), factor);
    const Signal& alone = report.channels.channels[c].simulation;
    if (alone.empty() || !report.channels.impact_s) continue;  // their times have nothing in common
    io::MmeChannel& of_simulation = test.channels.emplace_back(described(channels[c], info, c + 1));
    of_simulation.source = "simulation";
    of_simulation.name += ", simulation " + simulation_name(report.names, *report.channels.simulation);
    set_samples(of_simulation, evenly_sampled(alone.times_s, alone.values), factor);
  }
  return test;
}

std::string csv_of(const TestReport& report) {
  const std::span<const TestChannel> channels = require_channels(report).channels().channels();
  CsvTable table(csv_header(report));
  table.end_row();
  for (const FrameRow& row : report.record()->rows()) {
    if (!row.is_matched()) continue;
    const double time_s = report.channels.since_impact(row.time_s);
    table.add(row.id, shortest(time_s));
    for (std::size_t c = 0; c < channels.size(); ++c) {
      const ChannelValue value = c < row.channels.size() ? ChannelValue(row.channels[c]) : ChannelValue{};
      table.add(shortest(value.value), shortest(value.bound_90));
      if (report.channels.simulation) table.add(simulation_value(report.channels, c, time_s));
    }
    table.end_row();
  }
  return table.text();
}

}  // namespace lbea::tool
