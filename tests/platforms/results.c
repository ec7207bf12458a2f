/* results MODEL SENSOR_JSON FRAMES: every number of the results of a test's frames, by every method, floats with all
 * their bits. Machines that compute the same bits print the same text. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int failures = 0;

static void print_matches(const char* name, const lbea_match* matches, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i)
    printf("%s %u %u %u %a %a\n", name, (unsigned)matches[i].simulation, (unsigned)matches[i].time_step,
           (unsigned)matches[i].sample, (double)matches[i].distance, matches[i].time_s);
}

static void print_floats(const char* name, const float* numbers, uint32_t count) {
  printf("%s", name);
  for (uint32_t i = 0; i < count; ++i) printf(" %a", (double)numbers[i]);
  printf("\n");
}

static void print_result(const lbea_result* result) {
  printf("frame %u: %s, verdict %d, reference %u, points %u %u %u %u\n", (unsigned)result->frame_id,
         lbea_status_string(result->status), (int)result->verdict, (unsigned)result->reference,
         (unsigned)result->points_received, (unsigned)result->points_invalid, (unsigned)result->points_culled,
         (unsigned)result->points_used);
#define PRINT(name) print_floats(#name, &result->name, 1);
  LBEA_FRAME_NUMBERS(PRINT)
  LBEA_FIT_NUMBERS(PRINT)
  print_floats("leading coordinates", result->leading_coordinates, 3);
  print_floats("coefficients", result->coefficients, result->coefficient_count);
  print_matches("match", result->matches, result->match_count);
  print_matches("candidate", result->candidates, result->candidate_count);
  for (uint32_t i = 0; i < result->estimate_count; ++i)
    printf("estimate %u %a\n", (unsigned)result->estimate[i].sample, (double)result->estimate[i].weight);
}

static void print_state(const lbea_test_state* state) {
  printf("test: sample %u, frames %u, simulation %u, verdict %d\n", (unsigned)state->sample, (unsigned)state->frames,
         (unsigned)state->simulation, (int)state->verdict);
  print_floats("test misfit", &state->misfit, 1);
  print_floats("sample probability", &state->sample_probability, 1);
  print_floats("probabilities", state->simulation_probabilities, state->simulation_count);
}

static void print_pose(const lbea_test_history* history) {
  float T[12];
  CHECK(lbea_test_history_get_pose_correction(history, T) == LBEA_OK);
  print_floats("pose correction", T, 12);
}

/* Matches all frames of the folder, as those of one test. */
static void print_test(const lbea_model* model, lbea_method method, int with_history, const char* sensor_json,
                       const char* frames) {
  printf("\nmethod %d%s\n", (int)method, with_history ? " with history" : "");
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.method = (int32_t)method;
  read_pose(sensor_json, config.T_reference_sensor);
  lbea_matcher* matcher = NULL;
  lbea_test_history* history = NULL;
  lbea_tracker* tracker = NULL;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  CHECK(lbea_test_history_create(model, &history) == LBEA_OK);
  CHECK(lbea_tracker_create(model, &tracker) == LBEA_OK);
  lbea_point* points = malloc(most_points * sizeof *points);
  lbea_frame frame = {.struct_size = sizeof frame, .points = points};
  while ((frame.point_count = read_cloud(frames, (int)frame.id, points)) > 0) {
    frame.stamp_ns = (int64_t)frame.id * 2000000;
    lbea_result result = {.struct_size = sizeof result};
    lbea_test_state state = {.struct_size = sizeof state};
    CHECK((with_history ? lbea_matcher_match_with_history(matcher, &frame, history, &result)
                        : lbea_matcher_match(matcher, &frame, &result)) == LBEA_OK);
    CHECK(lbea_tracker_update(tracker, matcher, &state) == LBEA_OK);
    print_result(&result);
    print_state(&state);
    if (with_history) print_pose(history);
    ++frame.id;
  }
  CHECK(frame.id > 0);
  free(points);
  lbea_tracker_destroy(tracker);
  lbea_test_history_destroy(history);
  lbea_matcher_destroy(matcher);
}

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  lbea_model* model = NULL;
  CHECK(lbea_model_open(argv[1], &model) == LBEA_OK);
  if (model == NULL) {
    printf("%s\n", lbea_last_error());
    return 1;
  }
  print_test(model, LBEA_METHOD_LBEA, 0, argv[2], argv[3]);
  print_test(model, LBEA_METHOD_VTP, 0, argv[2], argv[3]);
  print_test(model, LBEA_METHOD_FIT, 0, argv[2], argv[3]);
  print_test(model, LBEA_METHOD_FIT, 1, argv[2], argv[3]);
  lbea_model_close(model);
  return failures > 0;
}
