/* Quantities of interest. */
#include "tests/c_api/check.h"

#include <lbea/lbea.h>

#include <math.h>
#include <string.h>

void channels_are_given(const char* plates) {
  lbea_model* model = opened(plates);
  CHECK(lbea_model_channel_count(model) == 1);
  CHECK(strcmp(lbea_model_channel_name(model, 0), "free end") == 0);
  CHECK(strcmp(lbea_model_channel_unit(model, 0), "mm") == 0);
  CHECK(lbea_model_channel_name(model, 1) == NULL && lbea_model_channel_unit(model, 1) == NULL);
  CHECK(lbea_model_channel_count(NULL) == 0 && lbea_model_channel_name(NULL, 0) == NULL);
  lbea_matcher* matcher = NULL;
  CHECK(lbea_matcher_create(model, NULL, &matcher) == LBEA_OK);
  const lbea_frame frame = frame_of(model, 9);
  lbea_result result = {.struct_size = sizeof result};
  CHECK(lbea_matcher_match(matcher, &frame, &result) == LBEA_OK);
  CHECK(result.channel_count == 1);
  /* Sample 0 is flat, and node 1020 has index 19. */
  const float* positions = lbea_model_node_positions(model, result.matches[0].sample);
  CHECK(fabsf(result.channels[0].value - positions[3 * 19 + 2]) < 1e-4f);
  CHECK(isnan(result.channels[0].bound_90));
  const lbea_frame empty = {.struct_size = sizeof empty};
  CHECK(lbea_matcher_match(matcher, &empty, &result) == LBEA_EMPTY_FRAME);
  CHECK(result.channel_count == 0);
  lbea_matcher_destroy(matcher);
  lbea_model_close(model);
}
