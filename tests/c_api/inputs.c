/* Reads what the programs of the C++ side wrote. */
#include "tests/c_api/check.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void read_pose(const char* sensor_json, float pose[12]) {
  static char text[20000];
  FILE* in = fopen(sensor_json, "r");
  text[fread(text, 1, sizeof text - 1, in)] = 0;
  fclose(in);
  char* at = strstr(text, "T_reference_sensor");
  for (int i = 0; i < 12 && at != NULL; ++i) {
    at += strcspn(at, "-0123456789");
    pose[i] = strtof(at, &at);
  }
}

size_t read_cloud(const char* folder, int number, lbea_point* points) {
  char text[4000];
  snprintf(text, sizeof text, "%s/frame_%05d.ply", folder, number);
  FILE* in = fopen(text, "rb");
  if (in == NULL) return 0;
  size_t count = 0;
  while (fgets(text, sizeof text, in) != NULL && strcmp(text, "end_header\n") != 0)
    if (strncmp(text, "element vertex ", 15) == 0) count = strtoul(text + 15, NULL, 10);
  CHECK(count > 0 && count <= most_points && fread(points, sizeof *points, count, in) == count);
  fclose(in);
  return count;
}
