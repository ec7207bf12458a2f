#include "runtime/src/forecast/channel_forecaster.hpp"

#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/model/model_view.hpp"
#include "runtime/src/model/run_samples.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lbea {
namespace {

constexpr std::size_t most = LearnedForecast::most_components, per_channel = LearnedForecast::values_per_channel;
constexpr std::size_t times = 1 + LearnedForecast::nodes * LearnedForecast::means_per_node;

/// Linearly between two samples; before and after all, of the nearest.
double value_at(const RunSamples& run, std::span<const double> sample_times, std::span<const float> values,
                double time_s) {
  const auto [before, share] = run.place_of(sample_times, time_s);
  const double value{values[before]};
  return share == 0 ? value : value + share * (double{values[before + 1]} - value);
}

/// Over the trained runs.
std::vector<float> mean_values(const ModelView& view, std::span<const float> values) {
  const std::vector<RunSamples> all = samples_of_runs(
      view.info.samples, [&](std::size_t s) { return view.sample(static_cast<std::uint32_t>(s)).simulation; });
  const auto runs = static_cast<std::uint32_t>(all.size());
  const ForecastTimes clock(view.sample_times);
  std::vector<float> means;
  for (std::size_t i = 0; i < times; ++i) {
    const double time_s = clock.at(static_cast<double>(i) / LearnedForecast::means_per_node);
    double sum = 0;
    for (std::size_t k = 0; k < LearnedForecast::trained_runs(runs); ++k)
      sum += value_at(all[LearnedForecast::trained_run(k, runs)], view.sample_times, values, time_s);
    means.push_back(static_cast<float>(sum / LearnedForecast::trained_runs(runs)));
  }
  return means;
}

}  // namespace

[[gnu::cold]] ChannelForecaster::ChannelForecaster(const ModelView& view) : learned_(*view.forecast) {
  if (learned_.channel_numbers.empty()) return;
  channels_.resize(view.channels->size());
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const std::vector<float> of_channel =
        mean_values(view, view.channels->values.subspan(c * view.info.samples, view.info.samples));
    means_.insert(means_.end(), of_channel.begin(), of_channel.end());
  }
}

void ChannelForecaster::begin(float at) noexcept {
  const float place = at * LearnedForecast::means_per_node;
  const auto before = std::min(static_cast<std::size_t>(place), times - 2);
  const float share = place - static_cast<float>(before);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const float* means = &means_[c * times];
    channels_[c] = {means[before] + share * (means[before + 1] - means[before]), 0, means[times - 1], 0};
  }
}

void ChannelForecaster::forget_time() noexcept {
  for (ChannelForecast& channel : channels_) channel.value = channel.bound_90 = std::numeric_limits<float>::quiet_NaN();
}

const double* ChannelForecaster::numbers(std::size_t row, std::size_t channel) const noexcept {
  return &learned_.channel_numbers[(row * channels_.size() + channel) * LearnedForecast::numbers_per_channel];
}

void ChannelForecaster::add_bounds(std::size_t row, float share) noexcept {
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    channels_[c].bound_90 += share * static_cast<float>(numbers(row, c)[0]);
    channels_[c].final_bound_90 += share * static_cast<float>(numbers(row, c)[2]);
  }
}

/// value: per_channel times the channel, and which of its values.
float ChannelForecaster::deviation(std::size_t window, std::size_t value, double ridge,
                                   std::span<const float> components) const noexcept {
  const float* products = &learned_.channel_products[(window * channels_.size() * per_channel + value) * most];
  const float* variances = &learned_.variances[window * most];
  float sum = 0;
  for (std::size_t i = 0; i < most; ++i) {
    const float by = variances[i] + static_cast<float>(ridge);
    if (by > 0) sum += components[i] * products[i] / by;
  }
  return sum;
}

void ChannelForecaster::add(std::size_t window, std::size_t row, std::span<const float> components,
                            float share) noexcept {
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    channels_[c].value += share * deviation(window, per_channel * c, numbers(row, c)[1], components);
    channels_[c].final_value += share * deviation(window, per_channel * c + 1, numbers(row, c)[3], components);
  }
}

}  // namespace lbea
