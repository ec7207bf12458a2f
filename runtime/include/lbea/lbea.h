/* lbea.h - find the simulations that look like the point-cloud frame just captured, from C.
 *
 * Opaque handles, status codes, no globals. Set-up may allocate and read the disk; matching with valid arguments does
 * not allocate, lock or call the system. Every function accepts NULL: it then returns LBEA_BAD_ARGUMENT, 0 or NULL, or
 * does nothing. Threads may share a model; only one thread at a time may use another handle.
 *
 * Units: lengths in the model's length unit (mm unless the ensemble says otherwise), times in s in the model and ns on
 * frames. Indices start at 0. Text is UTF-8 and ends with a zero byte.
 *
 * Structs that may grow begin with struct_size: set it to sizeof(the struct). Fields that the caller was not
 * compiled with are not written; fields that the library does not know must be 0 in input and are set to 0 in output.
 */
#ifndef LBEA_H
#define LBEA_H

#include <stddef.h>
#include <stdint.h>

#include <lbea/api.h>
#include <lbea/version.hpp>

#ifdef __cplusplus
extern "C" {
#endif

/** 0xMMmmpp of this header; lbea_version() returns that of the loaded library. */
#define LBEA_VERSION ((LBEA_VERSION_MAJOR << 16) | (LBEA_VERSION_MINOR << 8) | LBEA_VERSION_PATCH)

typedef struct lbea_model lbea_model;               /**< The baked file, immutable. */
typedef struct lbea_matcher lbea_matcher;           /**< Matches frames; owns all scratch memory. */
typedef struct lbea_rig_matcher lbea_rig_matcher;   /**< Matches the frames of several rigs together. */
typedef struct lbea_test_history lbea_test_history; /**< What the frames of a test have shown. */
typedef struct lbea_tracker lbea_tracker;           /**< Accumulates the evidence of a whole test. */
typedef struct lbea_forecast lbea_forecast;         /**< How a test will end. */

typedef enum lbea_status {
  LBEA_OK = 0,
  /* per frame */
  LBEA_EMPTY_FRAME = 1,     /**< no finite point inside the ensemble's envelope */
  LBEA_TOO_MANY_POINTS = 2, /**< more than max_points: refused, never truncated */
  LBEA_LOW_COVERAGE = 3,    /**< matched, but too little of the surface was seen to trust it */
  /* at set-up */
  LBEA_FILE_NOT_FOUND = 16,
  LBEA_NOT_A_MODEL = 17,
  LBEA_UNSUPPORTED_VERSION = 18,
  LBEA_CORRUPT_MODEL = 19,
  LBEA_BAD_CONFIG = 20,
  /* of this interface */
  LBEA_BAD_ARGUMENT = 32, /**< NULL, an index out of range, an impossible struct_size */
  LBEA_OUT_OF_MEMORY = 33,
  LBEA_INTERNAL_ERROR = 34,
  LBEA_STATUS_MAX_ = 0x7fffffff /* keeps the enum four bytes wide */
} lbea_status;

typedef enum lbea_method {
  LBEA_METHOD_LBEA = 0, /**< eq. 3: distance of coefficients in the Laplace-Beltrami eigenbasis */
  LBEA_METHOD_VTP = 1,  /**< eq. 1: distance of corresponding positions */
  LBEA_METHOD_FIT = 2,  /**< LBEA proposes, the comparison of depth images decides; needs a model baked with a sensor */
  LBEA_METHOD_MAX_ = 0x7fffffff
} lbea_method;

/** Whether the ensemble as a whole explains a frame or a test. */
typedef enum lbea_verdict {
  LBEA_VERDICT_UNKNOWN = 0,            /**< not determined (methods other than fit), or too little was seen */
  LBEA_VERDICT_MATCHED = 1,            /**< one shape explains it as well as the runs explain each other */
  LBEA_VERDICT_AMBIGUOUS = 2,          /**< several simulations with clearly different shapes explain it */
  LBEA_VERDICT_NO_SIMULATION_FITS = 3, /**< no simulation explains it */
  LBEA_VERDICT_MAX_ = 0x7fffffff
} lbea_verdict;

/** A measured position in sensor coordinates. */
typedef struct lbea_point {
  float x, y, z;
} lbea_point;

/** One captured cloud. The caller keeps the points alive during matching. */
typedef struct lbea_frame {
  uint32_t struct_size;
  uint64_t id;              /**< increases by one per frame */
  int64_t stamp_ns;         /**< capture time on the sender's clock */
  const lbea_point* points; /**< may be NULL when point_count is 0 */
  size_t point_count;
} lbea_frame;

/** A sample of the ensemble with its distance to the frame. */
typedef struct lbea_match {
  uint32_t simulation;
  uint32_t time_step;
  uint32_t sample; /**< row in the ensemble, for lbea_model_* */
  float distance;  /**< LBEA: eq. 3; VtP: eq. 1 per vertex; fit: between the sample and the estimate */
  double time_s;
} lbea_match;

/** A share of a sample in a combination; shares add up to 1. Small ones may be negative: the shape lies beside the
    samples. */
typedef struct lbea_weighted_sample {
  uint32_t sample;
  float weight;
} lbea_weighted_sample;

/** A quantity of interest in a frame. */
typedef struct lbea_channel_value {
  float value;
  float bound_90; /**< the true value differs by less in 90 % of the frames of runs that are not in the ensemble; NaN:
                       not known */
} lbea_channel_value;

/** Initialize with lbea_config_init, then change what you need. */
typedef struct lbea_config {
  uint32_t struct_size;
  uint32_t max_points;          /**< a larger frame is refused, never truncated */
  uint32_t max_matches;         /**< how many samples to return, best first */
  int32_t method;               /**< lbea_method */
  float trusted_distance;       /**< length unit; a vertex counts as seen when a point is within it; 0: 3 mm */
  float min_coverage;           /**< below this coverage, the status is LBEA_LOW_COVERAGE */
  int64_t trigger_ns;           /**< the sender's clock at impact: selects the reference mesh over time */
  float T_reference_sensor[12]; /**< row-major 3x4: reference = R * sensor + t */
} lbea_config;

/** Pointers are valid until the next match on the same matcher. */
typedef struct lbea_result {
  uint32_t struct_size;
  lbea_status status;
  lbea_verdict verdict; /**< of this frame */
  uint32_t reference;   /**< the reference mesh that was used */
  uint64_t frame_id;
  int64_t stamp_ns;
  float coverage;               /**< share of the observed surface (fit: of its part in view) that it shows */
  float leading_coordinates[3]; /**< the coefficients with the highest variance over the samples */
  const lbea_match* matches;    /**< match_count, best first */
  const float* coefficients;    /**< coefficient_count = modes x 3, mode-major: of the frame, by fit of the estimate */
  const lbea_match* candidates; /**< fit: the samples most similar to the frame; distance: their residual */
  const lbea_weighted_sample* estimate; /**< fit: the combination that explains the frame best */
  uint32_t match_count, coefficient_count, candidate_count, estimate_count;
  /* fit, else NaN; length unit */
  float residual;          /**< root mean square depth difference of the best candidate */
  float estimate_residual; /**< the same for the estimate */
  float misfit;            /**< residual over the expected residual of a run that is not in the ensemble */
  float spread;            /**< mean distance of the plausible samples from the estimate */
  uint32_t points_received, points_invalid, points_culled, points_used; /**< received = used + invalid + culled */
  uint32_t index_ns, correspondence_ns, projection_ns, matching_ns, coverage_ns, fit_ns; /**< wall time of each stage */
  float error_90;   /**< fit: the estimate's mean error is below this in 90 % of the frames of runs that are not in the
                         ensemble; length unit; NaN: not known */
  float pose_turn;  /**< fit: angle of the test's pose error, which is corrected, degrees; NaN: not estimated */
  float pose_shift; /**< its shift of the component's middle, length unit */
  float pose_turn_sd, pose_shift_sd;  /**< their standard deviations */
  float test_time, test_time_sd;      /**< time since the impact by the frames so far, s; its standard deviation */
  uint32_t channel_count;             /**< of the model; 0 for a refused frame */
  const lbea_channel_value* channels; /**< of the estimate by fit, else of the best sample */
} lbea_result;

/* The members of lbea_result with the names of FrameNumbers and FitNumbers in C++: X(name). New ones go to its end. */
#define LBEA_FRAME_NUMBERS(X) X(coverage)
#define LBEA_FIT_NUMBERS(X) \
  X(residual)               \
  X(estimate_residual)      \
  X(misfit)                 \
  X(spread) X(error_90) X(pose_turn) X(pose_shift) X(pose_turn_sd) X(pose_shift_sd) X(test_time) X(test_time_sd)

/** One of several rigs around a component. */
typedef struct lbea_rig {
  uint32_t struct_size;
  float T_reference_sensor[12]; /**< row-major 3x4: reference = R * sensor + t */
  int64_t clock_offset_ns;      /**< added to the stamps of its frames, it gives those of a common clock */
} lbea_rig;

/** What a rig's frame says alone; the numbers of the pose are by the frames of all rigs. */
typedef struct lbea_rig_result {
  uint32_t struct_size;
  lbea_status status; /**< LBEA_EMPTY_FRAME also if the rig has no frame in the capture */
  lbea_verdict verdict;
  int32_t is_used;                                                      /**< 1: the joint result rests on it; else 0 */
  uint32_t points_received, points_invalid, points_culled, points_used; /**< received = used + invalid + culled */
  /** Added to the rig's stamps beside clock_offset_ns, it gives those of the first rig's clock, by the impact that both
   * have seen in this test; 0: not known, or within the interval between states. */
  int64_t clock_correction_ns;
  float pose_correction[12]; /**< the motion that corrects its frames, as lbea_test_history_get_pose_correction */
  float coverage;            /**< this and the next ones as in lbea_result */
  float residual, estimate_residual, misfit, spread, error_90;
  float pose_turn, pose_shift, pose_turn_sd, pose_shift_sd;
  float test_time, test_time_sd;
} lbea_rig_result;

/** The result for the whole test so far. Pointers are valid until the next lbea_tracker_update. */
typedef struct lbea_test_state {
  uint32_t struct_size;
  uint32_t sample;                       /**< the most likely one now, given all frames so far */
  uint64_t frames;                       /**< frames with evidence */
  const float* simulation_probabilities; /**< simulation_count values, for the whole test so far */
  uint32_t simulation_count;
  uint32_t simulation;      /**< the most likely one for the whole test so far */
  float sample_probability; /**< of `sample` */
  float misfit;             /**< geometric mean of the frames' misfits; 0: none so far */
  lbea_verdict verdict;
} lbea_test_state;

/** What the frames so far tell about a parameter of the test. */
typedef struct lbea_parameter_forecast {
  float value;    /**< in the parameter's unit; near the runs' mean if it is not identifiable */
  float bound_90; /**< 90 % of the runs that are not in the ensemble differ by less */
  float r2;       /**< share of the variance over left-out runs that the frames explain, less its standard error */
  int32_t is_identifiable; /**< 1: the shape tells the parameter; else 0 */
} lbea_parameter_forecast;

/** A channel by all frames so far, in its unit. They also show how fast the shape changes, which a single frame does
    not: use it for velocities and accelerations. */
typedef struct lbea_channel_forecast {
  float value;          /**< at test_time_s; NaN without a frame, and after the simulations' end */
  float bound_90;       /**< 90 % of the runs that are not in the ensemble differ by less; NaN with the value */
  float final_value;    /**< at the end of the simulations */
  float final_bound_90; /**< the same bound of it */
} lbea_channel_forecast;

/** Pointers are valid until the next update or reset. */
typedef struct lbea_forecast_state {
  uint32_t struct_size;
  float error_90;     /**< the final shape's mean distance from the truth is below this in 90 % of such tests */
  uint64_t frames;    /**< with evidence; without any, what all runs have in common */
  double test_time_s; /**< of the latest of them */
  const float*
      run_weights; /**< run_count, add up to 1: the final shape is this combination of the runs' last samples */
  const float* branch_probabilities;         /**< branch_count */
  const lbea_parameter_forecast* parameters; /**< parameter_count */
  uint32_t run_count, branch_count, parameter_count;
  uint32_t channel_count;                /**< 0 for models baked before they were learned */
  const lbea_channel_forecast* channels; /**< in the order of the model */
} lbea_forecast_state;

/** Sizes of a model. */
typedef struct lbea_model_info {
  uint32_t struct_size;
  uint32_t vertices, modes;      /**< n and p, of the observed region and its basis */
  uint32_t samples, simulations; /**< of the ensemble */
  uint32_t references;           /**< 1 at impact; time steps over time */
  uint32_t nodes, elements;      /**< of the whole component */
  uint32_t fields;               /**< quantities stored with every sample, e.g. plastic strain */
  uint64_t checksum;             /**< identifies this model */
  const char* length_unit;       /**< lives as long as the model */
  uint32_t parameters;           /**< of the simulations */
  int32_t has_forecast;          /**< 1: lbea_forecast_create accepts the model; else 0 */
} lbea_model_info;

/** A quantity of every element or node of every sample. Text lives as long as the model. */
typedef struct lbea_field_info {
  uint32_t struct_size;
  uint32_t values_per_sample; /**< elements, or nodes */
  const char* name;
  const char* unit;
  float largest_error; /**< of any value: 0 when stored unchanged, else half of a 16-bit step */
} lbea_field_info;

/* About the library. */
LBEA_API uint32_t lbea_version(void);                        /**< LBEA_VERSION of the loaded library */
LBEA_API const char* lbea_build_info(void);                  /**< version, commit, compiler, flags: for bug reports */
LBEA_API const char* lbea_status_string(lbea_status status); /**< stable lower-case name, never NULL */
/** The message of this thread's last failure, with the remedy; "" when there was none. Never NULL; valid until this
 * thread's next failure. */
LBEA_API const char* lbea_last_error(void);

/* Models. */
/** Maps the file read-only and checks it; later reads need no check. *model is NULL unless LBEA_OK is returned. */
LBEA_API lbea_status lbea_model_open(const char* path, lbea_model** model);
/** The same for an image in memory. It must be 64-byte aligned; the caller keeps it alive and unchanged. */
LBEA_API lbea_status lbea_model_open_memory(const void* image, size_t size, lbea_model** model);
/** Matchers keep the memory of their model alive. */
LBEA_API void lbea_model_close(lbea_model* model);
LBEA_API lbea_status lbea_model_get_info(const lbea_model* model, lbea_model_info* info);
LBEA_API lbea_status lbea_model_get_field(const lbea_model* model, uint32_t field, lbea_field_info* info);
/** Quantities of interest that the ensemble description names; 0 when model is NULL. */
LBEA_API uint32_t lbea_model_channel_count(const lbea_model* model);
/** NULL for an index out of range, as with the next five. Lives as long as the model. */
LBEA_API const char* lbea_model_channel_name(const lbea_model* model, uint32_t channel);
LBEA_API const char* lbea_model_channel_unit(const lbea_model* model, uint32_t channel);
LBEA_API const char* lbea_model_simulation_name(const lbea_model* model, uint32_t simulation);
LBEA_API const char* lbea_model_parameter_name(const lbea_model* model, uint32_t parameter);
/** nodes x 3: the sample's whole deformed mesh, including what no camera sees. */
LBEA_API const float* lbea_model_node_positions(const lbea_model* model, uint32_t sample);
/** values_per_sample of the field; NULL also when the field is stored in 16 bits: lbea_model_read_field reads both
 * kinds. */
LBEA_API const float* lbea_model_field_values(const lbea_model* model, uint32_t field, uint32_t sample);
/** Writes values_per_sample of the field; count: how many there is room for. */
LBEA_API lbea_status lbea_model_read_field(const lbea_model* model, uint32_t field, uint32_t sample, float* values,
                                           size_t count);

/* Matching. */
/** The defaults. struct_size is sizeof(lbea_config). */
LBEA_API lbea_status lbea_config_init(lbea_config* config, size_t struct_size);
/** config: NULL for the defaults. *matcher is NULL unless LBEA_OK is returned. */
LBEA_API lbea_status lbea_matcher_create(const lbea_model* model, const lbea_config* config, lbea_matcher** matcher);
LBEA_API void lbea_matcher_destroy(lbea_matcher* matcher);
/** Returns result->status, or LBEA_BAD_ARGUMENT. Set result->struct_size once. */
LBEA_API lbea_status lbea_matcher_match(lbea_matcher* matcher, const lbea_frame* frame, lbea_result* result);
/** The same with what the earlier frames of the test have shown, to which this one adds. While the pose error is not
 * known yet, a frame is matched up to eight times. The history must be of the same model. Other methods than
 * LBEA_METHOD_FIT match as without. */
LBEA_API lbea_status lbea_matcher_match_with_history(lbea_matcher* matcher, const lbea_frame* frame,
                                                     lbea_test_history* history, lbea_result* result);

/* Several rigs that see the same component, by LBEA_METHOD_FIT. The matcher keeps what the frames of the test have
 * shown: there is no history to give. Elements of an array have the struct_size of its first one. */
/** config: NULL for the defaults; its pose and method are not used. rigs: rig_count, 1 to 16. Each rig's depth images
 * are those in the model for the nearest pose. *matcher is NULL unless LBEA_OK is returned. */
LBEA_API lbea_status lbea_rig_matcher_create(const lbea_model* model, const lbea_config* config, const lbea_rig* rigs,
                                             uint32_t rig_count, lbea_rig_matcher** matcher);
LBEA_API void lbea_rig_matcher_destroy(lbea_rig_matcher* matcher);
/** frames: one per rig, in their order, captured at nearly the same time; without points: the rig has none. Their
 * number must be that of the rigs. The result is for the time of the first frame that it rests on. Returns
 * result->status, or LBEA_BAD_ARGUMENT, and then has matched none. As real-time safe as lbea_matcher_match. */
LBEA_API lbea_status lbea_rig_matcher_match(lbea_rig_matcher* matcher, const lbea_frame* frames, uint32_t frame_count,
                                            lbea_result* result);
/** The same in two steps: this for each rig with a frame, which different threads may do at the same time for different
 * rigs; then lbea_rig_matcher_combine. Points must remain valid until then. Of several frames of a rig, the last one
 * counts. */
LBEA_API lbea_status lbea_rig_matcher_match_alone(lbea_rig_matcher* matcher, uint32_t rig, const lbea_frame* frame);
LBEA_API lbea_status lbea_rig_matcher_combine(lbea_rig_matcher* matcher, lbea_result* result);
/** What the rig's frame said in the last capture. Set result->struct_size once. */
LBEA_API lbea_status lbea_rig_matcher_get_rig(const lbea_rig_matcher* matcher, uint32_t rig, lbea_rig_result* result);
/** The rigs' poses are exact: their errors are neither estimated nor corrected. Call it between captures. */
LBEA_API void lbea_rig_matcher_fix_poses(lbea_rig_matcher* matcher);
/** The impact's stamp, by the clock that the offsets lead to, is known, also for later tests. */
LBEA_API void lbea_rig_matcher_set_impact(lbea_rig_matcher* matcher, int64_t stamp_ns);
/** The next capture is the first of another test. */
LBEA_API void lbea_rig_matcher_reset(lbea_rig_matcher* matcher);

/* What the frames of a test have shown: the error of T_reference_sensor, the shape some time ago, the clock. */
/** One per test: give it to lbea_matcher_match_with_history with each frame, in order, with stamps. *history is NULL
 * unless LBEA_OK is returned. The model may be closed. */
LBEA_API lbea_status lbea_test_history_create(const lbea_model* model, lbea_test_history** history);
LBEA_API void lbea_test_history_destroy(lbea_test_history* history);
/** Starts another test with the next frame. */
LBEA_API void lbea_test_history_reset(lbea_test_history* history);
/** T_reference_sensor is exact: the pose error is neither estimated nor corrected. */
LBEA_API void lbea_test_history_fix_pose(lbea_test_history* history);
/** The impact's stamp is known, also for later tests: it is not estimated. */
LBEA_API void lbea_test_history_set_impact(lbea_test_history* history, int64_t stamp_ns);
/** 1 when the pose error is estimated: the model has depth images, the bake has learned how certain they are, and the
 * pose is not fixed; else 0. */
LBEA_API int32_t lbea_test_history_estimates_pose(const lbea_test_history* history);
/** The motion that corrects the frames, in reference coordinates, after T_reference_sensor. T: 12 values, row-major
 * 3x4, its last column in the length unit; the identity before the first frame. */
LBEA_API lbea_status lbea_test_history_get_pose_correction(const lbea_test_history* history, float* T);

/* Over time. */
/** One per test. *tracker is NULL unless LBEA_OK is returned. */
LBEA_API lbea_status lbea_tracker_create(const lbea_model* model, lbea_tracker** tracker);
LBEA_API void lbea_tracker_destroy(lbea_tracker* tracker);
/** Adds the matcher's last result. The matcher must be of the same model. Call it once per frame, in order. As
 * real-time safe as matching; cost linear in the samples. Set state->struct_size once. */
LBEA_API lbea_status lbea_tracker_update(lbea_tracker* tracker, const lbea_matcher* matcher, lbea_test_state* state);

/** The same for a capture of several rigs. */
LBEA_API lbea_status lbea_tracker_update_by_rigs(lbea_tracker* tracker, const lbea_rig_matcher* matcher,
                                                 lbea_test_state* state);

/** One per test; LBEA_BAD_CONFIG for a model whose bake has learned no forecast. *forecast is NULL unless LBEA_OK is
 * returned. */
LBEA_API lbea_status lbea_forecast_create(const lbea_model* model, lbea_forecast** forecast);
LBEA_API void lbea_forecast_destroy(lbea_forecast* forecast);
/** Starts another test with the next frame. */
LBEA_API void lbea_forecast_reset(lbea_forecast* forecast);
/** Adds the matcher's last result, of a match by LBEA_METHOD_FIT with a history. As real-time safe as matching. Set
 * state->struct_size once. matcher: NULL to add nothing. */
LBEA_API lbea_status lbea_forecast_update(lbea_forecast* forecast, const lbea_matcher* matcher,
                                          lbea_forecast_state* state);
/** The same for a capture of several rigs. */
LBEA_API lbea_status lbea_forecast_update_by_rigs(lbea_forecast* forecast, const lbea_rig_matcher* matcher,
                                                  lbea_forecast_state* state);
/** Writes the final node positions of the present forecast, nodes x 3; count: how many values there is room for. */
LBEA_API lbea_status lbea_forecast_get_final_positions(const lbea_forecast* forecast, float* positions, size_t count);

#ifdef __cplusplus
}
#endif
#endif
