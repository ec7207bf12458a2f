/* The pose error of a test: frames of a run that is not in the model, matched as if the rig stood elsewhere. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const float wrong_by[3] = {3, 0, 4}; /* mm */

static lbea_matcher* matcher_of(const lbea_model* model, lbea_method method, const float T_reference_sensor[12]) {
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.method = (int32_t)method;
  memcpy(config.T_reference_sensor, T_reference_sensor, sizeof config.T_reference_sensor);
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  return matcher;
}

static lbea_test_history* history_of(const lbea_model* model) {
  lbea_test_history* history = NULL;
  CHECK(lbea_test_history_create(model, &history) == LBEA_OK && history != NULL);
  return history;
}

static int is_identity(const lbea_test_history* history) {
  float T[12] = {0};
  CHECK(lbea_test_history_get_pose_correction(history, T) == LBEA_OK);
  for (int i = 0; i < 12; ++i)
    if (T[i] != (float)(i % 5 == 0)) return 0;
  return 1;
}

/* Distance of the point from where it should be after the correction. */
static float left_at(const lbea_test_history* history, const float* point) {
  float T[12], squared = 0;
  CHECK(lbea_test_history_get_pose_correction(history, T) == LBEA_OK);
  for (int i = 0; i < 3; ++i) {
    float off = T[4 * i + 3] - point[i];
    for (int j = 0; j < 3; ++j) off += T[4 * i + j] * (point[j] + wrong_by[j]);
    squared += off * off;
  }
  return sqrtf(squared);
}

static void a_wrong_pose_is_corrected(const lbea_model* model, const char* frames, const float wrong[12]) {
  lbea_matcher *alone = matcher_of(model, LBEA_METHOD_FIT, wrong), *posed = matcher_of(model, LBEA_METHOD_FIT, wrong);
  lbea_test_history* history = history_of(model);
  CHECK(lbea_test_history_estimates_pose(history) == 1);
  CHECK(is_identity(history));
  lbea_point* points = malloc(most_points * sizeof *points);
  for (int i = 0; i < frame_count; ++i) {
    const lbea_frame frame = {
        .struct_size = sizeof frame, .points = points, .point_count = read_cloud(frames, i, points)};
    lbea_result without = {.struct_size = sizeof without}, with = without;
    lbea_matcher_match(alone, &frame, &without);
    CHECK(lbea_matcher_match_with_history(posed, &frame, history, &with) == LBEA_OK);
    CHECK(isnan(without.pose_turn) && isnan(without.pose_shift));
    CHECK(fabsf(with.pose_shift - 5) < 1.5f && with.pose_turn < 1);
    CHECK(with.residual < without.residual);
  }
  const float* nodes = lbea_model_node_positions(model, 0);
  for (uint32_t node = 0; node < info_of(model).nodes; node += 100)
    CHECK(left_at(history, nodes + 3 * node) < 5.0f / 2);
  lbea_test_history_reset(history);
  CHECK(is_identity(history));
  lbea_test_history_fix_pose(history);
  CHECK(lbea_test_history_estimates_pose(history) == 0);
  lbea_test_history_set_impact(history, 5000000);
  const lbea_frame last = {.struct_size = sizeof last,
                           .stamp_ns = 7000000,
                           .points = points,
                           .point_count = read_cloud(frames, frame_count - 1, points)};
  lbea_result timed = {.struct_size = sizeof timed};
  CHECK(lbea_matcher_match_with_history(posed, &last, history, &timed) == LBEA_OK);
  CHECK(fabsf(timed.test_time - 2e-3f) < 1e-6f && isnan(timed.pose_shift));
  free(points);
  lbea_test_history_destroy(history);
  lbea_matcher_destroy(posed);
  lbea_matcher_destroy(alone);
}

static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/* Here a model without depth images, and a method that compares none. */
static void where_it_is_not_estimated_frames_are_matched_as_without(const lbea_model* model) {
  lbea_matcher* matcher = matcher_of(model, LBEA_METHOD_LBEA, identity);
  lbea_test_history* history = history_of(model);
  const lbea_frame frame = frame_of(model, 9);
  lbea_result without = {.struct_size = sizeof without}, with = without;
  CHECK(lbea_matcher_match(matcher, &frame, &without) == LBEA_OK);
  const lbea_match best = without.matches[0];
  CHECK(lbea_matcher_match_with_history(matcher, &frame, history, &with) == LBEA_OK);
  CHECK(with.matches[0].sample == best.sample && with.matches[0].distance == best.distance);
  CHECK(with.coverage == without.coverage && isnan(with.pose_turn) && isnan(with.pose_shift));
  CHECK(is_identity(history));
  lbea_test_history_destroy(history);
  lbea_matcher_destroy(matcher);
}

static void histories_of_other_models_and_null_are_refused(const lbea_model* model, const lbea_model* other) {
  lbea_matcher* matcher = matcher_of(model, LBEA_METHOD_LBEA, identity);
  lbea_test_history* stranger = history_of(other);
  const lbea_frame frame = frame_of(model, 9);
  lbea_result result = {.struct_size = sizeof result};
  CHECK(lbea_matcher_match_with_history(matcher, &frame, stranger, &result) == LBEA_BAD_ARGUMENT);
  CHECK(result.status == LBEA_BAD_ARGUMENT && result.match_count == 0);
  CHECK(strstr(lbea_last_error(), "another model") != NULL);
  result.status = LBEA_OK;
  CHECK(lbea_matcher_match_with_history(matcher, &frame, NULL, &result) == LBEA_BAD_ARGUMENT);
  CHECK(result.status == LBEA_BAD_ARGUMENT);
  CHECK(lbea_matcher_match_with_history(matcher, &frame, NULL, NULL) == LBEA_BAD_ARGUMENT);
  lbea_test_history_destroy(stranger);

  lbea_test_history* history = history_of(model);
  result.status = LBEA_OK;
  CHECK(lbea_matcher_match_with_history(NULL, &frame, history, &result) == LBEA_BAD_ARGUMENT);
  CHECK(result.status == LBEA_BAD_ARGUMENT);
  CHECK(lbea_matcher_match_with_history(matcher, NULL, history, &result) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_matcher_match_with_history(matcher, &frame, history, NULL) == LBEA_BAD_ARGUMENT);
  float T[12];
  CHECK(lbea_test_history_get_pose_correction(NULL, T) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_test_history_get_pose_correction(history, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_test_history_estimates_pose(NULL) == 0);
  lbea_test_history_reset(NULL);
  lbea_test_history_destroy(NULL);
  lbea_test_history_destroy(history);
  CHECK(lbea_test_history_create(NULL, &history) == LBEA_BAD_ARGUMENT && history == NULL);
  CHECK(lbea_test_history_create(model, NULL) == LBEA_BAD_ARGUMENT);
  lbea_matcher_destroy(matcher);
}

void pose_errors_are_corrected(const char* plates, const char* demo, const char* sensor_json, const char* frames) {
  lbea_model *plain = opened(plates), *seen = opened(demo);
  lbea_test_history* history = history_of(plain);
  CHECK(lbea_test_history_estimates_pose(history) == 0);
  lbea_test_history_destroy(history);
  where_it_is_not_estimated_frames_are_matched_as_without(plain);
  where_it_is_not_estimated_frames_are_matched_as_without(seen);
  histories_of_other_models_and_null_are_refused(plain, seen);
  float wrong[12] = {0};
  read_pose(sensor_json, wrong);
  for (int i = 0; i < 3; ++i) wrong[4 * i + 3] += wrong_by[i];
  a_wrong_pose_is_corrected(seen, frames, wrong);
  lbea_model_close(seen);
  lbea_model_close(plain);
}
