/* Matching by fit: a model baked with a rig's views, and frames as points in that rig's coordinates. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* sensor = R' (reference - t) */
static lbea_point in_sensor(const float T[12], const float p[3]) {
  float out[3];
  for (int k = 0; k < 3; ++k) out[k] = T[k] * (p[0] - T[3]) + T[4 + k] * (p[1] - T[7]) + T[8 + k] * (p[2] - T[11]);
  return (lbea_point){out[0], out[1], out[2]};
}

/* Keeps the nodes in front of which, along the line of sight, there is no other one: those that a camera sees. */
static uint32_t keep_visible(lbea_point* points, uint32_t count) {
  const float beside = 0.015f, in_front = 8; /* tangent of the angle, two nodes wide; mm */
  lbea_point* visible = malloc(count * sizeof *visible);
  uint32_t kept = 0;
  for (uint32_t i = 0; i < count; ++i) {
    const lbea_point p = points[i];
    int is_hidden = 0;
    for (uint32_t j = 0; j < count && !is_hidden; ++j) {
      const lbea_point q = points[j];
      is_hidden =
          q.z < p.z - in_front && fabsf(q.x / q.z - p.x / p.z) < beside && fabsf(q.y / q.z - p.y / p.z) < beside;
    }
    if (!is_hidden) visible[kept++] = p;
  }
  memcpy(points, visible, kept * sizeof *points);
  free(visible);
  return kept;
}

void depth_images_decide(const char* model_file, const char* sensor_json) {
  lbea_model* model = NULL;
  if (lbea_model_open(model_file, &model) != LBEA_OK) exit(1);
  lbea_model_info info = {.struct_size = sizeof info};
  lbea_model_get_info(model, &info);
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.method = LBEA_METHOD_FIT;
  config.min_coverage = 0.1f;
  config.trusted_distance = 10; /* nodes are farther apart than a sensor's points */
  read_pose(sensor_json, config.T_reference_sensor);
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  if (matcher == NULL) printf("%s\n", lbea_last_error());

  const uint32_t sample = info.samples - 1;
  const float* positions = lbea_model_node_positions(model, sample);
  lbea_point* points = malloc(info.nodes * sizeof *points);
  for (uint32_t i = 0; i < info.nodes; ++i) points[i] = in_sensor(config.T_reference_sensor, positions + 3 * i);
  const uint32_t seen = keep_visible(points, info.nodes);
  const lbea_frame frame = {.struct_size = sizeof frame, .points = points, .point_count = seen};
  lbea_result result = {.struct_size = sizeof result};
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_OK);
  CHECK(result.candidate_count > 1 && result.estimate_count > 0 && result.match_count > 0);
  CHECK(result.candidates[0].distance == result.residual && result.residual <= result.candidates[1].distance);
  /* Matched without the history of the test. */
#define IS_OF_HISTORY(name) (strncmp(#name, "pose_", 5) == 0 || strncmp(#name, "test_time", 9) == 0)
#define IS_FINITE(name) CHECK(!isfinite(result.name) == IS_OF_HISTORY(name));
  LBEA_FRAME_NUMBERS(IS_FINITE)
  LBEA_FIT_NUMBERS(IS_FINITE)
  CHECK(result.fit_ns > 0);
  float sum = 0;
  for (uint32_t i = 0; i < result.estimate_count; ++i) sum += result.estimate[i].weight;
  CHECK(fabsf(sum - 1) < 1e-4f);
  free(points);
  lbea_matcher_destroy(matcher);
  lbea_model_close(model);
}
