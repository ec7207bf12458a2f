#include "runtime/src/forecast/learned_forecast.hpp"

#include "runtime/src/model/section_reader.hpp"

#include <algorithm>

namespace lbea {
namespace {

using format::SectionId;

void read_channel_regressions(const SectionReader& sections, std::uint64_t channels, LearnedForecast& forecast) {
  constexpr std::uint64_t windows = ForecastWindow::count, values = LearnedForecast::values_per_channel;
  const bool has_products = sections.find(SectionId::channel_products) != nullptr;
  if (channels == 0 || (sections.find(SectionId::channel_numbers) == nullptr && !has_products)) return;
  forecast.channel_numbers =
      sections.required<double>(SectionId::channel_numbers,
                                {LearnedForecast::kinds, 1 + windows, channels * LearnedForecast::numbers_per_channel});
  forecast.channel_products = sections.required<float>(SectionId::channel_products,
                                                       {windows, channels * values, LearnedForecast::most_components});
  if (!sections.content(SectionId::channel_products).is_measured)
    sections.fail(SectionId::channel_products, 0, "a value is not finite or too large");
  if (std::ranges::any_of(forecast.channel_numbers, [](double v) { return !format::is_measured(v) || v < 0; }))
    sections.fail(SectionId::channel_numbers, 0, "a value is out of range");
}

}  // namespace

std::shared_ptr<const LearnedForecast> read_forecast(const SectionReader& sections, const format::Info& info,
                                                     std::uint64_t channels) {
  LearnedForecast forecast;
  if (sections.find(SectionId::window_numbers) == nullptr) return nullptr;
  constexpr std::uint64_t nodes = LearnedForecast::nodes, windows = ForecastWindow::count,
                          most = LearnedForecast::most_components, scores = LearnedForecast::shape_scores;
  const auto read = [&](SectionId id, std::array<std::uint64_t, 3> shape) {
    const auto section = sections.required<float>(id, shape);
    if (!sections.content(id).is_measured) sections.fail(id, 0, "a value is not finite or too large");
    return section;
  };
  const std::size_t stride = LearnedForecast::numbers_per_window(info.parameters);
  forecast.numbers =
      sections.required<double>(SectionId::window_numbers, {LearnedForecast::kinds, 1 + windows, stride});
  forecast.means = read(SectionId::window_means, {1 + nodes * LearnedForecast::means_per_node, scores, 1});
  forecast.components = read(SectionId::window_components, {LearnedForecast::all_sizes, most, scores});
  forecast.variances = read(SectionId::window_variances, {windows, most, 1});
  forecast.runs = read(SectionId::window_runs, {windows, LearnedForecast::trained_runs(info.simulations), most});
  forecast.parameters = read(SectionId::window_parameters, {windows, info.parameters, most});
  for (std::size_t i = 0; i < forecast.numbers.size(); ++i) {
    const double value = forecast.numbers[i];
    const bool is_r2 = i % stride >= 2 && (i % stride - 2) % 3 == 0;
    if (!format::is_measured(value) || (is_r2 ? value > 1 : value < 0))
      sections.fail(SectionId::window_numbers, 0, "a value is out of range");
  }
  if (std::ranges::any_of(forecast.variances, [](float value) { return value < 0; }))
    sections.fail(SectionId::window_variances, 0, "a value is negative");
  if (sections.find(SectionId::regression_shapes) == nullptr)
    sections.fail(SectionId::window_numbers, 0, "there are no shapes to forecast from: section 0x8005");
  read_channel_regressions(sections, channels, forecast);
  return forecast.numbers[0] > 0 ? std::make_shared<const LearnedForecast>(forecast) : nullptr;
}

}  // namespace lbea
