/* subscribe.c - print the results of a running lbea-serve from C, until the test ends or nothing arrives for 10 s.
 *   cc -std=c99 subscribe.c $(pkg-config --cflags --libs lbea-wire-c) -o subscribe
 *   ./subscribe tcp://127.0.0.1:5556                                without keys
 *   ./subscribe tcp://matcher:5556 matcher.pub viewer.key */
#include <lbea/wire.h>

#include <inttypes.h>
#include <stdio.h>

static void print_result(const lbea_wire_result* result) {
  printf("%" PRIu64 " %s %s", result->frame_id, lbea_wire_frame_status_string(result->status),
         lbea_wire_verdict_string(result->verdict));
  if (result->match_count > 0) printf(" %s %g s", result->matches[0].simulation_name, result->matches[0].time_s);
  printf("\n");
  fflush(stdout);
}

int main(int argc, char** argv) {
  lbea_wire_options options = {0};
  options.struct_size = sizeof options;
  if (argc > 3) {
    options.server_key_file = argv[2];
    options.key_file = argv[3];
  }
  lbea_wire_receiver* receiver = NULL; /* waits 5 s for lbea-serve */
  if (lbea_wire_receiver_open(argc > 1 ? argv[1] : "tcp://127.0.0.1:5556", &options, &receiver) != LBEA_WIRE_OK) {
    fprintf(stderr, "%s\n", lbea_wire_last_error());
    return 1;
  }
  lbea_wire_result result = {0};
  result.struct_size = sizeof result;
  while (lbea_wire_receiver_receive(receiver, 10000, &result) == LBEA_WIRE_OK) print_result(&result);
  lbea_wire_account account = {0};
  account.struct_size = sizeof account;
  lbea_wire_receiver_get_account(receiver, &account);
  fprintf(stderr,
          "captured %" PRIu64 ", matched %" PRIu64 ", rejected %" PRIu64 ", dropped %" PRIu64 "; lost %" PRIu64 "\n",
          account.captured, account.matched, account.rejected, account.dropped, account.lost);
  lbea_wire_receiver_close(receiver);
  return account.lost == 0 ? 0 : 1;
}
