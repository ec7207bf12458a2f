// Parts of results as JSON that several programs print.
#pragma once

#include "adapters/wire/codec/messages.hpp"

namespace lbea::tool {

/// The numbers of method fit, the frames of several rigs and the quantities of interest, if the result has them. Json:
/// of nlohmann.
template <class Json>
void add_details(Json& json, const wire::WireResult& result) {
  for (const auto& number : fit_numbers)
    if (!result.fit.candidates.empty()) json["fit"][number.name] = result.fit.*number.value;
  for (const wire::WireRigFrame& frame : result.rigs)
    json["rigs"].push_back({{"rig", frame.rig},
                            {"session", frame.session},
                            {"frame", frame.frame_id},
                            {"status", wire::to_string(frame.status)},
                            {"verdict", wire::to_string(frame.verdict)},
                            {"is_used", frame.is_used},
                            {"coverage", frame.coverage},
                            {"misfit", frame.misfit},
                            {"pose_turn", frame.pose_turn},
                            {"pose_shift", frame.pose_shift},
                            {"clock_correction_ns", frame.clock_correction_ns}});
  for (const wire::WireChannel& channel : result.channels)
    json["channels"].push_back({{"name", channel.name},
                                {"unit", channel.unit},
                                {"value", channel.value},
                                {"bound_90", channel.bound_90},
                                {"end_value", channel.end.value},
                                {"end_bound_90", channel.end.bound_90}});
}

}  // namespace lbea::tool
