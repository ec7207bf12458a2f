#include "tools/eval/live.hpp"

#include "adapters/wire/codec.hpp"
#include "adapters/wire/streams.hpp"
#include "tools/eval/experiment_error.hpp"

#include <algorithm>

namespace lbea {

namespace {

constexpr std::chrono::milliseconds poll_interval{50};

double ms(std::uint64_t ns) { return static_cast<double>(ns) * 1e-6; }

LiveRow judge(WireResult result, const Model& model, Truth* truth) {
  LiveRow row;
  const StageTimes& stages = result.elapsed_ns.match;
  row.match_ms = ms(std::uint64_t{stages.index} + stages.correspondence + stages.projection + stages.matching + stages.coverage);
  row.total_ms = ms(result.elapsed_ns.total);
  const Truth::Row* real = truth == nullptr ? nullptr : truth->at(result.stamp_ns);
  if (real != nullptr && !result.matches.empty()) {
    const std::uint32_t sample = model.sample_index(result.matches.front().sample);
    if (sample == model.samples())
      throw Error(Status::bad_input, "frame " + std::to_string(result.frame_id) + ": the results name a sample this model does not hold; "
                                     "give the model that the matcher uses");
    const auto& positions = truth->positions(*real);
    row.error = experiment_error(positions, model.node_positions(sample));
    row.oracle_error = oracle(model, positions).error;
  }
  row.result = std::move(result);
  return row;
}

std::optional<double> mean(const std::vector<LiveRow>& rows, std::optional<double> LiveRow::* value) {
  double sum = 0;
  std::size_t count = 0;
  for (const LiveRow& row : rows)
    if (row.*value) sum += *(row.*value), ++count;
  return count == 0 ? std::nullopt : std::optional(sum / static_cast<double>(count));
}

}  // namespace

std::optional<double> LiveSummary::mean_error() const { return mean(rows, &LiveRow::error); }
std::optional<double> LiveSummary::mean_oracle_error() const { return mean(rows, &LiveRow::oracle_error); }

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
  WireContext context;
  ResultSource source(context, options.results_endpoint, results_held, options.access);
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
    WireResult result;
    if (message_kind(*message) != MessageKind::result) continue;
    if (const WireStatus status = decode_result(*message, result); status != WireStatus::ok)
      throw Error(Status::bad_input, options.results_endpoint + ": a result cannot be read: " + std::string(explain(status)));
    if (result.model_checksum != model.checksum())
      throw Error(Status::bad_input, options.results_endpoint + ": these results were matched with another model; give the one that "
                                                                "the matcher uses");
    if (result.status == WireStatus::end_of_stream) {
      summary.complete = true;
      continue;
    }
    summary.rows.push_back(judge(std::move(result), model, truth));
    row(summary.rows.back());
  }
  return summary;
}

}  // namespace lbea
