/* The C interface from C, against the shared library: test_c_api PLATES DEMO SENSOR_JSON FRAMES */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int failures = 0;

lbea_model* opened(const char* file) {
  lbea_model* model = NULL;
  CHECK(lbea_model_open(file, &model) == LBEA_OK);
  if (model == NULL) {
    printf("%s\n", lbea_last_error());
    exit(1);
  }
  return model;
}

lbea_model_info info_of(const lbea_model* model) {
  lbea_model_info info = {.struct_size = sizeof info};
  CHECK(lbea_model_get_info(model, &info) == LBEA_OK);
  CHECK(info.struct_size == sizeof info);
  return info;
}

static void library_introduces_itself(void) {
  CHECK(lbea_version() == LBEA_VERSION);
  CHECK(strstr(lbea_build_info(), LBEA_VERSION_STRING) != NULL);
  CHECK(strstr(lbea_build_info(), "commit ") != NULL);
}

static void every_status_has_a_name_of_its_own(void) {
  const lbea_status all[] = {LBEA_OK,
                             LBEA_EMPTY_FRAME,
                             LBEA_TOO_MANY_POINTS,
                             LBEA_LOW_COVERAGE,
                             LBEA_FILE_NOT_FOUND,
                             LBEA_NOT_A_MODEL,
                             LBEA_UNSUPPORTED_VERSION,
                             LBEA_CORRUPT_MODEL,
                             LBEA_BAD_CONFIG,
                             LBEA_BAD_ARGUMENT,
                             LBEA_OUT_OF_MEMORY,
                             LBEA_INTERNAL_ERROR};
  const size_t count = sizeof all / sizeof *all;
  for (size_t i = 0; i < count; ++i) {
    CHECK(strcmp(lbea_status_string(all[i]), "unknown_status") != 0);
    for (size_t j = 0; j < i; ++j) CHECK(strcmp(lbea_status_string(all[i]), lbea_status_string(all[j])) != 0);
  }
  CHECK(strcmp(lbea_status_string((lbea_status)7), "unknown_status") == 0);
  CHECK(strcmp(lbea_status_string(LBEA_STATUS_MAX_), "unknown_status") == 0);
}

static void null_is_refused_everywhere(const lbea_model* model) {
  lbea_model* opened_model = (lbea_model*)&failures;
  lbea_matcher* matcher = (lbea_matcher*)&failures;
  lbea_model_info info = {.struct_size = sizeof info};
  lbea_field_info field = {.struct_size = sizeof field};
  lbea_result result = {.struct_size = sizeof result};
  lbea_frame frame = {.struct_size = sizeof frame};
  CHECK(lbea_model_open(NULL, &opened_model) == LBEA_BAD_ARGUMENT);
  CHECK(opened_model == NULL);
  CHECK(lbea_model_open("x", NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_open_memory(NULL, 64, &opened_model) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_open_memory(&frame, sizeof frame, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_get_info(NULL, &info) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_get_info(model, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_get_field(NULL, 0, &field) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_get_field(model, 0, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_simulation_name(NULL, 0) == NULL);
  CHECK(lbea_model_node_positions(NULL, 0) == NULL);
  CHECK(lbea_model_field_values(NULL, 0, 0) == NULL);
  CHECK(lbea_config_init(NULL, sizeof(lbea_config)) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_matcher_create(NULL, NULL, &matcher) == LBEA_BAD_ARGUMENT);
  CHECK(matcher == NULL);
  CHECK(lbea_matcher_create(model, NULL, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_matcher_match(NULL, &frame, &result) == LBEA_BAD_ARGUMENT);
  lbea_tracker* tracker = (lbea_tracker*)&failures;
  lbea_test_state state = {.struct_size = sizeof state};
  CHECK(lbea_tracker_create(NULL, &tracker) == LBEA_BAD_ARGUMENT);
  CHECK(tracker == NULL);
  CHECK(lbea_tracker_create(model, NULL) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_tracker_update(NULL, NULL, &state) == LBEA_BAD_ARGUMENT);
  CHECK(result.status == LBEA_BAD_ARGUMENT);
  CHECK(strstr(lbea_last_error(), "NULL") != NULL);
  lbea_model_close(NULL);
  lbea_matcher_destroy(NULL);
  lbea_tracker_destroy(NULL);
}

static void* error_of_another_thread(void* text) {
  *(size_t*)text = strlen(lbea_last_error());
  return NULL;
}

static void failures_are_explained_per_thread(const char* file) {
  lbea_model* model = NULL;
  CHECK(lbea_model_open("/no/such/model.lbea", &model) == LBEA_FILE_NOT_FOUND);
  CHECK(model == NULL);
  CHECK(strstr(lbea_last_error(), "/no/such/model.lbea") != NULL);
  CHECK(lbea_model_open(__FILE__, &model) == LBEA_NOT_A_MODEL);
  size_t length = 99;
  pthread_t thread;
  CHECK(pthread_create(&thread, NULL, error_of_another_thread, &length) == 0);
  pthread_join(thread, NULL);
  CHECK(length == 0);
  char path[3000];
  memset(path, 'x', sizeof path - 1);
  path[sizeof path - 1] = 0;
  CHECK(lbea_model_open(path, &model) != LBEA_OK);
  CHECK(strlen(lbea_last_error()) == 1023);
  lbea_model_close(opened(file));
  CHECK(strlen(lbea_last_error()) == 1023); /* success does not touch it */
}

static void model_tells_what_it_holds(const lbea_model* model) {
  const lbea_model_info info = info_of(model);
  CHECK(info.simulations == 4 && info.samples == 24 && info.references == 1);
  CHECK(info.nodes == 200 && info.elements == 171 && info.vertices == 200 && info.modes == 20);
  CHECK(strcmp(info.length_unit, "mm") == 0);
  CHECK(strcmp(lbea_model_simulation_name(model, 3), "plate_3") == 0);
  CHECK(lbea_model_simulation_name(model, 4) == NULL);
  CHECK(lbea_model_node_positions(model, info.samples - 1) != NULL);
  CHECK(lbea_model_node_positions(model, info.samples) == NULL);
  lbea_field_info field = {.struct_size = sizeof field};
  CHECK(lbea_model_get_field(model, info.fields, &field) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_field_values(model, info.fields, 0) == NULL);
  for (uint32_t f = 0; f < info.fields; ++f) {
    CHECK(lbea_model_get_field(model, f, &field) == LBEA_OK);
    CHECK(strlen(field.name) > 0 && field.unit != NULL);
    CHECK(field.values_per_sample == info.elements || field.values_per_sample == info.nodes);
    CHECK(isfinite(lbea_model_field_values(model, f, info.samples - 1)[field.values_per_sample - 1]));
    CHECK(field.largest_error == 0);
    CHECK(lbea_model_field_values(model, f, info.samples) == NULL);
  }
}

static void fields_in_16_bits_are_read(const lbea_model* model, const char* file) {
  char name[4000];
  snprintf(name, sizeof name, "%s.compact", file);
  lbea_model* compact = opened(name);
  lbea_field_info field = {.struct_size = sizeof field};
  CHECK(lbea_model_get_field(compact, 0, &field) == LBEA_OK);
  CHECK(field.largest_error > 0);
  CHECK(lbea_model_field_values(compact, 0, 23) == NULL);
  float values[200];
  const size_t room = sizeof values / sizeof *values;
  CHECK(lbea_model_read_field(compact, 0, 23, values, room) == LBEA_OK);
  const float* exact = lbea_model_field_values(model, 0, 23);
  for (uint32_t i = 0; i < field.values_per_sample; ++i) CHECK(fabsf(values[i] - exact[i]) <= field.largest_error);
  CHECK(lbea_model_read_field(model, 0, 23, values, room) == LBEA_OK);
  CHECK(memcmp(values, exact, field.values_per_sample * sizeof *values) == 0);
  CHECK(lbea_model_read_field(compact, 0, 23, values, field.values_per_sample - 1) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_read_field(compact, 1, 23, values, room) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_read_field(compact, 0, 24, values, room) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_read_field(compact, 0, 23, NULL, room) == LBEA_BAD_ARGUMENT);
  CHECK(lbea_model_read_field(NULL, 0, 23, values, room) == LBEA_BAD_ARGUMENT);
  lbea_model_close(compact);
}

static void bad_configurations_are_refused(const lbea_model* model) {
  lbea_matcher* matcher = NULL;
  lbea_config config;
  CHECK(lbea_config_init(&config, sizeof config) == LBEA_OK);
  config.T_reference_sensor[0] = -1;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_BAD_CONFIG);
  CHECK(matcher == NULL);
  CHECK(strstr(lbea_last_error(), "T_reference_sensor") != NULL);
  lbea_config_init(&config, sizeof config);
  config.method = 99;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_BAD_CONFIG);
  config.struct_size = 0;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_BAD_ARGUMENT);
}

lbea_frame frame_of(const lbea_model* model, uint32_t sample) {
  return (lbea_frame){.struct_size = sizeof(lbea_frame),
                      .id = sample,
                      .stamp_ns = 7,
                      .points = (const lbea_point*)lbea_model_node_positions(model, sample),
                      .point_count = info_of(model).nodes};
}

static int same_shape(const lbea_model* model, uint32_t a, uint32_t b) {
  const float *p = lbea_model_node_positions(model, a), *q = lbea_model_node_positions(model, b);
  for (uint32_t i = 0; i < 3 * info_of(model).nodes; ++i)
    if (fabsf(p[i] - q[i]) > 1e-3f) return 0;
  return 1;
}

static void every_sample_finds_itself(lbea_model* model, lbea_method method) {
  const lbea_model_info info = info_of(model);
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.max_matches = 3;
  config.method = (int32_t)method;
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  lbea_result result = {.struct_size = sizeof result};
  for (uint32_t sample = 0; sample < info.samples; ++sample) {
    const lbea_frame frame = frame_of(model, sample);
    CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_OK);
    CHECK(result.status == LBEA_OK && result.struct_size == sizeof result);
    CHECK(result.frame_id == sample && result.stamp_ns == 7);
    CHECK(result.match_count == 3 && result.coefficient_count == 3 * info.modes);
    CHECK(same_shape(model, result.matches[0].sample, sample));
    CHECK(result.matches[0].sample == 6 * result.matches[0].simulation + result.matches[0].time_step);
    CHECK(result.matches[0].distance <= result.matches[1].distance);
    CHECK(result.matches[0].time_s >= 0);
    CHECK(isfinite(result.leading_coordinates[0]) && isfinite(result.leading_coordinates[2]));
    CHECK(result.verdict == LBEA_VERDICT_UNKNOWN && result.candidate_count == 0 && isnan(result.residual));
    CHECK(result.coverage > 0.99f && result.points_used == info.nodes && result.points_received == info.nodes);
  }
  lbea_matcher_destroy(matcher);
}

static void a_test_is_followed(lbea_model* model, const char* other_file) {
  const lbea_model_info info = info_of(model);
  const uint32_t run = 2, steps = info.samples / info.simulations;
  lbea_matcher* matcher = NULL;
  lbea_tracker* tracker = NULL;
  CHECK(lbea_matcher_create(model, NULL, &matcher) == LBEA_OK && lbea_tracker_create(model, &tracker) == LBEA_OK);
  lbea_test_state state = {.struct_size = sizeof state};
  CHECK(lbea_tracker_update(tracker, matcher, &state) == LBEA_OK);
  CHECK(state.frames == 0);
  lbea_result result = {.struct_size = sizeof result};
  for (uint32_t step = 0; step < steps; ++step) {
    const lbea_frame frame = frame_of(model, run * steps + step);
    CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_OK);
    CHECK(lbea_tracker_update(tracker, matcher, &state) == LBEA_OK);
  }
  float sum = 0;
  for (uint32_t s = 0; s < state.simulation_count; ++s) sum += state.simulation_probabilities[s];
  CHECK(state.frames == steps && state.simulation_count == info.simulations);
  CHECK(state.simulation == run && state.sample == run * steps + steps - 1);
  CHECK(fabsf(sum - 1) < 1e-3f && state.sample_probability > 0.5f);
  lbea_model* other = opened(other_file);
  lbea_matcher* stranger = NULL;
  CHECK(lbea_matcher_create(other, NULL, &stranger) == LBEA_OK);
  CHECK(lbea_tracker_update(tracker, stranger, &state) == LBEA_BAD_ARGUMENT);
  lbea_matcher_destroy(stranger);
  lbea_model_close(other);
  lbea_tracker_destroy(tracker);
  lbea_matcher_destroy(matcher);
}

static void frames_are_refused_in_words(const lbea_model* model) {
  lbea_config config;
  lbea_config_init(&config, sizeof config);
  config.max_points = 300;
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, &config, &matcher) == LBEA_OK);
  lbea_result result = {.struct_size = sizeof result};
  lbea_frame frame = {.struct_size = sizeof frame, .id = 5};
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_EMPTY_FRAME);
  CHECK(result.match_count == 0 && result.frame_id == 5);
  frame.point_count = 10;
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_BAD_ARGUMENT);
  static lbea_point points[301];
  for (int i = 0; i < 301; ++i) points[i].y = NAN;
  frame.points = points;
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_EMPTY_FRAME);
  CHECK(result.points_invalid == 10 && result.points_used == 0);
  frame.point_count = 301;
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_TOO_MANY_POINTS);
  frame = frame_of(model, 9);
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_OK);
  lbea_matcher_destroy(matcher);
}

static void matchers_outlive_their_model(const char* file) {
  lbea_model *model = opened(file), *points = opened(file);
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, NULL, &matcher) == LBEA_OK);
  lbea_model_close(model);
  lbea_result result = {.struct_size = sizeof result};
  const lbea_frame frame = frame_of(points, 9);
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_OK);
  CHECK(result.matches[0].sample == 9);
  lbea_matcher_destroy(matcher);
  lbea_model_close(points);
}

int main(int argc, char** argv) {
  if (argc != 5) return 2;
  lbea_model* model = opened(argv[1]);
  library_introduces_itself();
  every_status_has_a_name_of_its_own();
  null_is_refused_everywhere(model);
  failures_are_explained_per_thread(argv[1]);
  model_tells_what_it_holds(model);
  fields_in_16_bits_are_read(model, argv[1]);
  bad_configurations_are_refused(model);
  every_sample_finds_itself(model, LBEA_METHOD_LBEA);
  every_sample_finds_itself(model, LBEA_METHOD_VTP);
  frames_are_refused_in_words(model);
  a_test_is_followed(model, argv[2]);
  depth_images_decide(argv[2], argv[3], argv[4]);
  the_end_is_forecast(argv[1], argv[2], argv[3], argv[4]);
  pose_errors_are_corrected(argv[1], argv[2], argv[3], argv[4]);
  several_rigs_give_one_answer(argv[1], argv[2], argv[3], argv[4]);
  lbea_model_close(model);
  matchers_outlive_their_model(argv[1]);
  channels_are_given(argv[1]);
  structs_grow(argv[1]);
  printf("%d checks failed\n", failures);
  return failures != 0;
}
