// The models that lbea-serve matches with: of one component, or of several in the same frames.
#pragma once

#include "tools/serve/rigs.hpp"
#include "tools/shared/matching/component_engine.hpp"
#include "tools/shared/matching/named_models.hpp"

namespace lbea::tool {

/// For a ModelComponents, with the depth images of each component between the others of its test. Throws as views_for()
/// and assembled_views() do.
[[nodiscard]] std::vector<ComponentModel> matched_components(const std::vector<NamedModel>& models, const NamedRig& rig,
                                                             const MatcherConfig& config);

}  // namespace lbea::tool
