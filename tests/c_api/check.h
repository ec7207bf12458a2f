/* Checks that count what failed, for tests in C. */
#ifndef LBEA_TESTS_CHECK_H
#define LBEA_TESTS_CHECK_H

#include <lbea/lbea.h>

#include <stdio.h>

extern int failures;

#define CHECK(condition)                                                    \
  do {                                                                      \
    if (!(condition)) {                                                     \
      printf("%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                           \
    }                                                                       \
  } while (0)

/* inputs.c */
enum { most_points = 131072 };
/* The twelve numbers after "T_reference_sensor", whatever the brackets. */
void read_pose(const char* sensor_json, float pose[12]);
/* The points of a binary PLY file whose vertices are x, y, z as float; 0 when the folder has no such frame. */
size_t read_cloud(const char* folder, int number, lbea_point* points);

/* test_c_api.c */
lbea_model* opened(const char* file);
lbea_model_info info_of(const lbea_model* model);
lbea_frame frame_of(const lbea_model* model, uint32_t sample); /* its nodes, in reference coordinates */

/* test_c_channels.c */
void channels_are_given(const char* plates);

void structs_grow(const char* model_file); /* test_c_structs.c */

/* test_c_fit.c */
void depth_images_decide(const char* model_file, const char* sensor_json, const char* frames);

/* test_c_forecast.c */
void the_end_is_forecast(const char* plates, const char* demo, const char* sensor_json, const char* frames);

/* test_c_history.c */
enum { frame_count = 4 }; /* states 0, 4, 8, 12 of a run that is not in the model */
void pose_errors_are_corrected(const char* plates, const char* demo, const char* sensor_json, const char* frames);

/* test_c_rigs.c */
void several_rigs_give_one_answer(const char* plates, const char* demo, const char* sensor_json, const char* frames);

#endif
