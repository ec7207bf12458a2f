/* match.c - find the simulation that matches a cloud, in C, without ZeroMQ.
 *   cc match.c $(pkg-config --cflags --libs lbea) -o match && ./match rail.lbea pose.txt fit < cloud.xyz
 * pose.txt has the 12 numbers of T_reference_sensor: jq '.T_reference_sensor[:3][][]' sensor.json > pose.txt */
#include <lbea/lbea.h>

#include <stdio.h>
#include <string.h>

enum { room = 131072 };
static lbea_point points[room];

static const char* const verdicts[] = {"unknown", "matched", "ambiguous", "no_simulation_fits"};

static size_t grab(void) { /* replace by your camera; reads lines of x y z */
  size_t count = 0;
  lbea_point* p = points;
  while (count < room && scanf("%f %f %f", &p->x, &p->y, &p->z) == 3) p = &points[++count];
  return count;
}

static int read_pose(const char* file, float pose[12]) {
  FILE* in = fopen(file, "r");
  int count = 0;
  while (in != NULL && count < 12 && fscanf(in, "%f", &pose[count]) == 1) ++count;
  if (in != NULL) fclose(in);
  return count == 12;
}

int main(int argc, char** argv) {
  lbea_model* model;
  lbea_matcher* matcher;
  lbea_config config;
  lbea_result result = {.struct_size = sizeof result};
  lbea_config_init(&config, sizeof config);
  config.max_points = room;
  if (argc > 2 && !read_pose(argv[2], config.T_reference_sensor))
    return fprintf(stderr, "%s: needs the 12 numbers of T_reference_sensor\n", argv[2]), 1;
  if (argc > 3 && strcmp(argv[3], "fit") == 0) config.method = LBEA_METHOD_FIT; /* without, by lbea: no verdict */
  if (lbea_model_open(argc > 1 ? argv[1] : "rail.lbea", &model) || lbea_matcher_create(model, &config, &matcher))
    return fprintf(stderr, "%s\n", lbea_last_error()), 1;

  lbea_frame frame = {.struct_size = sizeof frame, .id = 1, .points = points, .point_count = grab()};
  const lbea_status status = lbea_matcher_match(matcher, &frame, &result); /* no allocation, no lock, no system call */
  printf("%s, %.0f %% of the surface seen, verdict: %s\n", lbea_status_string(status), 100 * (double)result.coverage,
         verdicts[result.verdict]);
  for (uint32_t i = 0; i < result.match_count; ++i)
    printf("%s at %g s, distance %g\n", lbea_model_simulation_name(model, result.matches[i].simulation),
           result.matches[i].time_s, (double)result.matches[i].distance);

  lbea_matcher_destroy(matcher);
  lbea_model_close(model);
  return status != LBEA_OK;
}
