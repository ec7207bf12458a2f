// The matchers as the pipeline and the replay use them, and the result that is made from what they find.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/answer/test_warnings.hpp"

#include <lbea/forecast.hpp>
#include <lbea/rigs.hpp>
#include <lbea/test_history.hpp>
#include <lbea/tracker.hpp>

#include <optional>

namespace lbea::tool {

/// Interface between the pipeline and what sums up a test; tests replace it here. One thread at a time, with the frames
/// in their order, but for the constant functions.
class TestEngine {
 public:
  virtual ~TestEngine() = default;
  /// The state of the test including this frame; null without a tracker.
  virtual const TestState* track(const MatchResult&) noexcept { return nullptr; }
  /// How the test will end, by the frames up to this one; null without a forecast.
  virtual const TestForecast* forecast(const MatchResult&) noexcept { return nullptr; }
  /// Replaces the velocities and accelerations of the frame that forecast() was called with last; see
  /// lbea/forecast.hpp.
  virtual void replace_rates(const MatchResult&, std::span<ChannelValue>) noexcept {}
  /// Whether the bounds that the bake has learned hold for the rig's pose.
  [[nodiscard]] virtual bool has_baked_pose() const noexcept { return false; }
  /// The next frame is the first of another session.
  virtual void begin_test() noexcept {}
  [[nodiscard]] virtual std::string_view simulation_name(std::uint32_t simulation) const noexcept = 0;
  [[nodiscard]] virtual double time_s(Sample sample) const noexcept = 0;
  [[nodiscard]] virtual ChannelInfo channel(std::uint32_t) const noexcept { return {}; }
};

/// The same with the matcher of one rig.
class MatchEngine : public TestEngine {
 public:
  /// `matcher`: which of the engine's matchers; threads with different ones may call it side by side. The spans of the
  /// result are valid until the next call with the same.
  virtual MatchResult match(const Frame& frame, std::uint32_t matcher) noexcept = 0;
  /// Whether no result depends on the frames before it, so that these may be matched at the same time.
  [[nodiscard]] virtual bool matches_frames_alone() const noexcept { return true; }
};

/// The same with the matcher of several rigs; see RigMatcher.
class RigEngine : public TestEngine {
 public:
  /// Threads with different rigs may call it side by side.
  virtual void match_alone(std::size_t rig, const Frame& frame) noexcept = 0;
  /// The spans of the result are valid until the next call.
  virtual MatchResult combine() noexcept = 0;
  /// See RigMatcher.
  virtual void use_threads(const RigThreads&) noexcept {}
  [[nodiscard]] virtual std::span<const RigResult> rigs() const noexcept = 0;
};

struct HistorySettings {
  bool is_kept = true;          // with fit: frames are matched with what the earlier ones have shown
  bool estimates_pose = false;  // the pose error of each test
  bool knows_impact = false;    // at MatcherConfig::trigger_ns; else its stamp is estimated
};

[[nodiscard]] bool has_pose_of(const SensorViews& views, const Model& model) noexcept;
/// Seconds since the impact; 0 for a sample that the model does not have.
[[nodiscard]] double time_of(Sample sample, const Model& model) noexcept;
[[nodiscard]] TestHistory history_for(const Model& model, const MatcherConfig& config, const SensorViews& views,
                                      const HistorySettings& settings);

/// elsewhere: by the tracker of several components.
enum class Tracked : std::uint8_t { here, elsewhere };

/// Sums up tests with a baked model. With Method::fit it has a tracker and, if the model has one, a forecast.
template <class Engine>
class ModelTest : public Engine {
 public:
  ModelTest(const Model& model, Method method, SensorViews views, Tracked tracked = Tracked::here)
      : model_(model), has_baked_pose_(has_pose_of(views, model)) {
    if (method != Method::fit) return;
    if (Forecast::is_in(model)) forecast_.emplace(model);
    if (tracked == Tracked::here) tracker_.emplace(model, TrackerConfig{}, std::move(views));
  }
  const TestState* track(const MatchResult& result) noexcept override {
    return tracker_ ? &tracker_->update(result) : nullptr;
  }
  const TestForecast* forecast(const MatchResult& result) noexcept override {
    return forecast_ ? &forecast_->update(result) : nullptr;
  }
  void replace_rates(const MatchResult& result, std::span<ChannelValue> channels) noexcept override {
    if (forecast_) lbea::replace_rates(model_, forecast_->state(), result.fit, channels);
  }
  [[nodiscard]] bool has_baked_pose() const noexcept override { return has_baked_pose_; }
  void begin_test() noexcept override {
    if (tracker_) tracker_->reset();
    if (forecast_) forecast_->reset();
  }
  [[nodiscard]] std::string_view simulation_name(std::uint32_t simulation) const noexcept override {
    return model_.simulation_name(simulation);
  }
  [[nodiscard]] double time_s(Sample sample) const noexcept override { return time_of(sample, model_); }
  [[nodiscard]] ChannelInfo channel(std::uint32_t channel) const noexcept override { return model_.channel(channel); }

 private:
  Model model_;
  bool has_baked_pose_;
  std::optional<Tracker> tracker_;
  std::optional<Forecast> forecast_;
};

/// One rig. With Method::fit it has a history, if it is kept.
class ModelEngine final : public ModelTest<MatchEngine> {
 public:
  ModelEngine(const Model& model, const MatcherConfig& config, const SensorViews& views = {},
              const HistorySettings& settings = {}, std::uint32_t matchers = 1)
      : ModelTest(model, config.method, views) {
    for (std::uint32_t i = 0; i < matchers; ++i) matchers_.emplace_back(model, config, views);
    if (config.method == Method::fit && settings.is_kept) history_.emplace(history_for(model, config, views, settings));
  }
  MatchResult match(const Frame& frame, std::uint32_t matcher) noexcept override {
    return history_ ? matchers_[matcher].match(frame, *history_) : matchers_[matcher].match(frame);
  }
  [[nodiscard]] bool matches_frames_alone() const noexcept override { return !history_; }
  void begin_test() noexcept override {
    ModelTest::begin_test();
    if (history_) history_->reset();
  }

 private:
  std::vector<Matcher> matchers_;
  std::optional<TestHistory> history_;
};

/// Several rigs, with Method::fit.
class ModelRigEngine final : public ModelTest<RigEngine> {
 public:
  /// `settings`: the history is kept.
  ModelRigEngine(const Model& model, const MatcherConfig& config, const std::vector<Rig>& rigs,
                 const HistorySettings& settings)
      : ModelTest(model, Method::fit, rigs.front().views), matcher_(model, config, rigs) {
    if (!settings.estimates_pose) matcher_.fix_poses();
    if (settings.knows_impact) matcher_.set_impact(config.trigger_ns);
  }
  void match_alone(std::size_t rig, const Frame& frame) noexcept override { matcher_.match_alone(rig, frame); }
  MatchResult combine() noexcept override { return matcher_.combine(); }
  void use_threads(const RigThreads& threads) noexcept override { matcher_.use_threads(threads); }
  [[nodiscard]] std::span<const RigResult> rigs() const noexcept override { return matcher_.rigs(); }
  /// Without a verdict if the rigs contradict each other.
  const TestState* track(const MatchResult& result) noexcept override {
    const TestState* const test = ModelTest::track(result);
    contradictions_.add(are_contradictory(result.verdict, rigs()));
    if (test == nullptr || !contradictions_.are_many()) return test;
    contradicted_ = *test;
    contradicted_.verdict = Verdict::unknown;
    return &contradicted_;
  }
  void begin_test() noexcept override {
    ModelTest::begin_test();
    matcher_.reset();
    contradictions_ = {};
  }

 private:
  RigMatcher matcher_;
  Contradictions contradictions_;
  TestState contradicted_;
};

/// The model as the state message describes it.
[[nodiscard]] wire::ModelSummary summarize(const Model& model, const std::string& file);

/// A result without the names of matches and channels. reserve() allocates; the others do not.
struct Outcome {
  wire::WireResult result;             // without matches
  std::vector<Match> matches;          // compose() adds their names
  std::vector<ChannelValue> channels;  // the same
  std::vector<ChannelValue> ends;      // forecasts of the channels; empty: none
  // With several components: by which one, and in the result of the last one the status of the frame by all of them
  std::uint32_t component = 0;
  std::optional<wire::WireStatus> of_frame{};
};

[[nodiscard]] wire::WireStatus to_wire(Status status) noexcept;

void reserve(Outcome& outcome, std::uint32_t max_matches);
/// Resets all values and keeps the memory.
void clear(Outcome& outcome) noexcept;
/// Copies what the matcher found in one frame.
void fill_outcome(Outcome& outcome, const MatchResult& match) noexcept;
/// Copies what the matcher found in a capture of several rigs, which its test knows by `session` and `id`, and adds it
/// to the test.
void fill_capture(Outcome& outcome, TestEngine& engine, MatchResult match, std::uint64_t session,
                  std::uint64_t id) noexcept;
/// Copies what the frame of one rig says alone; its names are in `frame` already.
void fill_rig_frame(wire::WireRigFrame& frame, const RigResult& result) noexcept;
/// What the outcome holds of a match, as evidence for TestEngine::track() and forecast().
[[nodiscard]] MatchResult match_of(const Outcome& outcome) noexcept;
/// Adds the match to its test, and copies the state of the test and its forecast.
void fill_test(Outcome& outcome, TestEngine& engine, const MatchResult& match) noexcept;
/// The complete result.
void compose(const Outcome& outcome, const TestEngine& engine, wire::WireResult& into);
/// Sets the verdict by the status when the matcher gave none.
void complete_verdict(wire::WireResult& result) noexcept;

}  // namespace lbea::tool
