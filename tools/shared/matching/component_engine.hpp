// The matchers of several components, as the pipeline and the replay use them.
#pragma once

#include "tools/shared/matching/match_engine.hpp"
#include "tools/shared/matching/points_near_none.hpp"

#include <lbea/components.hpp>

#include <deque>
#include <filesystem>

namespace lbea::tool {

/// Interface between the pipeline and the matchers of several components, of one rig; tests replace it here.
class ComponentEngine {
 public:
  virtual ~ComponentEngine() = default;
  [[nodiscard]] virtual std::size_t components() const noexcept = 0;
  /// What sums up the test of one component; track() belongs to track_all().
  [[nodiscard]] virtual TestEngine& test(std::size_t component) noexcept = 0;
  /// Threads with different components may call it side by side. The spans of the result are valid until the next call
  /// with the same.
  virtual MatchResult match(const Frame& frame, std::size_t component) noexcept = 0;
  /// Adds what all components say about a frame, before the tests of the components.
  virtual void track_all(std::span<const MatchResult> results) noexcept = 0;
  /// Of a frame that all components have matched: how many points are near no simulation of any.
  [[nodiscard]] virtual std::uint32_t points_near_none(const Frame&) const noexcept { return 0; }
  /// The next frame is the first of another session.
  virtual void begin_test() noexcept = 0;
};

/// A component is named after its model's file, without folder and extension.
[[nodiscard]] std::string component_name(std::string_view model_file);

/// A component with its model.
struct ComponentModel {
  std::string name;
  Model model;
  SensorViews views{};
};

/// Which components are one test: those with the same runs. Numbers of components, each once.
[[nodiscard]] std::vector<std::vector<std::size_t>> coupled(const std::vector<ComponentModel>& components);

/// What the components of one test tell of each other, for a line of the log: "hood and fender as one run", or why
/// not.
[[nodiscard]] std::string coupling_text(const std::vector<ComponentModel>& components);

/// The tracked state of a component, which the tracker of all has.
class ComponentTest final : public ModelTest<TestEngine> {
 public:
  ComponentTest(const Model& model, Method method, const SensorViews& views)
      : ModelTest(model, method, views, Tracked::elsewhere) {}
  const TestState* track(const MatchResult&) noexcept override { return state_; }
  void set(const TestState* state) noexcept { state_ = state; }

 private:
  const TestState* state_ = nullptr;
};

class ModelComponents final : public ComponentEngine {
 public:
  /// Components with the same runs are tracked as one test.
  ModelComponents(const std::vector<ComponentModel>& components, const MatcherConfig& config,
                  const HistorySettings& settings);
  [[nodiscard]] std::size_t components() const noexcept override { return tests_.size(); }
  [[nodiscard]] TestEngine& test(std::size_t component) noexcept override { return tests_[component]; }
  MatchResult match(const Frame& frame, std::size_t component) noexcept override {
    near_none_.mark(component, frame.points);
    return histories_.empty() ? matchers_[component].match(frame)
                              : matchers_[component].match(frame, histories_[component]);
  }
  void track_all(std::span<const MatchResult> results) noexcept override;
  [[nodiscard]] std::uint32_t points_near_none(const Frame& frame) const noexcept override {
    return near_none_.count(frame.points);
  }
  void begin_test() noexcept override;

 private:
  struct Group {
    std::vector<std::size_t> components;
    ComponentTracker tracker;
    std::vector<MatchResult> results;
  };
  PointsNearNone near_none_;
  std::vector<Matcher> matchers_;
  std::vector<TestHistory> histories_;  // none: frames are matched alone
  std::deque<ComponentTest> tests_;
  std::vector<Group> groups_;  // none: another method than fit
};

/// The status of a frame by those of its components: it is matched if any component is, and trusted if any is.
[[nodiscard]] wire::WireStatus status_of_all(std::span<const MatchResult> results) noexcept;

}  // namespace lbea::tool
