// What lbea-serve matches the frames of its rigs with.
#pragma once

#include "tools/shared/recording/rig_settings.hpp"

#include <lbea/rigs.hpp>

namespace lbea::tool {

/// Those of the model, or rendered. Throws Error{bad_config | bad_input}.
[[nodiscard]] SensorViews views_for(const NamedRig& rig, const MatcherConfig& config, const Model& model);
/// For a RigMatcher. Throws the same.
[[nodiscard]] std::vector<Rig> matched_rigs(const std::vector<NamedRig>& rigs, const MatcherConfig& config,
                                            const Model& model);

}  // namespace lbea::tool
