/* The forecast of a test of a run that is not in the model. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double sum_of(const float* values, uint32_t count) {
  double sum = 0;
  for (uint32_t i = 0; i < count; ++i) sum += (double)values[i];
  return sum;
}

/* The last sample of each run, combined as the state says. */
static double error_of(const lbea_model* model, const lbea_forecast_state* state, const float* positions) {
  const lbea_model_info info = info_of(model);
  const uint32_t states = info.samples / info.simulations;
  double largest = 0;
  for (uint32_t i = 0; i < 3 * info.nodes; ++i) {
    double sum = 0;
    for (uint32_t run = 0; run < state->run_count; ++run)
      sum += (double)(state->run_weights[run] * lbea_model_node_positions(model, (run + 1) * states - 1)[i]);
    largest = fmax(largest, fabs(sum - (double)positions[i]));
  }
  return largest;
}

static void the_prior_is_the_mean_of_all_runs(lbea_forecast* forecast, const lbea_model_info* info) {
  lbea_forecast_state prior = {.struct_size = sizeof prior};
  CHECK(lbea_forecast_update(forecast, NULL, &prior) == LBEA_OK);
  CHECK(prior.frames == 0 && prior.run_count == info->simulations && prior.parameter_count == info->parameters);
  CHECK(prior.error_90 > 0);
  for (uint32_t run = 0; run < prior.run_count; ++run)
    CHECK(fabsf(prior.run_weights[run] - 1.0f / (float)info->simulations) < 1e-6f);
  for (uint32_t p = 0; p < prior.parameter_count; ++p) CHECK(prior.parameters[p].is_identifiable == 0);
  CHECK(prior.channel_count > 0);
  for (uint32_t c = 0; c < prior.channel_count; ++c)
    CHECK(isnan(prior.channels[c].value) && prior.channels[c].final_bound_90 > 0);
}

static void positions_follow_from_the_weights(const lbea_model* model, lbea_forecast* forecast,
                                              const lbea_forecast_state* state) {
  const size_t count = 3 * (size_t)info_of(model).nodes;
  float* positions = malloc(count * sizeof *positions);
  CHECK(lbea_forecast_get_final_positions(forecast, positions, count - 1) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_forecast_get_final_positions(forecast, positions, count) == LBEA_OK);
  CHECK(error_of(model, state, positions) < 1e-2);
  free(positions);
}

static void a_test_is_forecast(const lbea_model* model, const char* sensor_json, const char* frames) {
  const lbea_model_info info = info_of(model);
  CHECK(info.has_forecast == 1 && info.parameters == 12);
  CHECK(strcmp(lbea_model_parameter_name(model, 5), "v0 [m/s]") == 0);
  CHECK(lbea_model_parameter_name(model, info.parameters) == NULL && lbea_model_parameter_name(NULL, 0) == NULL);
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.method = LBEA_METHOD_FIT;
  read_pose(sensor_json, config.T_reference_sensor);
  lbea_matcher* matcher = NULL;
  lbea_test_history* history = NULL;
  lbea_forecast* forecast = NULL;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  CHECK(lbea_test_history_create(model, &history) == LBEA_OK);
  CHECK(lbea_forecast_create(model, &forecast) == LBEA_OK && forecast != NULL);
  lbea_test_history_set_impact(history, 0);
  the_prior_is_the_mean_of_all_runs(forecast, &info);

  lbea_point* points = malloc(most_points * sizeof *points);
  lbea_result result = {.struct_size = sizeof result};
  lbea_forecast_state state = {.struct_size = sizeof state};
  for (int i = 0; i < frame_count; ++i) {
    const lbea_frame frame = {.struct_size = sizeof frame,
                              .stamp_ns = 3000000 * i,
                              .points = points,
                              .point_count = read_cloud(frames, i, points)};
    CHECK(lbea_matcher_match_with_history(matcher, &frame, history, &result) == LBEA_OK);
    CHECK(lbea_forecast_update(forecast, matcher, &state) == LBEA_OK);
  }
  free(points);
  CHECK(state.frames == frame_count && state.error_90 > 0 && fabs(state.test_time_s - 0.009) < 1e-4);
  CHECK(fabs(sum_of(state.run_weights, state.run_count) - 1) < 1e-3);
  CHECK(fabs(sum_of(state.branch_probabilities, state.branch_count) - 1) < 1e-5);
  for (uint32_t p = 0; p < state.parameter_count; ++p)
    CHECK(state.parameters[p].is_identifiable == (state.parameters[p].r2 >= 0.2f) && state.parameters[p].bound_90 > 0);
  positions_follow_from_the_weights(model, forecast, &state);

  lbea_forecast_state small = {.struct_size = 8};
  CHECK(lbea_forecast_update(forecast, matcher, &small) == LBEA_BAD_ARGUMENT);
  lbea_forecast_reset(forecast);
  the_prior_is_the_mean_of_all_runs(forecast, &info);
  lbea_forecast_destroy(forecast);
  lbea_test_history_destroy(history);
  lbea_matcher_destroy(matcher);
}

static void other_models_and_null_are_refused(const lbea_model* without, const lbea_model* model) {
  CHECK(info_of(without).has_forecast == 0);
  lbea_forecast* forecast = NULL;
  CHECK(lbea_forecast_create(without, &forecast) == LBEA_BAD_CONFIG && forecast == NULL);
  CHECK(strstr(lbea_last_error(), "no forecast") != NULL);
  CHECK(lbea_forecast_create(NULL, &forecast) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_forecast_create(model, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_forecast_create(model, &forecast) == LBEA_OK);
  lbea_matcher* stranger = NULL;
  CHECK(lbea_matcher_create(without, NULL, &stranger) == LBEA_OK);
  lbea_forecast_state state = {.struct_size = sizeof state};
  CHECK(lbea_forecast_update(forecast, stranger, &state) == LBEA_BAD_ARGUMENT);
  CHECK(strstr(lbea_last_error(), "another model") != NULL);
  CHECK(lbea_forecast_update(NULL, NULL, &state) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_forecast_update(forecast, NULL, NULL) == LBEA_BAD_ARGUMENT);
  float position = 0;
  CHECK(lbea_forecast_get_final_positions(NULL, &position, 1) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_forecast_get_final_positions(forecast, NULL, 1) == LBEA_BAD_ARGUMENT);
  lbea_forecast_reset(NULL);
  lbea_forecast_destroy(NULL);
  lbea_forecast_destroy(forecast);
  lbea_matcher_destroy(stranger);
}

void the_end_is_forecast(const char* plates, const char* demo, const char* sensor_json, const char* frames) {
  lbea_model *plain = opened(plates), *seen = opened(demo);
  a_test_is_forecast(seen, sensor_json, frames);
  other_models_and_null_are_refused(plain, seen);
  lbea_model_close(seen);
  lbea_model_close(plain);
}
