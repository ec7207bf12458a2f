/* A program in C that links liblbea-wire and nothing else of ours, for client.sh:
 *   client account|whole FRAMES RESULTS CLOUDS [SERVER_KEY KEY]
 *   client fit FRAMES RESULTS CLOUDS
 *   client rigs LEFT RIGHT RESULTS CLOUDS
 *   client refusals FRAMES RESULTS NOBODY
 *   client keys FRAMES RESULTS SERVER_KEY KEY STRANGE_KEY OTHER_SERVER_KEY
 *   client names FRAMES RESULTS           with keys in "Prüfstand 1.pub" and ".key" of the working directory
 *   client dead FRAMES RESULTS */
#include "tests/wire/c/client.h"

int failures = 0;

lbea_wire_options options_of(const char* server_key_file, const char* key_file) {
  lbea_wire_options options = {0};
  options.struct_size = sizeof options;
  options.patience_ms = patience_ms;
  options.server_key_file = server_key_file;
  options.key_file = key_file;
  return options;
}

lbea_wire_sender* opened_sender(const char* frames, const lbea_wire_options* options) {
  lbea_wire_sender* sender = NULL;
  if (lbea_wire_sender_open(frames, options, &sender) != LBEA_WIRE_OK) printf("%s\n", lbea_wire_last_error());
  CHECK(sender != NULL);
  return sender;
}

lbea_wire_receiver* opened_receiver(const char* results, const lbea_wire_options* options) {
  lbea_wire_receiver* receiver = NULL;
  if (lbea_wire_receiver_open(results, options, &receiver) != LBEA_WIRE_OK) printf("%s\n", lbea_wire_last_error());
  CHECK(receiver != NULL);
  return receiver;
}

int main(int argc, char** argv) {
  const char* test = argc > 3 ? argv[1] : "";
  const int all_whole = strcmp(test, "whole") == 0;
  if ((all_whole || strcmp(test, "account") == 0) && (argc == 5 || argc == 7)) {
    const lbea_wire_options options = options_of(argc == 7 ? argv[5] : NULL, argc == 7 ? argv[6] : NULL);
    every_capture_has_one_result(argv[2], argv[3], argv[4], &options, all_whole);
  } else if (strcmp(test, "fit") == 0 && argc == 5) {
    fit_judges_the_test(argv[2], argv[3], argv[4]);
  } else if (strcmp(test, "rigs") == 0 && argc == 6) {
    rigs_are_matched_together(argv[2], argv[3], argv[4], argv[5]);
  } else if (strcmp(test, "refusals") == 0 && argc == 5) {
    arguments_are_checked(argv[2], argv[3]);
    a_wrong_endpoint_is_named(argv[4]);
  } else if (strcmp(test, "keys") == 0 && argc == 8) {
    wrong_keys_are_refused(argv[2], argv[3], argv[4], argv[5], argv[6], argv[7]);
  } else if (strcmp(test, "names") == 0 && argc == 4) {
    key_files_have_any_name(argv[2], argv[3]);
  } else if (strcmp(test, "dead") == 0 && argc == 4) {
    a_dead_matcher_is_noticed(argv[2], argv[3]);
  } else {
    return 2;
  }
  printf("%s: %s\n", test, failures == 0 ? "as expected" : "failed");
  return failures > 0;
}
