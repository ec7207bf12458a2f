// Channels whose nodes a run loses.
#pragma once

namespace lbea::bake {

struct BakePlan;
class WorkFolder;

/// A node whose elements are all eroded flies freely, and its motion is no quantity of the component. plan: with
/// channels. Reads states only of runs that erode around a channel's node. Throws Error{bad_config} naming channel,
/// node, run and state when a node is free in a used state, and Error{bad_input}.
void refuse_free_channel_nodes(const WorkFolder& work, const BakePlan& plan);

}  // namespace lbea::bake
