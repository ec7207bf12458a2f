#include "tools/eval/live.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/eval/experiment_error.hpp"

#include <lbea/inference.hpp>
#include <lbea/tracker.hpp>

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

LiveRow judge(wire::WireResult result, const Model& model, Truth* truth) {
  LiveRow row;
  const StageTimes& stages = result.elapsed_ns.match;
  row.match_ms = ms(std::uint64_t{stages.index} + stages.correspondence + stages.projection + stages.matching +
                    stages.fit + stages.coverage);
  row.total_ms = ms(result.elapsed_ns.total);
  const Truth::Row* real = truth == nullptr ? nullptr : truth->at(result.stamp_ns);
  if (real != nullptr && !result.matches.empty()) {
    const std::uint32_t sample = model.sample_index(result.matches.front().sample);
    if (sample == model.samples())
      throw Error(Status::bad_input, "frame " + std::to_string(result.frame_id) +
                                         ": the results name a sample this model does not hold; "
                                         "give the model that the matcher uses");
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
  bool heard = false;
  auto last = std::chrono::steady_clock::now();
  while (!summary.complete && !stop()) {
    const auto message = source.receive(poll_interval);
    if (!message) {
      // Before the first message the matcher may still be starting; after it, silence means it is gone.
      if (std::chrono::steady_clock::now() - last > options.silence) break;
      continue;
    }
    last = std::chrono::steady_clock::now();
    if (!heard) ready();
    heard = true;
    wire::WireResult result;
    if (wire::message_kind(*message) != wire::MessageKind::result) continue;
    if (const wire::WireStatus status = wire::decode_result(*message, result); status != wire::WireStatus::ok)
      throw Error(Status::bad_input,
                  options.results_endpoint + ": a result cannot be read: " + std::string(wire::explain(status)));
    if (result.model_checksum != model.checksum())
      throw Error(Status::bad_input, options.results_endpoint +
                                         ": these results were matched with another model; give the one that "
                                         "the matcher uses");
    if (result.status == wire::WireStatus::end_of_stream) {
      summary.complete = true;
      continue;
    }
    summary.rows.push_back(judge(std::move(result), model, truth));
    row(summary.rows.back());
  }
  find_path(summary, model, truth);
  return summary;
}

}  // namespace lbea::tool
