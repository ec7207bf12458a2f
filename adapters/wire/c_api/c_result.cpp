// The C interface to the content of results.
#include "adapters/wire/c_api/c_receiver.hpp"

#include <lbea/lbea.h>

using namespace lbea;
using namespace lbea::wire;

namespace lbea::wire {
namespace {
constexpr bool is_same(lbea_wire_frame_status c, WireStatus status) { return c == static_cast<int>(status); }
static_assert(is_same(LBEA_WIRE_FRAME_OK, WireStatus::ok) &&
              is_same(LBEA_WIRE_FRAME_LOW_COVERAGE, WireStatus::low_coverage) &&
              is_same(LBEA_WIRE_FRAME_EMPTY, WireStatus::empty_frame) &&
              is_same(LBEA_WIRE_FRAME_TOO_MANY_POINTS, WireStatus::too_many_points) &&
              is_same(LBEA_WIRE_FRAME_TOO_LARGE, WireStatus::message_too_large) &&
              is_same(LBEA_WIRE_FRAME_WRONG_KIND, WireStatus::wrong_kind) &&
              is_same(LBEA_WIRE_FRAME_DAMAGED, WireStatus::damaged) &&
              is_same(LBEA_WIRE_FRAME_BAD_CLOUD, WireStatus::bad_cloud) &&
              is_same(LBEA_WIRE_FRAME_BAD_LAYOUT, WireStatus::bad_layout) &&
              is_same(LBEA_WIRE_FRAME_BAD_FIELDS, WireStatus::bad_fields) &&
              is_same(LBEA_WIRE_FRAME_BAD_STAMP, WireStatus::bad_stamp) &&
              is_same(LBEA_WIRE_FRAME_UNSUPPORTED_POSE, WireStatus::unsupported_pose) &&
              is_same(LBEA_WIRE_FRAME_QUEUE_FULL, WireStatus::queue_full) &&
              is_same(LBEA_WIRE_FRAME_END_OF_TEST, WireStatus::end_of_stream) &&
              is_same(LBEA_WIRE_FRAME_MISSED, WireStatus::missed) &&
              is_same(LBEA_WIRE_FRAME_WITHHELD, WireStatus::withheld) &&
              is_same(LBEA_WIRE_FRAME_DUPLICATE, WireStatus::duplicate) &&
              is_same(LBEA_WIRE_FRAME_OTHER_SENDER, WireStatus::other_sender) &&
              is_same(LBEA_WIRE_FRAME_OUT_OF_STEP, WireStatus::out_of_step) && wire_status_count == 19);
static_assert(LBEA_WIRE_MATCHED == static_cast<int>(Fate::matched) &&
              LBEA_WIRE_REJECTED == static_cast<int>(Fate::rejected) &&
              LBEA_WIRE_DROPPED == static_cast<int>(Fate::dropped) &&
              LBEA_WIRE_NOT_A_CAPTURE == static_cast<int>(Fate::not_a_capture));
static_assert(LBEA_WIRE_VERDICT_UNKNOWN == static_cast<int>(WireVerdict::unknown) &&
              LBEA_WIRE_VERDICT_MATCHED == static_cast<int>(WireVerdict::matched) &&
              LBEA_WIRE_VERDICT_LOW_COVERAGE == static_cast<int>(WireVerdict::low_coverage) &&
              LBEA_WIRE_VERDICT_REFUSED == static_cast<int>(WireVerdict::refused) &&
              LBEA_WIRE_VERDICT_AMBIGUOUS == static_cast<int>(WireVerdict::ambiguous) &&
              LBEA_WIRE_VERDICT_NO_SIMULATION_FITS == static_cast<int>(WireVerdict::no_simulation_fits));

constexpr std::size_t least_test = offsetof(lbea_wire_test, branch_probabilities) + sizeof(const float*);

lbea_wire_verdict verdict_of(const auto& judged) noexcept { return static_cast<lbea_wire_verdict>(judged.verdict); }

void copy_numbers(const WireResult& from, lbea_wire_result& to) noexcept {
#define LBEA_COPY(name) to.name = from.name;
  LBEA_FRAME_NUMBERS(LBEA_COPY)
#undef LBEA_COPY
#define LBEA_COPY(name) to.name = from.fit.name;
  LBEA_FIT_NUMBERS(LBEA_COPY)
#undef LBEA_COPY
  std::ranges::copy(from.leading_coordinates, to.leading_coordinates);
  to.points_received = from.points.received;
  to.points_invalid = from.points.invalid;
  to.points_culled = from.points.culled;
  to.points_used = from.points.used;
}

void copy_times(const WireTimes& from, lbea_wire_result& to) noexcept {
  to.decode_ns = from.decode;
  to.queue_ns = from.queue;
  to.index_ns = from.match.index;
  to.correspondence_ns = from.match.correspondence;
  to.projection_ns = from.match.projection;
  to.matching_ns = from.match.matching;
  to.coverage_ns = from.match.coverage;
  to.fit_ns = from.match.fit;
  to.total_ns = from.total;
}

/// Fills `into` and gives its begin and size to the struct.
template <class From, class To, class Convert>
void list(const std::vector<From>& from, std::vector<To>& into, const To*& begin, std::uint32_t& count,
          Convert&& convert) {
  into.resize(from.size());
  std::ranges::transform(from, into.begin(), convert);
  begin = into.data();
  count = static_cast<std::uint32_t>(into.size());
}

lbea_wire_rig_frame rig_frame_of(const WireRigFrame& frame) noexcept {
  return {frame.rig.c_str(),
          frame.session,
          frame.frame_id,
          frame.stamp_ns,
          static_cast<lbea_wire_frame_status>(frame.status),
          verdict_of(frame),
          frame.is_used ? 1 : 0,
          frame.points.used,
          frame.coverage,
          frame.misfit,
          frame.pose_turn,
          frame.pose_shift,
          frame.clock_correction_ns};
}
}  // namespace
}  // namespace lbea::wire

lbea_wire_result lbea_wire_receiver::to_c(const WireResult& from) {
  lbea_wire_result to{};
  to.status = static_cast<lbea_wire_frame_status>(from.status);
  to.fate = static_cast<lbea_wire_fate>(fate_of(from.status));
  to.verdict = verdict_of(from);
  to.sequence = from.sequence;
  to.session = from.session;
  to.frame_id = from.frame_id;
  to.stamp_ns = from.stamp_ns;
  to.receive_ns = from.receive_ns;
  to.publish_ns = from.publish_ns;
  to.model_checksum = from.model_checksum;
  to.reference = from.reference;
  to.component = from.component.c_str();
  copy_numbers(from, to);
  copy_times(from.elapsed_ns, to);
  list(from.matches, matches, to.matches, to.match_count, [](const WireMatch& m) {
    return lbea_wire_match{m.sample.simulation, m.sample.time_step, m.simulation_name.c_str(), m.time_s, m.distance};
  });
  list(from.fit.candidates, candidates, to.candidates, to.candidate_count, [](const Match& c) {
    return lbea_wire_candidate{c.sample.simulation, c.sample.time_step, c.distance};
  });
  list(from.fit.estimate, estimate, to.estimate, to.estimate_count, [](const WeightedSample& s) {
    return lbea_wire_share{s.sample.simulation, s.sample.time_step, s.weight};
  });
  list(from.channels, channels, to.channels, to.channel_count, [](const WireChannel& c) {
    return lbea_wire_channel{c.name.c_str(), c.unit.c_str(), c.value, c.bound_90, c.end.value, c.end.bound_90};
  });
  list(from.rigs, rigs, to.rigs, to.rig_count, rig_frame_of);
  chances.clear();
  for (const SimulationChance& c : from.test.simulations) chances.push_back({c.simulation, c.probability});
  return to;
}

lbea_wire_status lbea_wire_receiver_get_test(const lbea_wire_receiver* receiver, lbea_wire_test* test) {
  if (receiver == nullptr || test == nullptr)
    return bad_argument("lbea_wire_receiver_get_test: receiver or test is NULL");
  if (receiver->latest == nullptr || receiver->pending != nullptr || receiver->latest->test.frames == 0)
    return failed(LBEA_WIRE_UNKNOWN, "no frame of this test has evidence yet; only the method fit judges whole tests");
  const WireTestState& from = receiver->latest->test;
  lbea_wire_test to{};
  to.verdict = verdict_of(from);
  to.frames = from.frames;
  to.simulation = from.simulation;
  to.sample_simulation = from.sample.simulation;
  to.sample_step = from.sample.time_step;
  to.sample_probability = from.sample_probability;
  to.misfit = from.misfit;
  to.chances = receiver->chances.data();
  to.chance_count = static_cast<std::uint32_t>(receiver->chances.size());
  to.branch_probabilities = from.branches.data();
  to.branch_count = static_cast<std::uint32_t>(from.branches.size());
  return write_out(to, test, least_test);
}
