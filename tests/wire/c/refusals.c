/* What cannot work: each time a status and a sentence. */
#include "tests/wire/c/client.h"

static const float point[3] = {1, 2, 3};
static const int64_t stamp_ns = 1700000000000000000;
static const size_t beyond_a_message = 200000000;

static void null_is_refused(lbea_wire_sender* sender, lbea_wire_receiver* receiver, const char* frames) {
  lbea_wire_sender* no_sender = sender;
  lbea_wire_receiver* no_receiver = receiver;
  CHECK(lbea_wire_sender_open(NULL, NULL, &no_sender) == LBEA_WIRE_BAD_ARGUMENT && no_sender == NULL);
  CHECK(lbea_wire_receiver_open(NULL, NULL, &no_receiver) == LBEA_WIRE_BAD_ARGUMENT && no_receiver == NULL);
  CHECK(lbea_wire_sender_open(frames, NULL, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_open(frames, NULL, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_sender_send(NULL, point, 1, stamp_ns, 0, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_sender_send(sender, NULL, 1, stamp_ns, 0, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK_SENTENCE("xyz is NULL");
  CHECK(lbea_wire_sender_withhold(NULL, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_sender_end_test(NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_sender_get_tally(sender, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_sender_close(NULL, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_receive(receiver, 0, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_receive(NULL, 0, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_get_test(receiver, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_get_account(receiver, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_get_receipt(receiver, 0, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_get_matcher(receiver, NULL) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK(lbea_wire_receiver_simulation_name(NULL, 0) == NULL);
  lbea_wire_receiver_close(NULL);
}

static void sizes_are_checked(lbea_wire_sender* sender, lbea_wire_receiver* receiver, const char* frames) {
  lbea_wire_tally tally = {0};
  CHECK(lbea_wire_sender_get_tally(sender, &tally) == LBEA_WIRE_BAD_ARGUMENT);
  CHECK_SENTENCE("struct_size");
  lbea_wire_result result = {0};
  CHECK(lbea_wire_receiver_receive(receiver, 0, &result) == LBEA_WIRE_BAD_ARGUMENT);
  lbea_wire_options options = {0};
  lbea_wire_sender* none = NULL;
  CHECK(lbea_wire_sender_open(frames, &options, &none) == LBEA_WIRE_BAD_ARGUMENT && none == NULL);

  /* A caller that was compiled with a later version. */
  struct {
    lbea_wire_tally known;
    uint64_t later;
  } larger = {{0}, 7};
  larger.known.struct_size = sizeof larger;
  CHECK(lbea_wire_sender_get_tally(sender, &larger.known) == LBEA_WIRE_OK && larger.later == 0);
  struct {
    lbea_wire_options known;
    uint64_t later;
  } asked = {{0}, 7};
  asked.known.struct_size = sizeof asked;
  CHECK(lbea_wire_sender_open(frames, &asked.known, &none) == LBEA_WIRE_BAD_CONFIG && none == NULL);
  CHECK_SENTENCE("older library");
}

static void options_are_checked(const char* frames) {
  lbea_wire_sender* none = NULL;
  lbea_wire_options options = options_of(NULL, "camera.key");
  CHECK(lbea_wire_sender_open(frames, &options, &none) == LBEA_WIRE_BAD_CONFIG && none == NULL);
  CHECK_SENTENCE("server_key_file");
  options = options_of("no/such.pub", NULL);
  CHECK(lbea_wire_sender_open(frames, &options, &none) == LBEA_WIRE_BAD_CONFIG);
  CHECK_SENTENCE("no/such.pub");
  options = options_of("no-utf8-\xff.pub", NULL);
  CHECK(lbea_wire_sender_open(frames, &options, &none) == LBEA_WIRE_BAD_CONFIG && none == NULL);
  CHECK_SENTENCE("no-utf8-\xff.pub: ");
  options = options_of("", "camera.key"); /* was a connection without keys */
  CHECK(lbea_wire_sender_open(frames, &options, &none) == LBEA_WIRE_BAD_CONFIG);
  CHECK_SENTENCE("is empty");
  options = options_of(NULL, NULL);
  options.queued_messages = 2000000;
  CHECK(lbea_wire_sender_open(frames, &options, &none) == LBEA_WIRE_BAD_CONFIG);
  CHECK_SENTENCE("2000000");
}

void arguments_are_checked(const char* frames, const char* results) {
  lbea_wire_receiver* receiver = opened_receiver(results, NULL);
  lbea_wire_sender* sender = opened_sender(frames, NULL);
  if (sender == NULL || receiver == NULL) return;
  null_is_refused(sender, receiver, frames);
  sizes_are_checked(sender, receiver, frames);
  options_are_checked(frames);

  lbea_wire_result result = {0};
  result.struct_size = sizeof result;
  result.match_count = 7;
  CHECK(lbea_wire_receiver_receive(receiver, 50, &result) == LBEA_WIRE_TIMEOUT && result.match_count == 0);
  CHECK_SENTENCE("no result within 50 ms");
  lbea_wire_test test = {0};
  test.struct_size = sizeof test;
  CHECK(lbea_wire_receiver_get_test(receiver, &test) == LBEA_WIRE_UNKNOWN);
  lbea_wire_receipt receipt = {0};
  receipt.struct_size = sizeof receipt;
  CHECK(lbea_wire_receiver_get_receipt(receiver, 12345, &receipt) == LBEA_WIRE_UNKNOWN);

  /* The count is refused before the points are read. */
  uint64_t id = 7;
  CHECK(lbea_wire_sender_send(sender, point, beyond_a_message, stamp_ns, 0, &id) == LBEA_WIRE_TOO_LARGE && id == 0);
  CHECK_SENTENCE("200000000 points");
  CHECK(lbea_wire_sender_send(sender, point, 1, INT64_MAX, 0, &id) == LBEA_WIRE_BAD_STAMP && id == 1);
  lbea_wire_tally tally = {0};
  tally.struct_size = sizeof tally;
  lbea_wire_tally unset = {0};
  CHECK(lbea_wire_sender_close(sender, &unset) == LBEA_WIRE_BAD_ARGUMENT); /* still open */
  CHECK_SENTENCE("struct_size");
  CHECK(lbea_wire_sender_close(sender, &tally) == LBEA_WIRE_OK && tally.captured == 2 && tally.refused == 2);
  for (int withheld = 0; withheld < 2 && failures == 0; ++withheld)
    CHECK(lbea_wire_receiver_receive(receiver, patience_ms, &result) == LBEA_WIRE_OK &&
          result.status == LBEA_WIRE_FRAME_WITHHELD);
  lbea_wire_receiver_close(receiver);
  CHECK(strcmp(lbea_wire_status_string(LBEA_WIRE_NO_ROOM), "no_room") == 0);
  CHECK(strcmp(lbea_wire_frame_status_string(LBEA_WIRE_FRAME_WITHHELD), "withheld") == 0);
  CHECK(strcmp(lbea_wire_frame_status_string((lbea_wire_frame_status)1000), "unknown_status") == 0);
  CHECK(strcmp(lbea_wire_verdict_string(LBEA_WIRE_VERDICT_AMBIGUOUS), "ambiguous") == 0);
}

static void cannot_open(const char* frames, const char* results, const lbea_wire_options* options,
                        lbea_wire_status expected, const char* words) {
  lbea_wire_sender* sender = NULL;
  CHECK(lbea_wire_sender_open(frames, options, &sender) == expected && sender == NULL);
  CHECK_SENTENCE(words);
  lbea_wire_receiver* receiver = NULL;
  CHECK(lbea_wire_receiver_open(results, options, &receiver) == expected && receiver == NULL);
  CHECK_SENTENCE(words);
}

void a_wrong_endpoint_is_named(const char* nobody) {
  lbea_wire_options options = options_of(NULL, NULL);
  options.patience_ms = 300;
  cannot_open(nobody, nobody, &options, LBEA_WIRE_UNAVAILABLE, "nobody listens there");
  CHECK_SENTENCE(nobody);
  cannot_open("http://127.0.0.1:80", "", &options, LBEA_WIRE_BAD_CONFIG, "not an endpoint");
  cannot_open("inproc://matcher", "inproc://matcher", &options, LBEA_WIRE_BAD_CONFIG, "threads of one process");
  cannot_open("tcp://127.0.0.1", "tcp://127.0.0.1", &options, LBEA_WIRE_BAD_CONFIG, "no port");
}

void wrong_keys_are_refused(const char* frames, const char* results, const char* server_key_file, const char* key_file,
                            const char* strange_key_file, const char* other_server_key_file) {
  lbea_wire_options stranger = options_of(server_key_file, strange_key_file);
  cannot_open(frames, results, &stranger, LBEA_WIRE_REFUSED, "does not allow this program's key");
  lbea_wire_options nameless = options_of(server_key_file, NULL);
  cannot_open(frames, results, &nameless, LBEA_WIRE_REFUSED, "does not allow this program's key");
  lbea_wire_options misled = options_of(other_server_key_file, key_file);
  misled.patience_ms = 1000;
  cannot_open(frames, results, &misled, LBEA_WIRE_UNAVAILABLE, "the handshake failed");
  lbea_wire_options plain = options_of(NULL, NULL);
  plain.patience_ms = 1000;
  cannot_open(frames, results, &plain, LBEA_WIRE_UNAVAILABLE, "the handshake failed");
  lbea_wire_options swapped = options_of(server_key_file, server_key_file);
  cannot_open(frames, results, &swapped, LBEA_WIRE_BAD_CONFIG, "holds no secret key");
}

/* In UTF-8 on every system; the lines end as on Windows. */
void key_files_have_any_name(const char* frames, const char* results) {
  const lbea_wire_options options = options_of(
      "Pr\xc3\xbc"
      "fstand 1.pub",
      "Pr\xc3\xbc"
      "fstand 1.key");
  lbea_wire_sender* sender = opened_sender(frames, &options);
  lbea_wire_receiver* receiver = opened_receiver(results, &options);
  if (sender != NULL) CHECK(lbea_wire_sender_close(sender, NULL) == LBEA_WIRE_OK);
  lbea_wire_receiver_close(receiver);
}

/* Prints a line when the matcher may be killed. */
void a_dead_matcher_is_noticed(const char* frames, const char* results) {
  lbea_wire_receiver* receiver = opened_receiver(results, NULL);
  lbea_wire_sender* sender = opened_sender(frames, NULL);
  lbea_wire_result result = {0};
  result.struct_size = sizeof result;
  CHECK(lbea_wire_sender_send(sender, point, 1, stamp_ns, patience_ms, NULL) == LBEA_WIRE_OK);
  CHECK(lbea_wire_receiver_receive(receiver, patience_ms, &result) == LBEA_WIRE_OK && result.frame_id == 0);
  printf("connected\n");
  fflush(stdout);

  lbea_wire_status status = LBEA_WIRE_TIMEOUT;
  for (int waited_ms = 0; waited_ms < patience_ms && status == LBEA_WIRE_TIMEOUT; waited_ms += 100)
    status = lbea_wire_receiver_receive(receiver, 100, &result);
  CHECK(status == LBEA_WIRE_UNAVAILABLE);
  CHECK_SENTENCE("nobody listens there");
  /* The sender has a connection of its own, which may break a little later. */
  uint64_t captured = 1;
  status = LBEA_WIRE_OK;
  for (int waited_ms = 0; waited_ms < patience_ms && status == LBEA_WIRE_OK; waited_ms += 100) {
    CHECK(lbea_wire_receiver_receive(receiver, 100, &result) == LBEA_WIRE_UNAVAILABLE);
    status = lbea_wire_sender_send(sender, point, 1, stamp_ns, 0, NULL);
    ++captured;
  }
  CHECK(status == LBEA_WIRE_NO_ROOM);
  CHECK_SENTENCE("nobody listens there");
  CHECK(lbea_wire_sender_end_test(sender) == LBEA_WIRE_NO_ROOM);
  lbea_wire_tally tally = {0};
  tally.struct_size = sizeof tally;
  status = lbea_wire_sender_close(sender, &tally);
  CHECK(tally.captured == captured && tally.sent == captured - 1 && tally.refused == 1);
  CHECK(tally.handed_over >= 1 && tally.handed_over <= tally.sent);
  CHECK(status == (tally.handed_over == tally.sent ? LBEA_WIRE_OK : LBEA_WIRE_UNDELIVERED));
  lbea_wire_receiver_close(receiver);
}
