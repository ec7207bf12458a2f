#include "tools/eval/channels/channel_tables.hpp"

#include "runtime/src/channels/learned_channels.hpp"
#include "tools/eval/evaluation_report.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

std::string kind_of(const ChannelInfo& info) {
  std::string text(to_string(info.kind));
  if (info.kind != ChannelKind::distance && is_of_nodes(info.kind))
    text += " " + std::string(to_string(info.component));
  return info.cfc == 0 ? text : text + ", CFC " + std::to_string(info.cfc);
}

/// Means over the tests of their frames' means.
class ChannelMeans {
 public:
  ChannelMeans(const Round& round, std::size_t channel) : round_(round), channel_(channel) {}

  template <class Value>
  [[nodiscard]] double of(const Value& value) const {
    std::vector<double> tests;
    for (const TestTrial& test : round_.tests) {
      std::vector<double> frames;
      for (const FrameTrial& frame : test.frames)
        if (channel_ < frame.channels.size()) frames.push_back(value(frame.channels[channel_]));
      tests.push_back(mean(frames));
    }
    return mean(tests);
  }
  /// Greatest true magnitude of each test, in the mean.
  [[nodiscard]] double peak() const {
    std::vector<double> tests;
    for (const TestTrial& test : round_.tests) {
      double most = not_measured;
      for (const FrameTrial& frame : test.frames)
        if (channel_ < frame.channels.size()) most = std::fmax(most, std::abs(frame.channels[channel_].truth));
      tests.push_back(most);
    }
    return mean(tests);
  }

 private:
  const Round& round_;
  std::size_t channel_;
};

double error_of(const ChannelScore& score) { return std::abs(score.value - score.truth); }
double is_within(const ChannelScore& score) {
  return std::isnan(score.bound_90 + score.truth) ? not_measured : error_of(score) <= score.bound_90 ? 1 : 0;
}

double final_error_of(const ChannelScore& score) { return std::abs(score.final_value - score.final_truth); }
double is_final_within(const ChannelScore& score) {
  return std::isnan(score.final_bound_90 + score.final_truth) ? not_measured
         : final_error_of(score) <= score.final_bound_90      ? 1
                                                              : 0;
}

std::string row(const Round& round, const ChannelInfo& info, std::size_t channel) {
  const ChannelMeans means(round, channel);
  const double error = means.of(error_of), peak = means.peak();
  const double without = means.of([](const ChannelScore& score) { return std::isnan(score.bound_90) ? 1.0 : 0.0; });
  return table_line({std::string(info.name), kind_of(info), std::string(info.unit), formatted("%.4g", peak),
                     formatted("%.4g", error), formatted("%.2f %%", 100 * error / peak),
                     formatted("%.1f %%", 100 * means.of(is_within)),
                     formatted("%.4g", means.of([](const ChannelScore& score) { return score.bound_90; })),
                     formatted("%.1f %%", 100 * without), formatted("%.4g", means.of(final_error_of)),
                     formatted("%.1f %%", 100 * means.of(is_final_within))});
}

}  // namespace

std::string channel_tables(const Evaluation& evaluation) {
  std::string text;
  if (!evaluation.model || evaluation.model->channels() == 0) return text;
  for (const Round& round : evaluation.rounds) {
    if (round.title != "unseen") continue;
    text += table_head("Channels, unseen experiments, " + round.disturbance.name,
                       {"channel", "kind", "unit", "peak", "mean error", "of the peak", "within bound_90",
                        "mean bound_90", "frames without", "mean error of the forecast end", "within its bound_90"});
    for (std::uint32_t c = 0; c < evaluation.model->channels(); ++c)
      text += row(round, evaluation.model->channel(c), c);
    std::vector<double> times;
    for (const TestTrial& test : round.tests)
      for (const FrameTrial& frame : test.frames) times.push_back(1e-3 * frame.channels_ns);
    text += formatted("\nMeans over tests. Median time of all channels per frame: %.1f us.\n\n", median(times));
  }
  return text;
}

}  // namespace lbea::tool
