#include "tools/eval/live.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/eval/mesh_series.hpp"
#include "tools/shared/cli/csv_table.hpp"
#include "tools/shared/cli/formatted.hpp"

#include <lbea/inference.hpp>
#include <lbea/tracker.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr std::chrono::milliseconds poll_interval{50};

double ms(std::uint64_t ns) { return static_cast<double>(ns) * 1e-6; }

std::vector<float> estimated_positions(const Model& model, const std::vector<WeightedSample>& estimate) {
  Inferred inferred;
  infer_positions(model, estimate, {}, inferred);
  return std::move(inferred.mean);
}

LiveRow row_of(wire::WireResult result, const Model& model, Truth* truth) {
  LiveRow row;
  const StageTimes& stages = result.elapsed_ns.match;
  row.match_ms = ms(std::uint64_t{stages.index} + stages.correspondence + stages.projection + stages.matching +
                    stages.fit + stages.coverage);
  row.total_ms = ms(result.elapsed_ns.total);
  const Truth::Row* real = truth == nullptr ? nullptr : truth->at(result.stamp_ns);
  if (real != nullptr && !result.matches.empty()) {
    const std::uint32_t sample = model.sample_index(result.matches.front().sample);
    if (sample == model.samples())
      throw Error(Status::bad_input,
                  "frame " + std::to_string(result.frame_id) +
                      ": the result has a sample that this model does not have; give the model that the matcher uses");
    const auto& positions = truth->positions(*real);
    row.error = experiment_error(positions, model.node_positions(sample));
    row.oracle_error = oracle(model, positions).error;
    if (!result.fit.estimate.empty())
      row.estimate_error = experiment_error(positions, estimated_positions(model, result.fit.estimate));
  }
  row.result = std::move(result);
  return row;
}

void find_path(LiveSummary& summary, const Model& model, Truth* truth) {
  std::vector<std::vector<Match>> evidence;
  for (const LiveRow& row : summary.rows) evidence.push_back(row.result.fit.candidates);
  summary.has_path = std::ranges::any_of(evidence, [](const auto& candidates) { return !candidates.empty(); });
  if (!summary.has_path) return;
  const auto path = likeliest_path(model, evidence);
  for (std::size_t i = 0; i < path.size(); ++i) {
    LiveRow& row = summary.rows[i];
    row.on_path = path[i];
    row.path_simulation = model.simulation_name(path[i].simulation);
    const Truth::Row* real = truth == nullptr ? nullptr : truth->at(row.result.stamp_ns);
    if (real != nullptr)
      row.path_error = experiment_error(truth->positions(*real), model.node_positions(model.sample_index(path[i])));
  }
}

std::vector<std::string> names_of(const Model& model) {
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < model.simulations(); ++i) names.emplace_back(model.simulation_name(i));
  return names;
}

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

void write_cloud(const std::filesystem::path& file, const std::filesystem::path& cloud, const RigidTransform& T,
                 const std::string& columns) {
  io::PointCloud points = io::read_point_cloud(cloud, columns);
  for (Point& p : points.points)
    p = {T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3], T[4] * p.x + T[5] * p.y + T[6] * p.z + T[7],
         T[8] * p.x + T[9] * p.y + T[10] * p.z + T[11]};
  const std::vector<std::string> comments{"reference coordinates"};
  io::write_ply(file, points.points, comments);
}

}  // namespace

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

LiveSummary watch(const LiveOptions& options, const Model& model, Truth* truth, const std::function<void()>& ready,
                  const std::function<void(const LiveRow&)>& row, const std::function<bool()>& stop) {
  wire::WireContext context;
  wire::ResultSource source(context, options.results_endpoint, wire::results_held, options.access);
  LiveSummary summary;
  bool is_ready = false;
  auto last = std::chrono::steady_clock::now();
  while (!summary.complete && !stop()) {
    const auto message = source.receive(poll_interval);
    if (!message) {
      if (std::chrono::steady_clock::now() - last > options.silence) break;
      continue;
    }
    last = std::chrono::steady_clock::now();
    if (!is_ready) ready();
    is_ready = true;
    wire::WireResult result;
    if (wire::message_kind(*message) != wire::MessageKind::result) continue;
    if (const wire::WireStatus status = wire::decode_result(*message, result); status != wire::WireStatus::ok)
      throw Error(Status::bad_input,
                  options.results_endpoint + ": a result cannot be read: " + std::string(wire::explain(status)));
    if (result.model_checksum != model.checksum())
      throw Error(
          Status::bad_input,
          options.results_endpoint + ": these results are from another model; give the model that the matcher uses");
    if (result.status == wire::WireStatus::end_of_stream) {
      summary.complete = true;
      continue;
    }
    const bool was_right = summary.answer.pose_warning().empty();
    summary.answer.add(result);
    ++summary.counters.by_status[static_cast<std::size_t>(result.status)];
    summary.rows.push_back(row_of(std::move(result), model, truth));
    if (was_right) summary.rows.back().warning = summary.answer.pose_warning();
    row(summary.rows.back());
  }
  find_path(summary, model, truth);
  return summary;
}

std::string table_header(const Model& model) {
  const std::string unit(model.length_unit());
  return formatted("%6s  %-20s %5s %11s %9s %11s %11s %9s  %s", "frame", "best simulation", "step", "distance",
                   "coverage", ("EE [" + unit + "]").c_str(), ("oracle [" + unit + "]").c_str(), "ms", "verdict");
}

std::string table_line(const LiveRow& row) {
  const wire::WireResult& r = row.result;
  const auto id = static_cast<unsigned long long>(r.frame_id);
  if (r.matches.empty()) return formatted("%6llu  not matched: %s", id, std::string(wire::to_string(r.status)).c_str());
  const wire::WireMatch& best = r.matches.front();
  return formatted("%6llu  %-20s %5u %11.2f %7.0f %% %11s %11s %9.2f  %s", id, best.simulation_name.c_str(),
                   best.sample.time_step, static_cast<double>(best.distance), 100.0 * static_cast<double>(r.coverage),
                   number_or_dash(row.error).c_str(), number_or_dash(row.oracle_error).c_str(), row.match_ms,
                   std::string(wire::to_string(r.verdict)).c_str());
}

std::string table_summary(const LiveSummary& summary, const Model& model) {
  const wire::WireTestState& test = summary.answer.state();
  const std::string refusal = refusal_of_all(summary.counters, model.length_unit());
  std::string text = (summary.complete ? "test: " : "test so far: ") +
                     (refusal.empty() ? answer_text(test, names_of(model)) : refusal) + "\n";
  if (const std::string warning = summary.answer.pose_warning(); !warning.empty()) text += "warning: " + warning + "\n";
  text += formatted("%zu results%s, %.2f ms per frame in the matcher (median)", summary.rows.size(),
                    summary.complete ? "" : ", the sender did not end the stream", summary.median_match_ms());
  if (const auto error = summary.mean(&LiveRow::error), best = summary.mean(&LiveRow::oracle_error); error && best)
    text += formatted("; mean EE %.2f %s, oracle %.2f (ratio %.2f)", *error, std::string(model.length_unit()).c_str(),
                      *best, *error / *best);
  if (const auto estimate = summary.mean(&LiveRow::estimate_error)) text += formatted("; estimate %.2f", *estimate);
  if (summary.has_path) {
    const Sample last = summary.rows.back().on_path;
    text += formatted("\n%s path of the whole test: %s, ends at time step %u",
                      test.verdict == wire::WireVerdict::no_simulation_fits ? "nearest" : "most likely",
                      std::string(model.simulation_name(last.simulation)).c_str(), last.time_step);
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
    for (const auto& number : fit_numbers)
      if (!row.result.fit.candidates.empty()) line["fit"][number.name] = row.result.fit.*number.value;
    if (row.error) line["EE"] = *row.error, line["oracle_EE"] = *row.oracle_error;
    if (row.estimate_error) line["estimate_EE"] = *row.estimate_error;
    if (summary.has_path) line["path"] = {{"simulation", row.path_simulation}, {"time_step", row.on_path.time_step}};
    if (row.path_error) line["path"]["EE"] = *row.path_error;
    line["match_ms"] = row.match_ms;
    line["total_ms"] = row.total_ms;
    rows.push_back(std::move(line));
  }
  nlohmann::ordered_json all{{"complete", summary.complete},
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
    if (summary.has_path)
      table.add(row.path_simulation, row.on_path.time_step);
    else
      table.add("", "");
    table.add(row.path_error);
    for (const auto& number : fit_numbers) table.add(r.fit.*number.value);
    table.end_row();
  }
  io::write_file(file, table.text());
}

void write_meshes(const std::filesystem::path& folder, const LiveSummary& summary, const Model& model,
                  const Truth* truth, const RigidTransform& T_reference_sensor, const std::string& columns) {
  MeshSeries series(model, folder);
  for (const LiveRow& row : summary.rows) {
    if (row.result.matches.empty()) continue;
    const std::uint32_t sample = model.sample_index(row.result.matches.front().sample);
    if (sample == model.samples()) continue;
    const std::string number = formatted("%05llu", static_cast<unsigned long long>(row.result.frame_id));
    const Truth::Row* real = truth == nullptr ? nullptr : truth->at(row.result.stamp_ns);
    series.add_match(number, sample, real == nullptr ? model.sample_time_s(sample) : real->time_s);
    if (const wire::WireFit& fit = row.result.fit; !fit.estimate.empty())
      series.add_estimate(number, fit.estimate, fit.candidates,
                          real == nullptr ? estimate_time_s(model, fit.estimate) : real->time_s);
    if (real != nullptr) write_cloud(folder / ("frame_" + number + ".ply"), real->cloud, T_reference_sensor, columns);
  }
  series.finish();
}

}  // namespace lbea::tool
