/* Callers compiled with newer or wrong headers: struct_size decides what is read and written. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* As a later version might look. */
struct newer_info {
  lbea_model_info known;
  uint64_t later;
};
struct newer_config {
  lbea_config known;
  float later;
};
struct newer_frame {
  lbea_frame known;
  const float* later;
};
struct newer_result {
  lbea_result known;
  double later;
};

static void sizes_are_judged(const lbea_model* model) {
  const uint32_t wrong[] = {0, 4, (uint32_t)sizeof(lbea_field_info) - 1, 5000, 0xcccccccc};
  for (size_t i = 0; i < sizeof wrong / sizeof *wrong; ++i) {
    lbea_model_info info = {.struct_size = wrong[i]};
    CHECK(lbea_model_get_info(model, &info) == LBEA_BAD_ARGUMENT);
    CHECK(info.struct_size == wrong[i] && info.vertices == 0);
    lbea_config config;
    memset(&config, 0x55, sizeof config);
    CHECK(lbea_config_init(&config, wrong[i]) == LBEA_BAD_ARGUMENT);
    CHECK(lbea_config_init(&config, (size_t)wrong[i] << 32) == LBEA_BAD_ARGUMENT);
    CHECK(config.max_points == 0x55555555);
  }
}

static void what_the_library_does_not_know_is_zero(const lbea_model* model) {
  struct newer_info info = {.known = {.struct_size = sizeof info}, .later = 77};
  CHECK(lbea_model_get_info(model, &info.known) == LBEA_OK);
  CHECK(info.later == 0 && info.known.vertices > 0 && info.known.struct_size == sizeof info);
  struct newer_config config;
  memset(&config, 0x55, sizeof config);
  CHECK(lbea_config_init(&config.known, sizeof config) == LBEA_OK);
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, &config.known, &matcher) == LBEA_OK);
  struct newer_result result = {.known = {.struct_size = sizeof result}, .later = 77};
  struct newer_frame frame = {.known = {.struct_size = sizeof frame}};
  CHECK(lbea_matcher_match(matcher, &frame.known, &result.known) == LBEA_EMPTY_FRAME);
  CHECK(result.later == 0 && result.known.struct_size == sizeof result);
  lbea_test_history* history = NULL;
  CHECK(lbea_test_history_create(model, &history) == LBEA_OK);
  result.later = 77;
  CHECK(lbea_matcher_match_with_history(matcher, &frame.known, history, &result.known) == LBEA_EMPTY_FRAME);
  CHECK(result.later == 0);
  lbea_test_history_destroy(history);
  frame.later = &config.later;
  CHECK(lbea_matcher_match(matcher, &frame.known, &result.known) == LBEA_BAD_ARGUMENT);
  frame.known.struct_size = 1;
  CHECK(lbea_matcher_match(matcher, &frame.known, &result.known) == LBEA_BAD_ARGUMENT);
  result.known.struct_size = 1;
  CHECK(lbea_matcher_match(matcher, &frame.known, &result.known) == LBEA_BAD_ARGUMENT);
  lbea_matcher_destroy(matcher);
  config.later = 1;
  CHECK(lbea_matcher_create(model, &config.known, &matcher) == LBEA_BAD_CONFIG);
  CHECK(strstr(lbea_last_error(), "older library") != NULL);
}

/* As in the version before the pose was estimated. */
static void what_the_caller_does_not_know_is_not_written(const lbea_model* model) {
  lbea_matcher* matcher = NULL;
  lbea_test_history* history = NULL;
  CHECK(lbea_matcher_create(model, NULL, &matcher) == LBEA_OK && lbea_test_history_create(model, &history) == LBEA_OK);
  const lbea_frame frame = {.struct_size = sizeof frame};
  lbea_result result = {.struct_size = offsetof(lbea_result, pose_turn), .pose_turn = 77, .pose_shift = 78};
  CHECK(lbea_matcher_match_with_history(matcher, &frame, history, &result) == LBEA_EMPTY_FRAME);
  CHECK(result.pose_turn == 77 && result.pose_shift == 78 && result.struct_size == offsetof(lbea_result, pose_turn));
  lbea_test_history_destroy(history);
  lbea_matcher_destroy(matcher);
}

static void an_image_in_memory_is_read_in_place(const char* file, const lbea_model* model) {
  FILE* in = fopen(file, "rb");
  fseek(in, 0, SEEK_END);
  const size_t size = (size_t)ftell(in), room = (size + 127) / 64 * 64;
  rewind(in);
  char* const memory = malloc(room + 64);
  char* const image = memory + 64 - (uintptr_t)memory % 64;
  CHECK(fread(image, 1, size, in) == size);
  fclose(in);
  lbea_model* viewed = NULL;
  CHECK(lbea_model_open_memory(image, size, &viewed) == LBEA_OK);
  lbea_model_info mapped_info = {.struct_size = sizeof mapped_info}, viewed_info = mapped_info;
  CHECK(lbea_model_get_info(model, &mapped_info) == LBEA_OK && lbea_model_get_info(viewed, &viewed_info) == LBEA_OK);
  CHECK(viewed_info.checksum == mapped_info.checksum && viewed_info.samples == mapped_info.samples);
  const char* positions = (const char*)lbea_model_node_positions(viewed, 0);
  CHECK(positions > image && positions < image + size);
  lbea_model_close(viewed);
  CHECK(lbea_model_open_memory(image, size - 1, &viewed) == LBEA_CORRUPT_MODEL);
  memmove(image + 4, image, size);
  CHECK(lbea_model_open_memory(image + 4, size, &viewed) == LBEA_BAD_CONFIG);
  free(memory);
}

void structs_grow(const char* model_file) {
  lbea_model* model = NULL;
  if (lbea_model_open(model_file, &model) != LBEA_OK) exit(1);
  sizes_are_judged(model);
  what_the_library_does_not_know_is_zero(model);
  what_the_caller_does_not_know_is_not_written(model);
  an_image_in_memory_is_read_in_place(model_file, model);
  lbea_model_close(model);
}
