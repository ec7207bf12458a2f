#include "tools/monitor/feeds/test_log.hpp"

#include "runtime/src/channels/learned_channels.hpp"
#include "tools/monitor/scene/packet.hpp"
#include "tools/shared/answer/doubtful.hpp"
#include "tools/shared/text/channel_column.hpp"
#include "tools/shared/text/csv_table.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr float unknown = std::numeric_limits<float>::quiet_NaN();

TestLog::Row row_of(const wire::WireResult& result, double time_s) {
  TestLog::Row row;
  row.fill(unknown);
  row[TestLog::time_s] = static_cast<float>(time_s);
  row[TestLog::frame] = static_cast<float>(result.frame_id);
  row[TestLog::verdict] = static_cast<float>(result.verdict);
  row[TestLog::status] = static_cast<float>(result.status);
  row[TestLog::latency_ms] = static_cast<float>(result.elapsed_ns.total) * 1e-6f;
  if (wire::fate_of(result.status) != wire::Fate::matched) return row;
  for (std::size_t i = 0; i < frame_numbers.size(); ++i)
    row[TestLog::first_frame_number + i] = result.*frame_numbers[i].value;
  if (result.forecast.frames > 0) row[TestLog::final_error_90] = result.forecast.error_90;
  for (std::size_t k = 0; k < 3; ++k) row[TestLog::x + k] = result.leading_coordinates[k];
  if (!result.matches.empty()) {
    const wire::WireMatch& best = result.matches.front();
    row[TestLog::simulation] = static_cast<float>(best.sample.simulation);
    row[TestLog::time_step] = static_cast<float>(best.sample.time_step);
    row[TestLog::distance] = best.distance;
  }
  for (std::size_t i = 0; i < fit_numbers.size() && !result.fit.candidates.empty(); ++i)
    row[TestLog::first_fit_number + i] = result.fit.*fit_numbers[i].value;
  for (std::size_t k = 0; k < std::min(TestLog::chances, result.test.simulations.size()); ++k) {
    row[TestLog::column_count + 2 * k] = static_cast<float>(result.test.simulations[k].simulation);
    row[TestLog::column_count + 2 * k + 1] = result.test.simulations[k].probability;
  }
  return row;
}

std::string number(float value) { return std::isnan(value) ? "" : fmt::format("{}", value); }

std::string name_of(float simulation, std::span<const std::string> names) {
  if (std::isnan(simulation)) return "";
  const auto index = static_cast<std::size_t>(simulation);
  std::string name = index < names.size() ? names[index] : fmt::format("{}", index);
  std::string quoted = "\"";
  for (const char c : name) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

/// The names of the columns after the chances.
std::string channel_heads(std::span<const TestLog::Channel> channels) {
  std::string heads;
  for (const TestLog::Channel& channel : channels)
    for (const char* kind : {"", "bound_90"})
      heads += "," + csv_field(channel_column(channel.name, kind, channel.unit));
  return heads;
}

std::string channel_cells(const TestLog& log, std::size_t row) {
  std::string cells;
  for (const ChannelValue& channel : log.channel_values().subspan(row * log.channels().size(), log.channels().size()))
    cells += "," + number(channel.value) + "," + number(channel.bound_90);
  return cells;
}

nlohmann::json to_json(std::span<const TestLog::Channel> channels) {
  nlohmann::json list = nlohmann::json::array();
  for (const TestLog::Channel& channel : channels) list.push_back({{"name", channel.name}, {"unit", channel.unit}});
  return list;
}

}  // namespace

void TestLog::add(const wire::WireResult& result) {
  const wire::Fate fate = wire::fate_of(result.status);
  if (fate == wire::Fate::matched && (!started_ || complete_ || result.session != session_)) begin(result);
  if (result.status == wire::WireStatus::end_of_stream && started_ && result.session == session_) complete_ = true;
  answer_.add(result);
  if (!started_ || fate == wire::Fate::not_a_capture) return;
  name_channels(result);
  if (results_++ % every_ != 0) return;
  if (rows_.size() >= most_rows()) thin();
  // A refused frame may have no time; it gets the time of the row before it.
  const bool has_time = fate == wire::Fate::matched || (result.session == session_ && result.stamp_ns != 0);
  ids_.push_back(result.frame_id);
  rows_.push_back(row_of(result, has_time        ? seconds(result.stamp_ns)
                                 : rows_.empty() ? 0
                                                 : static_cast<double>(rows_.back()[time_s])));
  add_channel_values(result);
}

void TestLog::begin(const wire::WireResult& first) {
  started_ = true;
  session_ = first.session;
  first_stamp_ns_ = first.stamp_ns;
  complete_ = false;
  results_ = 0;
  every_ = 1;
  rows_.clear();
  ids_.clear();
  channels_.clear();
  channel_values_.clear();
  ++epoch_;
}

void TestLog::name_channels(const wire::WireResult& result) {
  if (!channels_.empty() || result.channels.empty()) return;
  for (const wire::WireChannel& channel : result.channels)
    if (channels_.size() < most_channels) channels_.push_back({channel.name, channel.unit});
  channel_values_.assign(rows_.size() * channels_.size(), {});
  if (!rows_.empty()) ++epoch_;
  while (rows_.size() > most_rows()) thin();
}

void TestLog::add_channel_values(const wire::WireResult& result) {
  const std::size_t begin = channel_values_.size();
  channel_values_.resize(begin + channels_.size());
  if (is_doubtful(result)) return;
  for (std::size_t c = 0; c < std::min(channels_.size(), result.channels.size()); ++c)
    if (result.channels[c].name == channels_[c].name) channel_values_[begin + c] = result.channels[c];
}

/// Even, so that thin() leaves evenly spaced results.
std::size_t TestLog::most_rows() const noexcept {
  if (channels_.empty()) return capacity_;
  return std::min(capacity_, most_channel_values / channels_.size() / 2 * 2);
}

void TestLog::thin() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < rows_.size(); i += 2, ++kept) {
    rows_[kept] = rows_[i], ids_[kept] = ids_[i];
    for (std::size_t c = 0; c < channels_.size(); ++c)
      channel_values_[kept * channels_.size() + c] = channel_values_[i * channels_.size() + c];
  }
  rows_.resize(kept);
  ids_.resize(kept);
  channel_values_.resize(kept * channels_.size());
  every_ *= 2;
  ++epoch_;
}

std::vector<std::string> column_names() {
  std::vector<std::string> names{"time_s", "frame", "verdict", "status", "simulation", "time_step", "distance"};
  for (const auto& number : fit_numbers) names.emplace_back(number.name);
  for (const auto& number : frame_numbers) names.emplace_back(number.name);
  for (const char* name : {"final_error_90", "x", "y", "z", "latency_ms"}) names.emplace_back(name);
  return names;
}

std::string next_rows(const TestLog& log, LogCursor& cursor, std::size_t most) {
  const bool is_new = cursor.epoch != log.epoch();
  if (is_new) cursor = {log.epoch(), 0};
  const std::size_t count = std::min(most, log.rows().size() - cursor.row);
  if (count == 0 && !is_new) return {};
  std::vector<float> values;
  values.reserve(count * TestLog::row_values);
  for (const TestLog::Row& row : log.rows().subspan(cursor.row, count))
    values.insert(values.end(), row.begin(), row.end());
  std::vector<float> channels;
  for (const ChannelValue& channel :
       log.channel_values().subspan(cursor.row * log.channels().size(), count * log.channels().size()))
    channels.insert(channels.end(), {channel.value, channel.bound_90});
  Packet packet;
  packet.add("rows", std::move(values));
  packet.add("channels", std::move(channels));
  nlohmann::json head{{"type", "rows"},       {"epoch", log.epoch()},      {"first", cursor.row},
                      {"every", log.every()}, {"columns", column_names()}, {"row_values", TestLog::row_values}};
  if (cursor.row == 0) head["channels"] = to_json(log.channels());
  cursor.row += count;
  return packet.finish(head);
}

std::string next_rows(std::span<const TestLog> logs, LogCursors& cursors, std::size_t most) {
  cursors.resize(logs.size());
  if (logs.size() == 1) return next_rows(logs.front(), cursors.front(), most);
  std::vector<std::string> rows;
  for (std::size_t i = 0; i < logs.size(); ++i) rows.push_back(next_rows(logs[i], cursors[i], most));
  if (std::ranges::all_of(rows, &std::string::empty)) return {};
  Packet packet;
  packet.add_components(rows);
  return packet.finish({{"type", "components"}});
}

nlohmann::json to_json(const TestLog& log, std::int64_t stamp_ns, std::span<const std::string> simulation_names) {
  const wire::WireTestState& state = log.answer().state();
  nlohmann::json answer;
  if (state.frames > 0)
    answer = {{"verdict", wire::to_string(state.verdict)},
              {"simulations", likely_simulations(state, simulation_names)},
              {"misfit", state.misfit}};
  return {{"epoch", log.epoch()},
          {"results", log.results()},
          {"complete", log.is_complete()},
          {"seconds", log.seconds(stamp_ns)},
          {"session", std::to_string(log.session())},
          {"answer", std::move(answer)},
          {"warning", log.answer().warning()}};
}

std::string to_csv(const TestLog& log, std::span<const std::string> simulation_names) {
  std::string csv = fmt::format("{}", fmt::join(column_names(), ","));
  for (std::size_t k = 1; k <= TestLog::chances; ++k) csv += fmt::format(",simulation_{0},probability_{0}", k);
  csv += channel_heads(log.channels()) + '\n';
  for (std::size_t i = 0; i < log.rows().size(); ++i) {
    for (std::size_t column = 0; column < TestLog::row_values; ++column) {
      const float value = log.rows()[i][column];
      if (column > 0) csv += ',';
      const bool is_name = column == TestLog::simulation ||
                           (column >= TestLog::column_count && (column - TestLog::column_count) % 2 == 0);
      if (is_name)
        csv += name_of(value, simulation_names);
      else if (column == TestLog::frame)
        csv += std::to_string(log.ids()[i]);
      else if (column == TestLog::verdict)
        csv += wire::to_string(static_cast<wire::WireVerdict>(value));
      else if (column == TestLog::status)
        csv += wire::to_string(static_cast<wire::WireStatus>(value));
      else
        csv += number(value);
    }
    csv += channel_cells(log, i) + '\n';
  }
  return csv;
}

}  // namespace lbea::tool
