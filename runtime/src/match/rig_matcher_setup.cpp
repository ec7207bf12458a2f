// The construction of a matcher for several rigs.
#include "runtime/src/match/rig_matcher.hpp"

namespace lbea {
namespace {

MatcherConfig config_of(const Rig& rig, MatcherConfig config) {
  config.method = Method::fit;
  config.T_reference_sensor = rig.T_reference_sensor;
  return config;
}

void require(bool holds, std::size_t rig, const std::string& sentence) {
  if (!holds) throw Error(Status::bad_config, "rig " + std::to_string(rig + 1) + ": " + sentence);
}

/// The first rig's. Throws if another rig's are not those of the same samples.
const DepthImages& common_images(const std::vector<SensorViews>& views) {
  const DepthImages& first = *views.front().data();
  for (std::size_t rig = 1; rig < views.size(); ++rig)
    require(std::ranges::equal(views[rig].data()->regression.shapes, first.regression.shapes), rig,
            "its depth images are not those of the same model as the first rig's; render them for the model");
  return first;
}

SensorViews views_of(const Rig& rig, const Model& model) {
  return rig.views.empty() ? SensorViews::baked_into(model, rig.T_reference_sensor) : rig.views;
}

std::vector<SensorViews> views_of(const std::vector<Rig>& rigs, const Model& model) {
  std::vector<SensorViews> views;
  for (const Rig& rig : rigs) views.push_back(views_of(rig, model));
  return views;
}

}  // namespace

void require_rig_count(std::size_t rigs) {
  if (rigs == 0 || rigs > most_rigs)
    throw Error(Status::bad_config, std::to_string(rigs) + " rigs; give 1 to " + std::to_string(most_rigs));
}

RigMatcher::State::State(const Model& model, const MatcherConfig& config, const std::vector<Rig>& rigs)
    : views(views_of(rigs, model)),
      captures(rigs.size()),
      results(rigs.size()),
      corrections_ns(rigs.size()),
      measured_clocks(rigs.size()),
      poses_by_all(rigs.size()),
      evidence(rigs.size()),
      times(EnsembleTimes::of(model.view())),
      joint_history(model.view(), units_per_mm(model.length_unit()), views.front().data()),
      fitter(model.view(), common_images(views), rigs.size(), config.max_matches) {
  for (std::size_t rig = 0; rig < rigs.size(); ++rig) {
    offsets_ns.push_back(rigs[rig].clock_offset_ns);
    matchers.push_back(std::make_unique<Matcher::State>(model, config_of(rigs[rig], config), views[rig],
                                                        FitSettings{}.joint_candidates));
    histories.emplace_back(model.view(), units_per_mm(model.length_unit()), views[rig].data());
    poses_before.push_back(histories.back().pose);
  }
}

RigMatcher::RigMatcher(Model model, const MatcherConfig& config, const std::vector<Rig>& rigs) {
  require_rig_count(rigs.size());
  for (std::size_t rig = 0; rig < rigs.size(); ++rig) {
    try {
      check(config_of(rigs[rig], config), model.view(), views_of(rigs[rig], model));
    } catch (const Error& error) { throw Error(error.status, "rig " + std::to_string(rig + 1) + ": " + error.what()); }
  }
  state_ = std::make_unique<State>(model, config, rigs);
  for (std::size_t rig = 0; rig < rigs.size(); ++rig)
    require(state_->fitter_of(rig).search().proposes(), rig,
            "the model has too many samples for several rigs; match the first rig's frames by Matcher");
}
RigMatcher::~RigMatcher() = default;
RigMatcher::RigMatcher(RigMatcher&&) noexcept = default;
RigMatcher& RigMatcher::operator=(RigMatcher&&) noexcept = default;

}  // namespace lbea
