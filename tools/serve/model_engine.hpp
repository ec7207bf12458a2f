// The baked model behind the pipeline's seam.
#pragma once

#include "tools/serve/pipeline.hpp"

namespace lbea {

class ModelEngine final : public MatchEngine {
 public:
  ModelEngine(const Model& model, const MatcherConfig& config) : matcher_(model, config) {}
  MatchResult match(const Frame& frame) noexcept override { return matcher_.match(frame); }
  [[nodiscard]] std::string_view simulation_name(std::uint32_t simulation) const noexcept override {
    return matcher_.model().simulation_name(simulation);
  }
  [[nodiscard]] double time_s(Sample sample) const noexcept override {
    const Model& model = matcher_.model();
    const std::uint32_t index = model.sample_index(sample);
    return index < model.samples() ? model.sample_time_s(index) : 0;
  }

 private:
  Matcher matcher_;
};

/// What subscribers are told about the model.
ModelSummary summarize(const Model& model, const std::string& file);

}  // namespace lbea
