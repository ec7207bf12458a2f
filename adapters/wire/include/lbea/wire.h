/* wire.h - send point-cloud frames to a running lbea-serve and receive its results, from C.
 *
 * Opaque handles, status codes, no globals. Every function accepts NULL: it then returns LBEA_WIRE_BAD_ARGUMENT, 0 or
 * NULL, or does nothing. Only one thread at a time may use a handle; each handle has threads of its own, and does not
 * survive fork(). Lengths are in the model's length unit (mm unless the ensemble says otherwise), times in ns and ms as
 * the names say. Text is UTF-8 and ends with a zero byte.
 *
 * Structs that may grow begin with struct_size: set it to sizeof(the struct). Fields that the caller was not
 * compiled with are not written; fields that the library does not know must be 0 in input and are set to 0 in output.
 */
#ifndef LBEA_WIRE_H
#define LBEA_WIRE_H

#include <stddef.h>
#include <stdint.h>

#include <lbea/api.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct lbea_wire_sender lbea_wire_sender;     /**< Sends the captures of one camera rig. */
typedef struct lbea_wire_receiver lbea_wire_receiver; /**< Receives the results of one matcher. */

typedef enum lbea_wire_status {
  LBEA_WIRE_OK = 0,
  /* per call */
  LBEA_WIRE_NO_ROOM = 1,     /**< the matcher is slow or gone: the capture is not sent, and reported as withheld */
  LBEA_WIRE_BAD_STAMP = 2,   /**< before 1970 or after 2106: likewise */
  LBEA_WIRE_TOO_LARGE = 3,   /**< more points than a message holds (2 GB): likewise */
  LBEA_WIRE_TIMEOUT = 4,     /**< no result arrived in time, or a signal did */
  LBEA_WIRE_END_OF_TEST = 5, /**< the sender has ended the test; another one may follow */
  LBEA_WIRE_UNKNOWN = 6,     /**< the matcher has not reported what was asked for */
  LBEA_WIRE_UNDELIVERED = 7, /**< at closing: not all frames sent have left this process */
  /* at set-up */
  LBEA_WIRE_BAD_CONFIG = 16,  /**< endpoint, option or key file */
  LBEA_WIRE_UNAVAILABLE = 17, /**< nobody listens at the endpoint, or only one end has keys */
  LBEA_WIRE_REFUSED = 18,     /**< by access control: the matcher does not allow this program's key */
  /* of this interface */
  LBEA_WIRE_BAD_ARGUMENT = 32, /**< NULL, an impossible struct_size */
  LBEA_WIRE_OUT_OF_MEMORY = 33,
  LBEA_WIRE_INTERNAL_ERROR = 34,
  LBEA_WIRE_STATUS_MAX_ = 0x7fffffff /* keeps the enum four bytes wide */
} lbea_wire_status;

/** What became of a capture. A later matcher may send further values. */
typedef enum lbea_wire_frame_status {
  LBEA_WIRE_FRAME_OK = 0,
  LBEA_WIRE_FRAME_LOW_COVERAGE = 1, /**< matched, but too little of the surface was seen to trust it */
  /* rejected */
  LBEA_WIRE_FRAME_EMPTY = 2, /**< no finite point inside the ensemble's envelope */
  LBEA_WIRE_FRAME_TOO_MANY_POINTS = 3,
  LBEA_WIRE_FRAME_TOO_LARGE = 4,
  LBEA_WIRE_FRAME_WRONG_KIND = 5,
  LBEA_WIRE_FRAME_DAMAGED = 6,
  LBEA_WIRE_FRAME_BAD_CLOUD = 7,
  LBEA_WIRE_FRAME_BAD_LAYOUT = 8,
  LBEA_WIRE_FRAME_BAD_FIELDS = 9,
  LBEA_WIRE_FRAME_BAD_STAMP = 10,
  LBEA_WIRE_FRAME_UNSUPPORTED_POSE = 11,
  LBEA_WIRE_FRAME_DUPLICATE = 16, /**< of an id that arrived before */
  /* dropped */
  LBEA_WIRE_FRAME_QUEUE_FULL = 12,
  LBEA_WIRE_FRAME_MISSED = 14,       /**< a later one arrived */
  LBEA_WIRE_FRAME_WITHHELD = 15,     /**< its sender could not send it */
  LBEA_WIRE_FRAME_OTHER_SENDER = 17, /**< another sender's test was running */
  LBEA_WIRE_FRAME_OUT_OF_STEP = 18,  /**< with several rigs: its stamp is of another time than those of the others */
  /* not a capture */
  LBEA_WIRE_FRAME_END_OF_TEST = 13,
  LBEA_WIRE_FRAME_STATUS_MAX_ = 0x7fffffff
} lbea_wire_frame_status;

typedef enum lbea_wire_fate {
  LBEA_WIRE_MATCHED = 0,
  LBEA_WIRE_REJECTED = 1,
  LBEA_WIRE_DROPPED = 2,
  LBEA_WIRE_NOT_A_CAPTURE = 3,
  LBEA_WIRE_FATE_MAX_ = 0x7fffffff
} lbea_wire_fate;

/** Whether the ensemble as a whole explains a frame or a test. A later matcher may send further values. */
typedef enum lbea_wire_verdict {
  LBEA_WIRE_VERDICT_UNKNOWN = 0, /**< not determined (methods other than fit), or too little was seen */
  LBEA_WIRE_VERDICT_MATCHED = 1, /**< one shape explains it as well as the runs explain each other */
  LBEA_WIRE_VERDICT_LOW_COVERAGE = 2,
  LBEA_WIRE_VERDICT_REFUSED = 3,            /**< the frame was not matched */
  LBEA_WIRE_VERDICT_AMBIGUOUS = 4,          /**< several simulations with clearly different shapes explain it */
  LBEA_WIRE_VERDICT_NO_SIMULATION_FITS = 5, /**< no simulation explains it */
  LBEA_WIRE_VERDICT_MAX_ = 0x7fffffff
} lbea_wire_verdict;

/** What is 0 or NULL has the default. */
typedef struct lbea_wire_options {
  uint32_t struct_size;
  uint32_t queued_messages;    /**< held while the other end is slow, at most 1,000,000; 0: 16 frames, 10,000 results */
  uint32_t patience_ms;        /**< how long the open functions wait for the matcher; 0: 5,000 */
  const char* server_key_file; /**< the matcher's public key; NULL: without keys */
  const char* key_file;        /**< this program's own keys, which the matcher must allow; needs server_key_file */
} lbea_wire_options;

/** captured = sent + refused. */
typedef struct lbea_wire_tally {
  uint32_t struct_size;
  uint64_t session;     /**< of this sender; names it in results */
  uint64_t captured;    /**< calls that were given a frame id */
  uint64_t sent;        /**< accepted for sending */
  uint64_t refused;     /**< not sent, and reported to the matcher as withheld */
  uint64_t handed_over; /**< at closing: of those sent, how many have left this process; before, 0 */
} lbea_wire_tally;

/** A sample of the ensemble with its distance to the frame. */
typedef struct lbea_wire_match {
  uint32_t simulation;
  uint32_t time_step;
  const char* simulation_name;
  double time_s;
  float distance; /**< LBEA: eq. 3; VtP: eq. 1 divided by the number of vertices; fit: estimated EE (eq. 4) */
} lbea_wire_match;

/** fit: a sample similar to the frame. */
typedef struct lbea_wire_candidate {
  uint32_t simulation;
  uint32_t time_step;
  float residual; /**< root mean square depth difference, length unit */
} lbea_wire_candidate;

/** fit: a share of a sample in the estimate; shares add up to 1. Small ones may be negative. */
typedef struct lbea_wire_share {
  uint32_t simulation;
  uint32_t time_step;
  float weight;
} lbea_wire_share;

/** A quantity of interest in a frame, one of those that the ensemble description names. */
typedef struct lbea_wire_channel {
  const char* name;
  const char* unit;
  float value;    /**< of the estimate by fit, else of the best sample; a rate: of the whole test so far */
  float bound_90; /**< 90 % of the true values differ by less; NaN: not known */
  float end_value, end_bound_90; /**< forecast of the value at the end of the test; NaN: not known */
} lbea_wire_channel;

/** One rig's frame, in the result of a capture of several rigs. */
typedef struct lbea_wire_rig_frame {
  const char* rig;
  uint64_t session;  /**< of the rig's sender */
  uint64_t frame_id; /**< of that session */
  int64_t stamp_ns;  /**< by the rig's clock */
  lbea_wire_frame_status status;
  lbea_wire_verdict verdict; /**< by this frame alone */
  int32_t is_used;           /**< 1: the result rests on it */
  uint32_t points_used;
  float coverage, misfit;
  float pose_turn, pose_shift; /**< the pose error that is corrected: degrees, length unit; NaN: not estimated */
  /** Added to stamp_ns beside the given offset, it gives the first rig's clock, by the impact that both have seen. */
  int64_t clock_correction_ns;
} lbea_wire_rig_frame;

/** What the matcher found for one capture. With several rigs, session is that of the test, which is no sender's, and
    frame_id counts captures; each rig's sender and the test have their own end. Pointers are valid until the next
   receive. The numbers are those of lbea_result in lbea.h. */
typedef struct lbea_wire_result {
  uint32_t struct_size;
  lbea_wire_frame_status status;
  lbea_wire_fate fate;
  lbea_wire_verdict verdict; /**< of this frame */
  uint64_t sequence;         /**< rises by one per message of the matcher */
  uint64_t session;          /**< of the sender */
  uint64_t frame_id;         /**< rises by one per capture of a session */
  int64_t stamp_ns;          /**< capture time on the sender's clock */
  int64_t receive_ns;        /**< when the matcher had the frame, on its clock since 1970 */
  int64_t publish_ns;        /**< when it published this result */
  uint64_t model_checksum;
  const lbea_wire_match* matches;        /**< match_count, best first */
  const lbea_wire_candidate* candidates; /**< candidate_count, best first */
  const lbea_wire_share* estimate;       /**< estimate_count: the combination that explains the frame best */
  const lbea_wire_channel* channels;     /**< channel_count, in the order of the model; 0 for a refused frame */
  uint32_t match_count, candidate_count, estimate_count, channel_count;
  uint32_t reference;           /**< the reference mesh that was used */
  float coverage;               /**< share of the observed surface (fit: of its part in view) that it shows */
  float leading_coordinates[3]; /**< the coefficients with the highest variance over the samples */
  /* fit, else NaN */
  float residual, estimate_residual, misfit, spread, error_90;
  float pose_turn, pose_shift, pose_turn_sd, pose_shift_sd;
  float test_time, test_time_sd;
  uint32_t points_received, points_invalid, points_culled, points_used; /**< received = used + invalid + culled */
  uint32_t decode_ns, queue_ns, index_ns, correspondence_ns, projection_ns, matching_ns, coverage_ns, fit_ns;
  uint32_t total_ns;               /**< publish_ns - receive_ns */
  uint32_t rig_count;              /**< 0: one rig */
  const lbea_wire_rig_frame* rigs; /**< the frames that this result answers */
  const char* component; /**< with several models: by which one; "" with one, and for results of the whole frame */
} lbea_wire_result;

typedef struct lbea_wire_chance {
  uint32_t simulation;
  float probability;
} lbea_wire_chance;

/** fit: the judgment of the whole test, as of the latest result. Pointers are valid until the next receive. */
typedef struct lbea_wire_test {
  uint32_t struct_size;
  lbea_wire_verdict verdict;
  uint64_t frames;                         /**< with evidence */
  uint32_t simulation;                     /**< the most likely one for the whole test so far */
  uint32_t sample_simulation, sample_step; /**< the most likely sample now */
  float sample_probability;                /**< of this sample */
  float misfit;                            /**< geometric mean of the frames' misfits */
  uint32_t chance_count, branch_count;     /**< of the next two */
  const lbea_wire_chance* chances;         /**< of the most probable simulations, best first */
  const float* branch_probabilities;       /**< of the deformation branches */
} lbea_wire_test;

/** The matcher's account of all senders, as of its latest message and since its start:
    captured = matched + rejected + dropped + on_the_way. */
typedef struct lbea_wire_account {
  uint32_t struct_size;
  uint32_t sessions; /**< senders */
  uint64_t captured, matched, rejected, dropped;
  uint64_t on_the_way;  /**< received, and neither matched nor rejected nor dropped yet */
  uint64_t missed;      /**< of the dropped: never arrived */
  uint64_t withheld;    /**< of the dropped: not sent */
  uint64_t unannounced; /**< rejected or dropped without a result */
  uint64_t unrecorded;  /**< frames and results missing from the matcher's recording */
  uint64_t lost;        /**< messages of the matcher that this receiver was too slow for; those that a restarted
                             matcher sent before this receiver reconnected are not counted */
  uint64_t damaged;     /**< messages that this receiver could not read */
} lbea_wire_account;

/** The matcher's account of one sender: captured = received + missed + withheld. */
typedef struct lbea_wire_receipt {
  uint32_t struct_size;
  int32_t has_ended; /**< 1: the sender has said goodbye or ended the test, and the matcher has its last frame */
  int32_t is_silent; /**< 1: no message for 3 s and no goodbye: frames may be missing */
  uint64_t captured, received, missed, withheld;
} lbea_wire_receipt;

/** The matcher, as of its latest state, which it publishes twice a second. Pointers are valid until the next receive.
 */
typedef struct lbea_wire_matcher {
  uint32_t struct_size;
  uint32_t max_points; /**< frames with more points are rejected */
  const char* version; /**< of lbea-serve */
  const char* method;  /**< "lbea", "vtp" or "fit" */
  const char* model_file;
  const char* length_unit;
  uint64_t model_checksum;
  uint32_t simulations, samples;
} lbea_wire_matcher;

/* About the library. */
LBEA_API uint32_t lbea_wire_version(void); /**< 0xMMmmpp of the loaded library */
/** Stable lower-case names, never NULL. */
LBEA_API const char* lbea_wire_status_string(lbea_wire_status status);
LBEA_API const char* lbea_wire_frame_status_string(lbea_wire_frame_status status);
LBEA_API const char* lbea_wire_verdict_string(lbea_wire_verdict verdict);
/** The message of this thread's last status other than LBEA_WIRE_OK and LBEA_WIRE_END_OF_TEST, with the remedy; "" when
 * there was none. Never NULL; valid until the next such status of this thread. */
LBEA_API const char* lbea_wire_last_error(void);

/* Senders. They number the captures from 0 and report to the matcher: hello, heartbeats in pauses, captures that are
 * not sent, goodbye. The matcher then accounts for every capture. */
/** Connects to the frames endpoint of lbea-serve, tcp://HOST:PORT or ipc://PATH, and waits until the matcher admits
 * this program. options: NULL for the defaults. *sender is NULL unless LBEA_WIRE_OK is returned. */
LBEA_API lbea_wire_status lbea_wire_sender_open(const char* endpoint, const lbea_wire_options* options,
                                                lbea_wire_sender** sender);
/** Sends a capture: point_count x 3 coordinates in the sensor's system, copied before the function returns; the matcher
 * skips and counts points that are not finite. stamp_ns: capture time since 1970. Waits up to timeout_ms for room in
 * the matcher's queue. *frame_id, unless NULL: the id of this capture in results. After LBEA_WIRE_BAD_ARGUMENT the call
 * is not a capture. */
LBEA_API lbea_wire_status lbea_wire_sender_send(lbea_wire_sender* sender, const float* xyz, size_t point_count,
                                                int64_t stamp_ns, uint32_t timeout_ms, uint64_t* frame_id);
/** Counts a capture that is not sent, and reports it to the matcher. */
LBEA_API lbea_wire_status lbea_wire_sender_withhold(lbea_wire_sender* sender, uint64_t* frame_id);
/** Marks the end of a test, waiting up to 2 s for room. The next capture begins another one. */
LBEA_API lbea_wire_status lbea_wire_sender_end_test(lbea_wire_sender* sender);
LBEA_API lbea_wire_status lbea_wire_sender_get_tally(const lbea_wire_sender* sender, lbea_wire_tally* tally);
/** Says goodbye, waits up to 4 s until all is handed over, and frees the sender. tally: may be NULL. Returns
 * LBEA_WIRE_UNDELIVERED when tally.handed_over is less than tally.sent: the matcher has ended or does not read. After
 * LBEA_WIRE_BAD_ARGUMENT the sender is still open. */
LBEA_API lbea_wire_status lbea_wire_sender_close(lbea_wire_sender* sender, lbea_wire_tally* tally);

/* Receivers. */
/** Connects to the results endpoint of lbea-serve and waits for its first message, so that no later result is missed.
 * *receiver is NULL unless LBEA_WIRE_OK is returned. */
LBEA_API lbea_wire_status lbea_wire_receiver_open(const char* endpoint, const lbea_wire_options* options,
                                                  lbea_wire_receiver** receiver);
/** The next result, waiting up to timeout_ms for it. LBEA_WIRE_OK: result->status tells what became of the capture.
 * After LBEA_WIRE_TIMEOUT, LBEA_WIRE_UNAVAILABLE (the matcher has ended) and LBEA_WIRE_REFUSED, there is no result; a
 * restarted matcher is connected to again. Set result->struct_size once. */
LBEA_API lbea_wire_status lbea_wire_receiver_receive(lbea_wire_receiver* receiver, uint32_t timeout_ms,
                                                     lbea_wire_result* result);
/** LBEA_WIRE_UNKNOWN while no frame of the test has evidence, or with other methods than fit. */
LBEA_API lbea_wire_status lbea_wire_receiver_get_test(const lbea_wire_receiver* receiver, lbea_wire_test* test);
LBEA_API lbea_wire_status lbea_wire_receiver_get_account(const lbea_wire_receiver* receiver,
                                                         lbea_wire_account* account);
/** Of the sender with this session, among the latest ones; as of the latest state. */
LBEA_API lbea_wire_status lbea_wire_receiver_get_receipt(const lbea_wire_receiver* receiver, uint64_t session,
                                                         lbea_wire_receipt* receipt);
LBEA_API lbea_wire_status lbea_wire_receiver_get_matcher(const lbea_wire_receiver* receiver,
                                                         lbea_wire_matcher* matcher);
/** Of the latest result's model. NULL for an index out of range, and when the matcher has another model. Valid until
 * the next receive. */
LBEA_API const char* lbea_wire_receiver_simulation_name(const lbea_wire_receiver* receiver, uint32_t simulation);
LBEA_API void lbea_wire_receiver_close(lbea_wire_receiver* receiver);

#ifdef __cplusplus
}
#endif
#endif
