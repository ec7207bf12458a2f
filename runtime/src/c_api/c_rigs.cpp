// The C interface to matching the frames of several rigs.
#include "runtime/src/c_api/c_support.hpp"
#include "runtime/src/match/rig_matcher.hpp"

namespace lbea {
namespace {
// Sizes of the structs in the first version that had them: every caller knows at least these fields.
constexpr std::size_t least_rig = sizeof(lbea_rig), least_rig_result = sizeof(lbea_rig_result);

/// Of an array whose structs have the size that the caller was compiled with.
template <typename T>
const T& element(const T* first, std::size_t i) noexcept {
  return *reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(first) + i * first->struct_size);
}

/// Throws Error{bad_config}.
Rig read(const lbea_rig& rig) {
  lbea_rig full{};
  if (!is_plausible_size(rig.struct_size, least_rig)) throw Error(Status::bad_config, std::string(size_not_set));
  if (!read_c_struct(&rig, full))
    throw Error(Status::bad_config, "a rig sets a field this older library does not know");
  return {std::to_array(full.T_reference_sensor), {}, full.clock_offset_ns};
}

/// Returns what is wrong with them, or nothing; then into: one per rig.
std::string_view read(const lbea_rig_matcher* matcher, const lbea_frame* frames, std::uint32_t count,
                      std::span<Frame> into) noexcept {
  if (matcher == nullptr || frames == nullptr) return "lbea_rig_matcher: matcher or frames is NULL";
  if (count != matcher->matcher.rigs().size()) return "lbea_rig_matcher_match: give one frame per rig";
  std::string_view wrong;
  for (std::size_t rig = 0; rig < count && wrong.empty(); ++rig) wrong = read(element(frames, rig), into[rig]);
  return wrong;
}

lbea_rig_result to_c(const RigResult& result) noexcept {
  lbea_rig_result c{};
  c.status = to_c(result.status);
  c.verdict = to_c(result.verdict);
  c.is_used = result.is_used ? 1 : 0;
  c.points_received = result.points.received;
  c.points_invalid = result.points.invalid;
  c.points_culled = result.points.culled;
  c.points_used = result.points.used;
  c.clock_correction_ns = result.clock_correction_ns;
#define LBEA_COPY(name) c.name = result.name;
  LBEA_FRAME_NUMBERS(LBEA_COPY)
  LBEA_FIT_NUMBERS(LBEA_COPY)
#undef LBEA_COPY
  return c;
}
}  // namespace
}  // namespace lbea

using namespace lbea;

lbea_status lbea_rig_matcher_create(const lbea_model* model, const lbea_config* config, const lbea_rig* rigs,
                                    uint32_t rig_count, lbea_rig_matcher** matcher) {
  if (matcher == nullptr)
    return bad_argument("lbea_rig_matcher_create: matcher is NULL; give the address of a pointer");
  *matcher = nullptr;
  if (model == nullptr || rigs == nullptr) return bad_argument("lbea_rig_matcher_create: model or rigs is NULL");
  MatcherConfig full;
  if (const lbea_status refusal = read(config, full); refusal != LBEA_OK) return refusal;
  return guarded([&] {
    require_rig_count(rig_count);
    std::vector<Rig> all;
    for (std::size_t rig = 0; rig < rig_count; ++rig) all.push_back(read(element(rigs, rig)));
    *matcher = new lbea_rig_matcher(model->model, full, all);
    return LBEA_OK;
  });
}

void lbea_rig_matcher_destroy(lbea_rig_matcher* matcher) { delete matcher; }

lbea_status lbea_rig_matcher_match(lbea_rig_matcher* matcher, const lbea_frame* frames, uint32_t frame_count,
                                   lbea_result* result) {
  std::array<Frame, most_rigs> given;
  if (const auto refusal = begin_result(result, read(matcher, frames, frame_count, given)); refusal != LBEA_OK)
    return refusal;
  return matcher->result.write(matcher->matcher.match(std::span(given).first(frame_count)), result);
}

lbea_status lbea_rig_matcher_match_alone(lbea_rig_matcher* matcher, uint32_t rig, const lbea_frame* frame) {
  if (matcher == nullptr || frame == nullptr || rig >= matcher->matcher.rigs().size())
    return bad_argument("lbea_rig_matcher_match_alone: matcher or frame is NULL, or there is no such rig");
  Frame given;
  if (const std::string_view wrong = read(*frame, given); !wrong.empty()) return bad_argument(wrong);
  matcher->matcher.match_alone(rig, given);
  return LBEA_OK;
}

lbea_status lbea_rig_matcher_combine(lbea_rig_matcher* matcher, lbea_result* result) {
  constexpr std::string_view is_null = "lbea_rig_matcher_combine: matcher is NULL";
  if (const auto refusal = begin_result(result, matcher == nullptr ? is_null : ""); refusal != LBEA_OK) return refusal;
  return matcher->result.write(matcher->matcher.combine(), result);
}

lbea_status lbea_rig_matcher_get_rig(const lbea_rig_matcher* matcher, uint32_t rig, lbea_rig_result* result) {
  if (matcher == nullptr || result == nullptr || rig >= matcher->matcher.rigs().size())
    return bad_argument("lbea_rig_matcher_get_rig: matcher or result is NULL, or there is no such rig");
  if (!is_plausible_size(result->struct_size, least_rig_result)) return bad_argument(size_not_set);
  lbea_rig_result c = to_c(matcher->matcher.rigs()[rig]);
  std::ranges::copy(matcher->matcher.pose_correction(rig), c.pose_correction);
  write_c_struct(c, result);
  return LBEA_OK;
}

void lbea_rig_matcher_fix_poses(lbea_rig_matcher* matcher) {
  if (matcher != nullptr) matcher->matcher.fix_poses();
}

void lbea_rig_matcher_set_impact(lbea_rig_matcher* matcher, int64_t stamp_ns) {
  if (matcher != nullptr) matcher->matcher.set_impact(stamp_ns);
}

void lbea_rig_matcher_reset(lbea_rig_matcher* matcher) {
  if (matcher != nullptr) matcher->matcher.reset();
}
