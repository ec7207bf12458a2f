#include "runtime/src/track/coupled_test.hpp"

namespace lbea {
namespace {

void require(bool holds, const char* name, float value, const char* range) {
  if (!holds)
    throw Error(Status::bad_config,
                std::string("tracker configuration: ") + name + " is " + std::to_string(value) + "; give " + range);
}

void check(const TrackerConfig& config) {
  require(config.sharpness > 0 && std::isfinite(config.sharpness), "sharpness", config.sharpness, "a positive number");
  require(config.noise >= 0 && std::isfinite(config.noise), "noise", config.noise, "a length, or 0 for the default");
  require(config.persistence >= 0 && config.persistence < 1, "persistence", config.persistence,
          "a share from 0 to below 1");
  require(config.change >= 0 && config.change <= 1, "change", config.change, "a share from 0 to 1");
}

void require_same_runs(std::span<const TrackedComponent> components) {
  if (components.empty()) throw Error(Status::bad_config, "the tracker of a test needs at least one component");
  for (const TrackedComponent& component : components.subspan(1))
    if (const std::string difference = difference_of_runs(components.front().model, component.model);
        !difference.empty())
      throw Error(Status::bad_config, "these components cannot be tracked as one test, because " + difference +
                                          "; bake them from the same runs, or track each alone");
}

}  // namespace

struct Tracker::State {
  CoupledTest test;
};

Tracker::Tracker(Model model, const TrackerConfig& config, SensorViews views) {
  check(config);
  TrackedComponent only{std::move(model), std::move(views)};
  state_.reset(new State{CoupledTest({&only, 1}, config)});
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
const TestState& Tracker::state() const noexcept { return state_->test.state(0); }
void Tracker::reset() noexcept { state_->test.reset(); }
const TestState& Tracker::update(const MatchResult& result) noexcept {
  state_->test.update({&result, 1});
  return state();
}

struct ComponentTracker::State {
  CoupledTest test;
};

ComponentTracker::ComponentTracker(std::vector<TrackedComponent> components, const TrackerConfig& config) {
  check(config);
  require_same_runs(components);
  state_.reset(new State{CoupledTest(components, config)});
}
ComponentTracker::~ComponentTracker() = default;
ComponentTracker::ComponentTracker(ComponentTracker&&) noexcept = default;
ComponentTracker& ComponentTracker::operator=(ComponentTracker&&) noexcept = default;
void ComponentTracker::update(std::span<const MatchResult> results) noexcept { state_->test.update(results); }
const TestState& ComponentTracker::state(std::size_t component) const noexcept { return state_->test.state(component); }
std::size_t ComponentTracker::components() const noexcept { return state_->test.components(); }
void ComponentTracker::reset() noexcept { state_->test.reset(); }

}  // namespace lbea
