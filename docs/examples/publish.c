/* publish.c - send clouds to a running lbea-serve from C, as a camera does.
 *   cc -std=c99 publish.c $(pkg-config --cflags --libs lbea-wire-c) -o publish
 *   ./publish tcp://127.0.0.1:5555 < cloud.xyz                      without keys
 *   ./publish tcp://matcher:5555 matcher.pub camera.key < cloud.xyz */
#include <lbea/wire.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { most_points = 131072, captures = 10 };

/* Replace by your camera; reads lines of x y z. */
static size_t grab(float* xyz) {
  size_t count = 0;
  while (count < most_points && scanf("%f %f %f", &xyz[3 * count], &xyz[3 * count + 1], &xyz[3 * count + 2]) == 3)
    ++count;
  return count;
}

int main(int argc, char** argv) {
  lbea_wire_options options = {0};
  options.struct_size = sizeof options;
  if (argc > 3) {
    options.server_key_file = argv[2];
    options.key_file = argv[3];
  }
  lbea_wire_sender* sender = NULL; /* waits 5 s for lbea-serve */
  if (lbea_wire_sender_open(argc > 1 ? argv[1] : "tcp://127.0.0.1:5555", &options, &sender) != LBEA_WIRE_OK) {
    fprintf(stderr, "%s\n", lbea_wire_last_error());
    return 1;
  }
  float* xyz = malloc(3 * sizeof(float) * most_points);
  if (xyz == NULL) return 1;
  const size_t count = grab(xyz);
  const int64_t start_ns = (int64_t)time(NULL) * 1000000000;
  for (int i = 0; i < captures; ++i) {
    const int64_t stamp_ns = start_ns + (int64_t)i * 1000000; /* replace by the camera's capture time */
    if (lbea_wire_sender_send(sender, xyz, count, stamp_ns, 100, NULL) != LBEA_WIRE_OK)
      fprintf(stderr, "%s\n", lbea_wire_last_error());
  }
  free(xyz);
  lbea_wire_sender_end_test(sender);
  lbea_wire_tally tally = {0};
  tally.struct_size = sizeof tally;
  const lbea_wire_status closed = lbea_wire_sender_close(sender, &tally);
  printf("sent %" PRIu64 ", refused %" PRIu64 "\n", tally.sent, tally.refused);
  return closed == LBEA_WIRE_OK && tally.refused == 0 ? 0 : 1;
}
