// The C interface to forecasts.
#include "runtime/src/c_api/c_support.hpp"

#include <lbea/forecast.hpp>

struct lbea_forecast {
  explicit lbea_forecast(const lbea::Model& of)
      : model(of), forecast(of), parameters(of.parameters()), channels(forecast.state().channels.size()) {}
  lbea::Model model;
  lbea::Forecast forecast;
  std::vector<lbea_parameter_forecast> parameters;
  std::vector<lbea_channel_forecast> channels;
};

namespace lbea {
namespace {
// The struct's size in the first version that had it: every caller knows at least these fields.
constexpr std::size_t least_forecast_state =
    offsetof(lbea_forecast_state, parameter_count) + sizeof(lbea_forecast_state::parameter_count);

lbea_forecast_state state_of(lbea_forecast& of) noexcept {
  const TestForecast& now = of.forecast.state();
  std::ranges::transform(now.parameters, of.parameters.begin(), [](const ParameterForecast& from) {
    return lbea_parameter_forecast{from.value, from.bound_90, from.r2, from.is_identifiable() ? 1 : 0};
  });
  std::ranges::transform(now.channels, of.channels.begin(), [](const ChannelForecast& from) {
    return lbea_channel_forecast{from.value, from.bound_90, from.final_value, from.final_bound_90};
  });
  return {0,
          now.error_90,
          now.frames,
          now.test_time_s,
          now.run_weights.data(),
          now.branch_probabilities.data(),
          of.parameters.data(),
          static_cast<std::uint32_t>(now.run_weights.size()),
          static_cast<std::uint32_t>(now.branch_probabilities.size()),
          static_cast<std::uint32_t>(of.parameters.size()),
          static_cast<std::uint32_t>(of.channels.size()),
          of.channels.data()};
}

/// result: null to add nothing.
lbea_status update(lbea_forecast* forecast, const CResult* result, lbea_forecast_state* state) noexcept {
  if (forecast == nullptr || state == nullptr) return bad_argument("lbea_forecast_update: forecast or state is NULL");
  if (!is_plausible_size(state->struct_size, least_forecast_state)) return bad_argument(size_not_set);
  if (result != nullptr) {
    if (result->model.checksum() != forecast->model.checksum())
      return bad_argument("lbea_forecast_update: the matcher is of another model; create both with the same one");
    forecast->forecast.update(result->last);
  }
  write_c_struct(state_of(*forecast), state);
  return LBEA_OK;
}
}  // namespace
}  // namespace lbea

using namespace lbea;

lbea_status lbea_forecast_create(const lbea_model* model, lbea_forecast** forecast) {
  if (forecast == nullptr) return bad_argument("lbea_forecast_create: forecast is NULL; give the address of a pointer");
  *forecast = nullptr;
  if (model == nullptr) return bad_argument("lbea_forecast_create: model is NULL; open one first");
  return guarded([&] {
    *forecast = new lbea_forecast(model->model);
    return LBEA_OK;
  });
}

void lbea_forecast_destroy(lbea_forecast* forecast) { delete forecast; }

void lbea_forecast_reset(lbea_forecast* forecast) {
  if (forecast != nullptr) forecast->forecast.reset();
}

lbea_status lbea_forecast_update(lbea_forecast* forecast, const lbea_matcher* matcher, lbea_forecast_state* state) {
  return update(forecast, matcher == nullptr ? nullptr : &matcher->result, state);
}

lbea_status lbea_forecast_update_by_rigs(lbea_forecast* forecast, const lbea_rig_matcher* matcher,
                                         lbea_forecast_state* state) {
  return update(forecast, matcher == nullptr ? nullptr : &matcher->result, state);
}

lbea_status lbea_forecast_get_final_positions(const lbea_forecast* forecast, float* positions, size_t count) {
  if (forecast == nullptr || positions == nullptr)
    return bad_argument("lbea_forecast_get_final_positions: forecast or positions is NULL");
  if (count < std::size_t{3} * forecast->model.nodes())
    return bad_argument("lbea_forecast_get_final_positions: too little room; give 3 x lbea_model_info.nodes");
  return guarded([&] {
    std::ranges::copy(final_positions(forecast->model, forecast->forecast.state()), positions);
    return LBEA_OK;
  });
}
