// The baked model behind the pipeline's seam.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/matching/match_engine.hpp"

#include <optional>
#include <utility>

namespace lbea::tool {

class ModelEngine final : public MatchEngine {
 public:
  ModelEngine(const Model& model, const MatcherConfig& config, SensorViews views = {})
      : matcher_(model, config, views) {
    if (config.method == Method::fit) tracker_.emplace(model, TrackerConfig{}, std::move(views));
  }
  MatchResult match(const Frame& frame) noexcept override { return matcher_.match(frame); }
  const TestState* track(const MatchResult& result) noexcept override {
    return tracker_ ? &tracker_->update(result) : nullptr;
  }
  void begin_test() noexcept override {
    if (tracker_) tracker_->reset();
  }
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
  std::optional<Tracker> tracker_;
};

/// What subscribers are told about the model.
wire::ModelSummary summarize(const Model& model, const std::string& file);

}  // namespace lbea::tool
