#include "tools/shared/matching/model_engine.hpp"

namespace lbea::tool {

wire::ModelSummary summarize(const Model& model, const std::string& file) {
  wire::ModelSummary summary{file,
                             model.checksum(),
                             model.vertices(),
                             model.modes(),
                             model.samples(),
                             model.references(),
                             std::string(model.length_unit()),
                             {}};
  for (std::uint32_t i = 0; i < model.simulations(); ++i) summary.simulations.emplace_back(model.simulation_name(i));
  return summary;
}

}  // namespace lbea::tool
