/* A thousand captures, all of them whole or some that cannot be matched or sent: each one has one result, and all
 * counts are as expected. */
#include "tests/wire/c/client.h"

#include <math.h>
#include <stdlib.h>

enum { captures = 1000, window = 8, clouds_read = 4, most_sent = 4000, too_many = most_points + 1 };
static const int64_t first_stamp_ns = 1700000000000000000;

/* By i % 100, unless all captures are whole; the others are matched. */
enum { all_nan = 10, oversized = 20, before_1970 = 30, not_sent = 40, no_point = 50 };

typedef struct test_run {
  lbea_wire_sender* sender;
  lbea_wire_receiver* receiver;
  lbea_point* clouds[clouds_read]; /* thinned to point_counts */
  size_t point_counts[clouds_read];
  lbea_point* other; /* too_many points, all NaN */
  int all_whole;
  int results[captures];
  int received, ends;
  uint64_t session, by_fate[4];
} test_run;

static void read_clouds(test_run* run, const char* folder) {
  lbea_point* points = malloc(most_points * sizeof *points);
  for (int c = 0; c < clouds_read; ++c) {
    const size_t count = read_cloud(folder, c, points);
    CHECK(count > 0);
    const size_t step = count / most_sent + 1;
    run->clouds[c] = malloc((count / step + 2) * sizeof *points);
    run->point_counts[c] = 0;
    for (size_t i = 0; i < count; i += step) run->clouds[c][run->point_counts[c]++] = points[i];
    run->clouds[c][0].y = NAN; /* one point that is not finite */
  }
  free(points);
  run->other = malloc(too_many * sizeof *run->other);
  for (size_t i = 0; i < too_many; ++i) run->other[i].x = run->other[i].y = run->other[i].z = NAN;
}

static int kind_of(const test_run* run, uint64_t capture) { return run->all_whole ? 0 : (int)(capture % 100); }
static uint64_t count_of(const test_run* run, uint64_t captures_not_whole) {
  return run->all_whole ? 0 : captures_not_whole;
}

static lbea_wire_status send_capture(test_run* run, int i, uint64_t* id) {
  const int c = i % clouds_read;
  const float* xyz = &run->clouds[c]->x;
  const int64_t stamp_ns = first_stamp_ns + (int64_t)i * 1000000;
  const size_t count = run->point_counts[c];
  switch (kind_of(run, (uint64_t)i)) {
    case all_nan:
      return lbea_wire_sender_send(run->sender, &run->other->x, 100, stamp_ns, patience_ms, id);
    case oversized:
      return lbea_wire_sender_send(run->sender, &run->other->x, too_many, stamp_ns, patience_ms, id);
    case before_1970:
      return lbea_wire_sender_send(run->sender, xyz, count, -1, patience_ms, id);
    case not_sent:
      return lbea_wire_sender_withhold(run->sender, id);
    case no_point:
      return lbea_wire_sender_send(run->sender, NULL, 0, stamp_ns, patience_ms, id);
    default:
      return lbea_wire_sender_send(run->sender, xyz, count, stamp_ns, patience_ms, id);
  }
}

static void check_matched(const test_run* run, const lbea_wire_result* result) {
  CHECK(result->fate == LBEA_WIRE_MATCHED);
  CHECK(result->stamp_ns == first_stamp_ns + (int64_t)result->frame_id * 1000000);
  CHECK(result->points_received == run->point_counts[result->frame_id % clouds_read]);
  CHECK(result->points_invalid == 1);
  CHECK(result->points_received == result->points_used + result->points_invalid + result->points_culled);
  CHECK(result->coverage > 0 && result->coverage <= 1);
  CHECK(result->total_ns > 0 && result->publish_ns >= result->receive_ns);
  CHECK(result->match_count > 0);
  if (result->match_count == 0) return;
  const lbea_wire_match* best = result->matches;
  const char* name = lbea_wire_receiver_simulation_name(run->receiver, best->simulation);
  CHECK(name != NULL && strcmp(name, best->simulation_name) == 0);
  CHECK(best->distance > 0 && best->distance <= best[result->match_count - 1].distance);
  CHECK(result->channel_count == 2);
  if (result->channel_count != 2) return;
  CHECK(strcmp(result->channels[0].name, "struck end") == 0 && strcmp(result->channels[0].unit, "mm") == 0);
  CHECK(strcmp(result->channels[1].unit, "mm/s") == 0);
  CHECK(isfinite(result->channels[0].value) && isnan(result->channels[0].bound_90)); /* by lbea */
}

static void check_result(test_run* run, const lbea_wire_result* result) {
  CHECK(result->session == run->session && result->frame_id < captures);
  if (result->frame_id >= captures) return;
  ++run->results[result->frame_id];
  ++run->by_fate[result->fate];
  switch (kind_of(run, result->frame_id)) {
    case all_nan:
    case no_point:
      CHECK(result->status == LBEA_WIRE_FRAME_EMPTY && result->match_count == 0);
      CHECK(result->channel_count == 0);
      return;
    case oversized:
      CHECK(result->status == LBEA_WIRE_FRAME_TOO_MANY_POINTS);
      return;
    case before_1970:
    case not_sent:
      CHECK(result->status == LBEA_WIRE_FRAME_WITHHELD);
      return;
    default:
      check_matched(run, result);
  }
}

static void receive_one(test_run* run) {
  lbea_wire_result result = {0};
  result.struct_size = sizeof result;
  const lbea_wire_status status = lbea_wire_receiver_receive(run->receiver, patience_ms, &result);
  if (status == LBEA_WIRE_END_OF_TEST) {
    CHECK(result.status == LBEA_WIRE_FRAME_END_OF_TEST && result.fate == LBEA_WIRE_NOT_A_CAPTURE);
    ++run->ends;
    return;
  }
  if (status != LBEA_WIRE_OK) printf("%s\n", lbea_wire_last_error());
  CHECK(status == LBEA_WIRE_OK);
  ++run->received;
  if (status == LBEA_WIRE_OK) check_result(run, &result);
}

static void send_and_receive(test_run* run) {
  for (int i = 0; i < captures; ++i) {
    uint64_t id = captures;
    const lbea_wire_status status = send_capture(run, i, &id);
    CHECK(status == (kind_of(run, (uint64_t)i) == before_1970 ? LBEA_WIRE_BAD_STAMP : LBEA_WIRE_OK));
    CHECK(id == (uint64_t)i);
    while (i + 1 - run->received > window && failures == 0) receive_one(run);
  }
  CHECK(lbea_wire_sender_end_test(run->sender) == LBEA_WIRE_OK);
  while (run->received < captures && failures == 0) receive_one(run);
  while (run->ends < 1 && failures == 0) receive_one(run);
}

static void check_account(test_run* run) {
  lbea_wire_account account = {0};
  account.struct_size = sizeof account;
  CHECK(lbea_wire_receiver_get_account(run->receiver, &account) == LBEA_WIRE_OK);
  CHECK(account.captured == captures && account.sessions == 1);
  CHECK(account.matched == captures - count_of(run, 50));
  CHECK(account.rejected == count_of(run, 30) && account.dropped == count_of(run, 20));
  CHECK(account.withheld == account.dropped && account.missed == 0 && account.on_the_way == 0);
  CHECK(account.lost == 0 && account.damaged == 0 && account.unannounced == 0);
  CHECK(run->by_fate[LBEA_WIRE_MATCHED] == account.matched && run->by_fate[LBEA_WIRE_REJECTED] == account.rejected &&
        run->by_fate[LBEA_WIRE_DROPPED] == account.dropped);
  int once = 0;
  for (int i = 0; i < captures; ++i) once += run->results[i] == 1;
  CHECK(once == captures);
}

/* The state that lists the session as ended may come later; until then nothing else is received. */
static void check_receipt(test_run* run) {
  lbea_wire_receipt receipt = {0};
  receipt.struct_size = sizeof receipt;
  lbea_wire_result result = {0};
  result.struct_size = sizeof result;
  for (int waited_ms = 0; waited_ms < patience_ms && receipt.has_ended == 0 && failures == 0; waited_ms += 100) {
    lbea_wire_receiver_get_receipt(run->receiver, run->session, &receipt);
    if (receipt.has_ended == 0) CHECK(lbea_wire_receiver_receive(run->receiver, 100, &result) == LBEA_WIRE_TIMEOUT);
  }
  CHECK(receipt.has_ended == 1 && receipt.is_silent == 0);
  CHECK(receipt.captured == captures && receipt.received == captures - count_of(run, 20));
  CHECK(receipt.withheld == count_of(run, 20) && receipt.missed == 0);
}

void every_capture_has_one_result(const char* frames, const char* results, const char* clouds,
                                  const lbea_wire_options* options, int all_whole) {
  static test_run run;
  run.all_whole = all_whole;
  read_clouds(&run, clouds);
  run.receiver = opened_receiver(results, options);
  run.sender = opened_sender(frames, options);
  lbea_wire_tally tally = {0};
  tally.struct_size = sizeof tally;
  CHECK(lbea_wire_sender_get_tally(run.sender, &tally) == LBEA_WIRE_OK && tally.captured == 0);
  run.session = tally.session;
  if (failures == 0) send_and_receive(&run);
  check_account(&run);
  CHECK(lbea_wire_sender_close(run.sender, &tally) == LBEA_WIRE_OK);
  CHECK(tally.captured == captures && tally.refused == count_of(&run, 20));
  CHECK(tally.sent == captures - tally.refused && tally.handed_over == tally.sent);
  check_receipt(&run);
  lbea_wire_matcher matcher = {0};
  matcher.struct_size = sizeof matcher;
  CHECK(lbea_wire_receiver_get_matcher(run.receiver, &matcher) == LBEA_WIRE_OK);
  CHECK(strcmp(matcher.method, "lbea") == 0 && strcmp(matcher.length_unit, "mm") == 0);
  CHECK(matcher.max_points == most_points && matcher.simulations > 1 && matcher.samples > matcher.simulations);
  lbea_wire_receiver_close(run.receiver);
  for (int c = 0; c < clouds_read; ++c) free(run.clouds[c]);
  free(run.other);
}

static void check_fit(test_run* run, const lbea_wire_result* result) {
  CHECK(result->status == LBEA_WIRE_FRAME_OK && result->candidate_count > 0 && result->estimate_count > 0);
  CHECK(result->residual > 0 && result->estimate_residual > 0 && result->misfit > 0 && result->error_90 > 0);
  double weights = 0;
  for (uint32_t i = 0; i < result->estimate_count; ++i) weights += (double)result->estimate[i].weight;
  CHECK(fabs(weights - 1) < 1e-4);
  lbea_wire_test test = {0};
  test.struct_size = sizeof test;
  CHECK(lbea_wire_receiver_get_test(run->receiver, &test) == LBEA_WIRE_OK);
  CHECK(test.frames == result->frame_id + 1 && test.chance_count > 0);
  if (test.chance_count == 0) return;
  CHECK(test.chances[0].simulation == test.simulation);
  CHECK(lbea_wire_receiver_simulation_name(run->receiver, test.simulation) != NULL);
  double chances = 0, branches = 0;
  for (uint32_t i = 0; i < test.chance_count; ++i) chances += (double)test.chances[i].probability;
  for (uint32_t i = 0; i < test.branch_count; ++i) branches += (double)test.branch_probabilities[i];
  CHECK(chances > 0 && chances < 1 + 1e-4);
  CHECK(fabs(branches - 1) < 1e-4);
}

void fit_judges_the_test(const char* frames, const char* results, const char* clouds) {
  static test_run run;
  read_clouds(&run, clouds);
  run.receiver = opened_receiver(results, NULL);
  run.sender = opened_sender(frames, NULL);
  for (int c = 0; c < clouds_read && failures == 0; ++c) {
    const int64_t stamp_ns = first_stamp_ns + (int64_t)c * 4000000;
    CHECK(lbea_wire_sender_send(run.sender, &run.clouds[c]->x, run.point_counts[c], stamp_ns, patience_ms, NULL) ==
          LBEA_WIRE_OK);
    lbea_wire_result result = {0};
    result.struct_size = sizeof result;
    CHECK(lbea_wire_receiver_receive(run.receiver, patience_ms, &result) == LBEA_WIRE_OK);
    if (failures == 0) check_fit(&run, &result);
  }
  CHECK(lbea_wire_sender_close(run.sender, NULL) == LBEA_WIRE_OK);
  lbea_wire_receiver_close(run.receiver);
  for (int c = 0; c < clouds_read; ++c) free(run.clouds[c]);
  free(run.other);
}

/* Each capture of the two rigs has one result, which names both frames. */
void rigs_are_matched_together(const char* left, const char* right, const char* results, const char* clouds) {
  static test_run run;
  read_clouds(&run, clouds);
  run.receiver = opened_receiver(results, NULL);
  lbea_wire_sender* senders[2] = {opened_sender(left, NULL), opened_sender(right, NULL)};
  lbea_wire_tally tallies[2] = {{0}, {0}};
  for (int rig = 0; rig < 2; ++rig) {
    tallies[rig].struct_size = sizeof tallies[rig];
    CHECK(lbea_wire_sender_get_tally(senders[rig], &tallies[rig]) == LBEA_WIRE_OK);
  }
  for (int c = 0; c < clouds_read && failures == 0; ++c) {
    const int64_t stamp_ns = first_stamp_ns + (int64_t)c * 4000000;
    for (int rig = 0; rig < 2; ++rig)
      CHECK(lbea_wire_sender_send(senders[rig], &run.clouds[c]->x, run.point_counts[c], stamp_ns, patience_ms, NULL) ==
            LBEA_WIRE_OK);
    lbea_wire_result result = {0};
    result.struct_size = sizeof result;
    CHECK(lbea_wire_receiver_receive(run.receiver, patience_ms, &result) == LBEA_WIRE_OK);
    CHECK(result.component[0] == '\0');
    CHECK(result.rig_count == 2);
    CHECK(result.frame_id == (uint64_t)c);
    CHECK(result.session == ~tallies[0].session);
    for (uint32_t rig = 0; rig < result.rig_count; ++rig) {
      const lbea_wire_rig_frame* frame = &result.rigs[rig];
      CHECK(strcmp(frame->rig, rig == 0 ? "left" : "right") == 0);
      CHECK(frame->session == tallies[rig].session && frame->frame_id == (uint64_t)c && frame->stamp_ns == stamp_ns);
      CHECK(frame->status == LBEA_WIRE_FRAME_OK && frame->is_used == 1 && frame->points_used > 0);
      CHECK(frame->coverage > 0 && frame->misfit > 0);
    }
  }
  for (int rig = 0; rig < 2; ++rig) CHECK(lbea_wire_sender_close(senders[rig], NULL) == LBEA_WIRE_OK);
  lbea_wire_receiver_close(run.receiver);
  for (int c = 0; c < clouds_read; ++c) free(run.clouds[c]);
  free(run.other);
}
