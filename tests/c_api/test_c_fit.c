/* Matching by fit: a model baked with a rig's views, and frames as points in that rig's coordinates. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void depth_images_decide(const char* model_file, const char* sensor_json, const char* frames) {
  lbea_model* model = NULL;
  if (lbea_model_open(model_file, &model) != LBEA_OK) exit(1);
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.method = LBEA_METHOD_FIT;
  read_pose(sensor_json, config.T_reference_sensor);
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  if (matcher == NULL) printf("%s\n", lbea_last_error());

  lbea_point* points = malloc(most_points * sizeof *points);
  const lbea_frame frame = {
      .struct_size = sizeof frame, .points = points, .point_count = read_cloud(frames, 3, points)};
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
