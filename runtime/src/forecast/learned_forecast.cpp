#include "runtime/src/forecast/learned_forecast.hpp"

#include "runtime/src/model/section_reader.hpp"

namespace lbea {

std::shared_ptr<const LearnedForecast> read_forecast(const SectionReader& sections, const format::Info& info) {
  using format::SectionId;
  LearnedForecast forecast;
  if (sections.find(SectionId::forecast_numbers) == nullptr) return nullptr;
  constexpr std::uint64_t nodes = LearnedForecast::nodes, most = LearnedForecast::most_components;
  const auto read = [&](SectionId id, std::array<std::uint64_t, 3> shape) {
    const auto section = sections.required<float>(id, shape);
    if (!sections.content(id).is_measured) sections.fail(id, 0, "a value is not finite or too large");
    return section;
  };
  forecast.numbers =
      sections.required<double>(SectionId::forecast_numbers, {1 + nodes, 1 + 2 * std::uint64_t{info.parameters}, 1});
  forecast.means =
      read(SectionId::forecast_means, {1 + nodes * LearnedForecast::means_per_node, LearnedForecast::shape_scores, 1});
  forecast.components = read(SectionId::forecast_components, {nodes, most, LearnedForecast::features});
  forecast.runs = read(SectionId::forecast_runs, {nodes, LearnedForecast::trained_runs(info.simulations), most});
  forecast.parameters = read(SectionId::forecast_parameters, {nodes, info.parameters, most});
  const std::size_t stride = 1 + 2 * std::size_t{info.parameters};
  for (std::size_t i = 0; i < forecast.numbers.size(); ++i) {
    const double value = forecast.numbers[i];
    const bool is_r2 = i % stride % 2 == 1;
    if (!format::is_measured(value) || (is_r2 ? value > 1 : value < 0))
      sections.fail(SectionId::forecast_numbers, 0, "a value is out of range");
  }
  if (sections.find(SectionId::regression_shapes) == nullptr)
    sections.fail(SectionId::forecast_numbers, 0, "there are no shapes to forecast from: section 0x8005");
  return forecast.numbers[0] > 0 ? std::make_shared<const LearnedForecast>(forecast) : nullptr;
}

}  // namespace lbea
