// The nodes and elements of the channels that an ensemble description names.
#pragma once

#include "precompute/channels/channel_series.hpp"
#include "precompute/survey/reference.hpp"

namespace lbea::bake {

struct BakePlan;

/// Sets plan.channels. A point takes the nearest vertex of the observed region in the reference mesh. plan: after the
/// survey. Throws Error{bad_config} naming the channel: a name that is empty, used twice or has control characters; an
/// unknown node; a point farther from the vertex than `reach` or, if that is not given, than the mean length of the
/// edges there; a wrong number of points; a history without a unit; a class where nothing is filtered, or none; a field
/// that is not stored; parts or elements that the common mesh does not have.
void plan_channels(BakePlan& plan, const Reference& reference);

}  // namespace lbea::bake
