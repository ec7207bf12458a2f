#include "precompute/channels/free_channel_nodes.hpp"

#include "precompute/survey/surface_continuation.hpp"
#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {
namespace {

/// Per node of the reference run: whether a run has one of its elements on the surface in all used states.
std::vector<std::uint8_t> lasting_nodes(const SimulationMesh& reference, const RunHistory& history) {
  std::vector<std::uint8_t> lasting(reference.nodes());
  for (std::size_t e = 0; e < reference.elements.size(); ++e)
    if (history.common.at(e) == Presence::always)
      for (const std::uint32_t node : reference.elements[e]) lasting[node] = 1;
  return lasting;
}

[[noreturn]] void refuse(const PlannedChannel& channel, std::uint32_t node_id, const std::string& run,
                         std::uint32_t step) {
  throw Error(Status::bad_config, "channel '" + channel.name + "' has node " + std::to_string(node_id) +
                                      ", which flies freely in run " + run + ", state " + std::to_string(step) +
                                      ": all of its elements are eroded; choose another node");
}

void refuse_free_nodes(const BakePlan& plan, std::size_t run) {
  const std::string& name = plan.ensemble.runs[run].name;
  const auto reader = plan.ensemble.runs[run].open();
  const MeshMapping mapping = map_common(plan.survey.mesh, reader->mesh(), name);
  SimulationState state;
  for (const std::uint32_t step : plan.survey.runs[run].steps) {
    reader->read(step, state);
    const std::vector<std::uint8_t> is_free = free_nodes(reader->mesh(), state.alive);
    for (const PlannedChannel& channel : plan.channels)
      for (const std::uint32_t node : channel.nodes)
        if (is_free[mapping.nodes[node]] != 0) refuse(channel, plan.survey.mesh.node_ids[node], name, step);
  }
}

}  // namespace

void refuse_free_channel_nodes(const WorkFolder& work, const BakePlan& plan) {
  if (!plan.survey.lacks_elements()) return;
  const SimulationMesh reference = plan.ensemble.runs[plan.ensemble.reference_run].open()->mesh();
  const std::vector<std::uint32_t> places = reference_places(plan.survey);
  for (std::size_t run = 0; run < plan.survey.runs.size(); ++run) {
    if (!plan.survey.runs[run].lacks_elements) continue;
    const std::vector<std::uint8_t> lasting = lasting_nodes(reference, read_survey(work, plan.runs[run]));
    const auto may_be_free = [&](const PlannedChannel& channel) {
      return std::ranges::any_of(channel.nodes, [&](std::uint32_t node) { return lasting[places[node]] == 0; });
    };
    if (std::ranges::any_of(plan.channels, may_be_free)) refuse_free_nodes(plan, run);
  }
}

}  // namespace lbea::bake
