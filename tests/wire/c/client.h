/* What the files of the C client share. */
#ifndef LBEA_TESTS_WIRE_CLIENT_H
#define LBEA_TESTS_WIRE_CLIENT_H

#include "tests/c_api/check.h"

#include <lbea/wire.h>

#include <string.h>

/* The last error contains the words. */
#define CHECK_SENTENCE(words)                                                                    \
  do {                                                                                           \
    if (strstr(lbea_wire_last_error(), words) == NULL) {                                         \
      printf("%s:%d: \"%s\" lacks \"%s\"\n", __FILE__, __LINE__, lbea_wire_last_error(), words); \
      ++failures;                                                                                \
    }                                                                                            \
  } while (0)

enum { patience_ms = 60000 }; /* for what must happen, also on a loaded machine */

/* Keys: NULL for none. */
lbea_wire_options options_of(const char* server_key_file, const char* key_file);
lbea_wire_sender* opened_sender(const char* frames, const lbea_wire_options* options);
lbea_wire_receiver* opened_receiver(const char* results, const lbea_wire_options* options);

/* account.c */
/* all_whole: 0: some captures cannot be matched or sent. */
void every_capture_has_one_result(const char* frames, const char* results, const char* clouds,
                                  const lbea_wire_options* options, int all_whole);

void fit_judges_the_test(const char* frames, const char* results, const char* clouds);

void rigs_are_matched_together(const char* left, const char* right, const char* results, const char* clouds);

/* refusals.c */
void arguments_are_checked(const char* frames, const char* results);
void a_wrong_endpoint_is_named(const char* nobody);
void wrong_keys_are_refused(const char* frames, const char* results, const char* server_key_file, const char* key_file,
                            const char* strange_key_file, const char* other_server_key_file);
void key_files_have_any_name(const char* frames, const char* results);
void a_dead_matcher_is_noticed(const char* frames, const char* results);

#endif
