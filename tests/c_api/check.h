/* Checks that count what failed, for tests in C. */
#ifndef LBEA_TESTS_CHECK_H
#define LBEA_TESTS_CHECK_H

#include <stdio.h>

extern int failures;

#define CHECK(condition)                                                    \
  do {                                                                      \
    if (!(condition)) {                                                     \
      printf("%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      ++failures;                                                           \
    }                                                                       \
  } while (0)

void structs_grow(const char* model_file);                                 /* test_c_structs.c */
void depth_images_decide(const char* model_file, const char* sensor_json); /* test_c_fit.c */

#endif
