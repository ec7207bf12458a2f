#include "tools/eval/live.hpp"

#include "adapters/files/atomic_file.hpp"
#include "tools/eval/channels/channel_columns.hpp"
#include "tools/shared/answer/clock_times.hpp"
#include "tools/shared/matching/named_models.hpp"
#include "tools/shared/matching/result_json.hpp"
#include "tools/shared/text/csv_table.hpp"
#include "tools/shared/text/formatted.hpp"

#include <lbea/tracker.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

std::string number_or_dash(const std::optional<double>& value) {
  return value ? formatted("%8.3f", *value) : "       -";
}

nlohmann::ordered_json test_json(const TestAnswer& answer, const Model& model) {
  const wire::WireTestState& test = answer.state();
  nlohmann::ordered_json json{{"verdict", wire::to_string(test.verdict)}};
  if (test.frames > 0) {
    json["misfit"] = test.misfit;
    json["simulations"] = nlohmann::json::array();
    for (const wire::SimulationChance& chance : test.simulations)
      json["simulations"].push_back(
          {{"simulation", model.simulation_name(chance.simulation)}, {"probability", chance.probability}});
  }
  if (answer.undeformed_coverage()) json["undeformed_coverage"] = *answer.undeformed_coverage();
  return json;
}

}  // namespace

// Frames that were rejected show their sender, unless others are matched.
void LiveSessions::add(const wire::WireResult& result) {
  const wire::Fate fate = wire::fate_of(result.status);
  if (fate == wire::Fate::matched) matched_.insert(result.session);
  if (fate == wire::Fate::matched || (fate == wire::Fate::rejected && matched_.empty())) latest_ = result.session;
}

double LiveSummary::seconds_since_first(const LiveRow& row) const noexcept {
  return 1e-9 * difference_ns(row.result.stamp_ns, rows.front().result.stamp_ns);
}

void find_path(LiveSummary& summary, const Model& model) {
  std::vector<std::vector<Match>> evidence;
  std::vector<LiveRow*> rows;
  for (LiveRow& row : summary.rows) {
    if (!summary.sessions.has_latest(row.result)) continue;
    rows.push_back(&row);
    evidence.push_back(ranked(row.result.fit.candidates, row.result.fit.ranks));
  }
  if (std::ranges::all_of(evidence, [](const auto& candidates) { return candidates.empty(); })) return;
  const auto path = likeliest_path(model, evidence);
  for (std::size_t i = 0; i < path.size(); ++i) {
    rows[i]->on_path = path[i];
    rows[i]->path_simulation = model.simulation_name(path[i].simulation);
  }
}

std::optional<Sample> LiveSummary::end_of_path() const {
  const auto last =
      std::find_if(rows.rbegin(), rows.rend(), [](const LiveRow& row) { return row.on_path.has_value(); });
  return last == rows.rend() ? std::nullopt : last->on_path;
}

std::optional<double> LiveSummary::mean(std::optional<double> LiveRow::*error) const {
  double sum = 0;
  std::size_t count = 0;
  for (const LiveRow& row : rows)
    if (row.*error) sum += *(row.*error), ++count;
  return count == 0 ? std::nullopt : std::optional(sum / static_cast<double>(count));
}

double LiveSummary::median_match_ms() const {
  if (rows.empty()) return 0;
  std::vector<double> times;
  for (const LiveRow& row : rows) times.push_back(row.match_ms);
  const auto middle = times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2);
  std::ranges::nth_element(times, middle);
  return *middle;
}

std::string table_header(const Model& model) {
  const std::string unit(model.length_unit());
  return formatted("%6s  %-20s %5s %11s %9s %9s %11s %11s %9s  %s", "frame", "best simulation", "step", "distance",
                   "error_90", "coverage", ("EE [" + unit + "]").c_str(), ("oracle [" + unit + "]").c_str(), "ms",
                   "verdict");
}

std::string table_line(const LiveRow& row) {
  const wire::WireResult& r = row.result;
  const auto id = static_cast<unsigned long long>(r.frame_id);
  if (r.matches.empty()) return formatted("%6llu  not matched: %s", id, std::string(wire::to_string(r.status)).c_str());
  const wire::WireMatch& best = r.matches.front();
  const std::string error_90 =
      std::isfinite(r.fit.error_90) ? formatted("%.2f", static_cast<double>(r.fit.error_90)) : "-";
  return formatted("%6llu  %-20s %5u %11.2f %9s %7.0f %% %11s %11s %9.2f  %s%s", id, best.simulation_name.c_str(),
                   best.sample.time_step, static_cast<double>(best.distance), error_90.c_str(),
                   100.0 * static_cast<double>(r.coverage), number_or_dash(row.error).c_str(),
                   number_or_dash(row.oracle_error).c_str(), row.match_ms,
                   std::string(wire::to_string(r.verdict)).c_str(), by_rigs(r).c_str());
}

std::string table_summary(const LiveSummary& summary, const Model& model) {
  const wire::WireTestState& test = summary.answer.state();
  const std::string refusal = refusal_of_all(summary.counters, model.length_unit());
  std::string text = (summary.complete ? "test: " : "test so far: ") +
                     (summary.rows.empty() ? "no results came"
                      : refusal.empty()    ? answer_text(test, simulation_names(model))
                                           : refusal) +
                     "\n";
  if (const std::string warning = summary.answer.warning(); !warning.empty()) text += "warning: " + warning + "\n";
  if (summary.sessions.count() > 1)
    text += formatted("%zu senders, or one that was restarted: verdict and path are those of the last one\n",
                      summary.sessions.count());
  text += formatted("%zu results%s, %.2f ms per frame in the matcher (median)", summary.rows.size(),
                    summary.complete ? "" : ", the sender did not end the stream", summary.median_match_ms());
  if (const auto error = summary.mean(&LiveRow::error), best = summary.mean(&LiveRow::oracle_error); error && best)
    text += formatted("; mean EE %.2f %s, oracle %.2f (ratio %.2f)", *error, std::string(model.length_unit()).c_str(),
                      *best, *error / *best);
  if (const auto estimate = summary.mean(&LiveRow::estimate_error)) text += formatted("; estimate %.2f", *estimate);
  if (const auto last = summary.end_of_path()) {
    text += formatted("\n%s path of the whole test: ends at %s, time step %u",
                      test.verdict == wire::WireVerdict::no_simulation_fits ? "nearest" : "most likely",
                      std::string(model.simulation_name(last->simulation)).c_str(), last->time_step);
    if (const auto path = summary.mean(&LiveRow::path_error)) text += formatted("; mean EE %.2f", *path);
  }
  return text;
}

std::string to_json(const LiveSummary& summary, const Model& model) {
  nlohmann::ordered_json rows = nlohmann::json::array();
  for (const LiveRow& row : summary.rows) {
    nlohmann::ordered_json line{{"frame", row.result.frame_id},
                                {"stamp_ns", row.result.stamp_ns},
                                {"status", wire::to_string(row.result.status)},
                                {"verdict", wire::to_string(row.result.verdict)}};
    for (const auto& number : frame_numbers) line[number.name] = row.result.*number.value;
    if (!row.result.matches.empty()) {
      const wire::WireMatch& best = row.result.matches.front();
      line["simulation"] = best.simulation_name;
      line["time_step"] = best.sample.time_step;
      line["distance"] = best.distance;
    }
    add_details(line, row.result);
    if (row.error) line["EE"] = *row.error, line["oracle_EE"] = *row.oracle_error;
    if (row.estimate_error) line["estimate_EE"] = *row.estimate_error;
    if (row.on_path) line["path"] = {{"simulation", row.path_simulation}, {"time_step", row.on_path->time_step}};
    if (row.path_error) line["path"]["EE"] = *row.path_error;
    line["match_ms"] = row.match_ms;
    line["total_ms"] = row.total_ms;
    rows.push_back(std::move(line));
  }
  nlohmann::ordered_json all{{"complete", summary.complete},
                             {"sessions", summary.sessions.count()},
                             {"test", test_json(summary.answer, model)},
                             {"median_match_ms", summary.median_match_ms()},
                             {"frames", std::move(rows)}};
  const auto put_mean = [&](const char* key, std::optional<double> LiveRow::*error) {
    if (const auto mean = summary.mean(error)) all[key] = *mean;
  };
  put_mean("mean_EE", &LiveRow::error);
  put_mean("mean_oracle_EE", &LiveRow::oracle_error);
  put_mean("mean_estimate_EE", &LiveRow::estimate_error);
  put_mean("mean_path_EE", &LiveRow::path_error);
  return all.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

void write_csv(const std::filesystem::path& file, const LiveSummary& summary) {
  CsvTable table("frame,stamp_ns,status,simulation,time_step,distance");
  for (const auto& number : frame_numbers) table.add(number.name);
  table.add("EE", "oracle_EE", "match_ms", "total_ms", "verdict", "test_verdict", "estimate_EE", "path_simulation",
            "path_time_step", "path_EE");
  for (const auto& number : fit_numbers) table.add(number.name);
  const ChannelColumns channels(summary.rows);
  for (const std::string& head : channels.heads()) table.add(head);
  table.end_row();
  for (const LiveRow& row : summary.rows) {
    const wire::WireResult& r = row.result;
    table.add(r.frame_id, r.stamp_ns, wire::to_string(r.status));
    if (r.matches.empty())
      table.add("", "", "");
    else
      table.add(r.matches.front().simulation_name, r.matches.front().sample.time_step, r.matches.front().distance);
    for (const auto& number : frame_numbers) table.add(r.*number.value);
    table.add(row.error, row.oracle_error, row.match_ms, row.total_ms, wire::to_string(r.verdict),
              wire::to_string(r.test.verdict), row.estimate_error);
    if (row.on_path)
      table.add(row.path_simulation, row.on_path->time_step);
    else
      table.add("", "");
    table.add(row.path_error);
    for (const auto& number : fit_numbers) table.add(r.fit.*number.value);
    for (const float cell : channels.cells(r)) table.add(cell);
    table.end_row();
  }
  io::write_file(file, table.text());
}

}  // namespace lbea::tool
