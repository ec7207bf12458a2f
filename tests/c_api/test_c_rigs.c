/* Two rigs: each sees every second point of frames of a run that is not in the model. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static lbea_rig_matcher* rigs_matcher(const lbea_model* model, const lbea_rig* rigs) {
  lbea_rig_matcher* matcher = NULL;
  CHECK(lbea_rig_matcher_create(model, NULL, rigs, 2, &matcher) == LBEA_OK);
  if (matcher == NULL) exit(1);
  return matcher;
}

/* Of lbea_rig_matcher_create for these rigs. */
static lbea_status refusal(const lbea_model* model, const lbea_rig* rigs, uint32_t count, const char* words) {
  static int anything;
  lbea_rig_matcher* matcher = (lbea_rig_matcher*)&anything;
  const lbea_status status = lbea_rig_matcher_create(model, NULL, rigs, count, &matcher);
  CHECK(matcher == NULL);
  CHECK(strstr(lbea_last_error(), words) != NULL);
  return status;
}

static void rigs_are_refused_in_words(const lbea_model* model, const lbea_model* unseen, const lbea_rig* rigs) {
  CHECK(refusal(NULL, rigs, 2, "NULL") == LBEA_BAD_ARGUMENT);
  CHECK(refusal(model, NULL, 2, "NULL") == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_create(model, NULL, rigs, 2, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(refusal(model, rigs, 0, "0 rigs") == LBEA_BAD_CONFIG);
  CHECK(refusal(model, rigs, 17, "17 rigs") == LBEA_BAD_CONFIG);
  CHECK(refusal(model, rigs, UINT32_MAX, "give 1 to 16") == LBEA_BAD_CONFIG);
  CHECK(refusal(unseen, rigs, 2, "without a sensor") == LBEA_BAD_CONFIG);
  lbea_rig wrong[2] = {rigs[0], rigs[1]};
  wrong[1].T_reference_sensor[0] *= -1;
  CHECK(refusal(model, wrong, 2, "rig 2: ") == LBEA_BAD_CONFIG);
  wrong[1].T_reference_sensor[0] = NAN;
  CHECK(refusal(model, wrong, 2, "rig 2: ") == LBEA_BAD_CONFIG);
  wrong[1] = rigs[1];
  wrong[1].struct_size = 0;
  CHECK(refusal(model, wrong, 2, "struct_size") == LBEA_BAD_CONFIG);
  struct {
    lbea_rig known;
    float later;
  } newer[2] = {{.known = rigs[0]}, {.known = rigs[1]}};
  newer[0].known.struct_size = newer[1].known.struct_size = sizeof newer[0];
  lbea_rig_matcher* matcher = NULL;
  CHECK(lbea_rig_matcher_create(model, NULL, &newer[0].known, 2, &matcher) == LBEA_OK);
  lbea_rig_matcher_destroy(matcher);
  newer[1].later = 1;
  CHECK(refusal(model, &newer[0].known, 2, "older library") == LBEA_BAD_CONFIG);
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.max_points = 0;
  CHECK(lbea_rig_matcher_create(model, &config, rigs, 2, &matcher) == LBEA_BAD_CONFIG);
  config.struct_size = 1;
  CHECK(lbea_rig_matcher_create(model, &config, rigs, 2, &matcher) == LBEA_BAD_ARGUMENT);
}

static void null_and_wrong_numbers_are_refused(const lbea_model* model, const lbea_rig* rigs,
                                               const lbea_frame frames[2]) {
  lbea_rig_matcher* matcher = rigs_matcher(model, rigs);
  lbea_result result = {.struct_size = sizeof result};
#define REFUSED(call)                                                         \
  do {                                                                        \
    result.status = LBEA_OK;                                                  \
    CHECK((call) == LBEA_BAD_ARGUMENT && result.status == LBEA_BAD_ARGUMENT); \
  } while (0)
  REFUSED(lbea_rig_matcher_match(NULL, frames, 2, &result));
  REFUSED(lbea_rig_matcher_match(matcher, NULL, 2, &result));
  REFUSED(lbea_rig_matcher_match(matcher, frames, 1, &result));
  REFUSED(lbea_rig_matcher_match(matcher, frames, 3, &result));
  REFUSED(lbea_rig_matcher_combine(NULL, &result));
  lbea_frame wrong[2] = {frames[0], frames[1]};
  wrong[1].points = NULL;
  REFUSED(lbea_rig_matcher_match(matcher, wrong, 2, &result));
  wrong[1] = frames[1];
  wrong[1].struct_size = 0;
  REFUSED(lbea_rig_matcher_match(matcher, wrong, 2, &result));
  CHECK(lbea_rig_matcher_match(matcher, frames, 2, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_combine(matcher, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_match_alone(NULL, 0, frames) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_match_alone(matcher, 0, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_match_alone(matcher, 2, frames) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_match_alone(matcher, 0, &wrong[1]) == LBEA_BAD_ARGUMENT);
  /* None of the refused captures has left a frame. */
  CHECK(lbea_rig_matcher_combine(matcher, &result) == LBEA_EMPTY_FRAME);
  lbea_rig_result rig = {.struct_size = sizeof rig};
  CHECK(lbea_rig_matcher_get_rig(NULL, 0, &rig) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_get_rig(matcher, 0, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_rig_matcher_get_rig(matcher, 2, &rig) == LBEA_BAD_ARGUMENT);
  rig.struct_size = 0;
  CHECK(lbea_rig_matcher_get_rig(matcher, 0, &rig) == LBEA_BAD_ARGUMENT);
  lbea_rig_matcher_fix_poses(NULL);
  lbea_rig_matcher_set_impact(NULL, 0);
  lbea_rig_matcher_reset(NULL);
  lbea_rig_matcher_destroy(NULL);
  lbea_test_state state = {.struct_size = sizeof state};
  CHECK(lbea_tracker_update_by_rigs(NULL, matcher, &state) == LBEA_BAD_ARGUMENT);
  lbea_forecast_state end = {.struct_size = sizeof end};
  CHECK(lbea_forecast_update_by_rigs(NULL, matcher, &end) == LBEA_BAD_ARGUMENT);
  lbea_rig_matcher_destroy(matcher);
}

static void one_answer_rests_on_both(const lbea_model* model, const lbea_rig* rigs, lbea_frame frames[2]) {
  lbea_rig_matcher *at_once = rigs_matcher(model, rigs), *in_steps = rigs_matcher(model, rigs);
  lbea_result result = {.struct_size = sizeof result}, same = result;
  CHECK(lbea_rig_matcher_match(at_once, frames, 2, &result) == LBEA_OK);
  CHECK(result.match_count > 0 && result.estimate_count > 0 && result.frame_id == frames[0].id);
  CHECK(result.points_received == frames[0].point_count + frames[1].point_count);
  for (uint32_t rig = 0; rig < 2; ++rig) {
    lbea_rig_result alone = {.struct_size = sizeof alone};
    CHECK(lbea_rig_matcher_get_rig(at_once, rig, &alone) == LBEA_OK);
    CHECK(alone.status == LBEA_OK && alone.is_used == 1 && alone.points_received == frames[rig].point_count);
    CHECK(alone.coverage > 0.25f && alone.residual > 0);
    CHECK(lbea_rig_matcher_match_alone(in_steps, rig, &frames[rig]) == LBEA_OK);
  }
  CHECK(lbea_rig_matcher_combine(in_steps, &same) == LBEA_OK);
  CHECK(same.residual == result.residual && same.misfit == result.misfit && same.coverage == result.coverage);
  CHECK(same.matches[0].sample == result.matches[0].sample);

  frames[1].point_count = 0; /* the second rig has none */
  CHECK(lbea_rig_matcher_match(at_once, frames, 2, &result) == LBEA_OK);
  lbea_rig_result absent = {.struct_size = sizeof absent};
  CHECK(lbea_rig_matcher_get_rig(at_once, 1, &absent) == LBEA_OK);
  CHECK(absent.status == LBEA_EMPTY_FRAME && absent.is_used == 0 && absent.points_received == 0);
  lbea_rig_matcher_destroy(in_steps);
  lbea_rig_matcher_destroy(at_once);
}

void several_rigs_give_one_answer(const char* plates, const char* demo, const char* sensor_json, const char* folder) {
  lbea_model *unseen = opened(plates), *model = opened(demo);
  lbea_rig rigs[2] = {{.struct_size = sizeof rigs[0]}, {.struct_size = sizeof rigs[0]}};
  for (int rig = 0; rig < 2; ++rig) read_pose(sensor_json, rigs[rig].T_reference_sensor);
  lbea_point *points = malloc(most_points * sizeof *points), *split = malloc(most_points * sizeof *points);
  const size_t half = read_cloud(folder, 3, points) / 2;
  for (size_t i = 0; i < 2 * half; ++i) split[i / 2 + (i % 2) * half] = points[i];
  const lbea_frame first = {.struct_size = sizeof first, .id = 3, .points = split, .point_count = half};
  lbea_frame frames[2] = {first, first};
  frames[1].points += half;
  rigs_are_refused_in_words(model, unseen, rigs);
  null_and_wrong_numbers_are_refused(model, rigs, frames);
  one_answer_rests_on_both(model, rigs, frames);
  free(split);
  free(points);
  lbea_model_close(model);
  lbea_model_close(unseen);
}
