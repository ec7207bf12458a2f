#include "tools/serve/handover.hpp"

namespace lbea::tool {
namespace {
constexpr std::size_t outcome_slots = 64;
constexpr std::size_t refusal_slots = 4096;
}  // namespace

Handover::Handover(const PipelineConfig& config)
    : frames(config.queue_slots), outcomes(outcome_slots), refusals(refusal_slots) {
  for (FrameSlot& slot : frames.slots()) slot.points.resize(config.limits.max_points);
  for (Outcome& outcome : outcomes.slots()) reserve(outcome, config.max_matches);
}

}  // namespace lbea::tool
