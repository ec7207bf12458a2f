#include "tools/bench/pipeline.hpp"

#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/correspondence.hpp"
#include "runtime/src/match/matcher.hpp"

#include <algorithm>

namespace lbea::tool::bench {
namespace {

/// The stages of Matcher::match() one by one, with the inner loops of a chosen instruction set.
class KernelsPipeline : public Pipeline {
 public:
  KernelsPipeline(const Model& model, const MatcherConfig& config, const Kernels& code, std::string name)
      : name_(std::move(name)),
        model_(model),
        view_(model_.view()),
        config_(completed(config, model_)),
        code_(code),
        index_(envelope_grid(view_.envelope), config.max_points, code),
        corresponding_(view_.info.vertices),
        coefficients_(view_.info.modes),
        best_(std::min(config.max_matches, view_.info.samples)),
        surface_(view_.info.vertices),
        is_shown_(view_.info.vertices) {
    if (config.method != Method::vtp) return;
    for (const ReferenceView& reference : view_.references) position_searches_.emplace_back(view_, reference, code);
  }

  [[nodiscard]] std::string name() const override { return name_; }

  PipelineTimes match(const Frame& frame) override { return {match(frame, {})}; }

  [[nodiscard]] Answer answer(const Frame& frame) override {
    Answer answer;
    answer.points.resize(view_.info.vertices);
    match(frame, answer.points);
    answer.reference = reference_;
    answer.cut = cut_;
    for (std::size_t j = 0; j < coefficients_.count; ++j)
      for (const float value : coefficients_[j]) answer.coefficients.push_back(value);
    answer.ranked.assign(best_.ranked().begin(), best_.ranked().end());
    return answer;
  }

 private:
  StageTimes match(const Frame& frame, std::span<std::uint32_t> points) {
    StageTimes times;
    Stopwatch watch;
    reference_ = reference_at(view_, seconds_between(config_.trigger_ns, frame.stamp_ns));
    const ReferenceView& reference = view_.references[reference_];
    const PointTally tally = index_.build(frame.points, config_.T_reference_sensor);
    times.index = watch.lap_ns();
    best_.clear();
    if (tally.used == 0) return times;
    cut_ = correspond(index_, reference.vertex_positions, corresponding_, points,
                      most_hard_tests(index_, reference.vertex_positions.size()));
    times.correspondence = watch.lap_ns();
    project(reference);
    times.projection = watch.lap_ns();
    search(reference);
    times.matching = watch.lap_ns();
    last_coverage_ = coverage_of(best_.ranked().front().sample, reference);
    times.coverage = watch.lap_ns();
    return times;
  }

  void project(const ReferenceView& reference) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      code_.project(reference.projection.data(), coefficients_.count, corresponding_.planes[axis].size(),
                    corresponding_.planes[axis].data(), coefficients_.planes[axis].data());
  }

  void search(const ReferenceView& reference) {
    if (config_.method == Method::vtp) return position_searches_[reference_].search(corresponding_, best_);
    const std::size_t stride = coefficients_.planes[0].size();
    const float* const e[3] = {coefficients_.planes[0].data(), coefficients_.planes[1].data(),
                               coefficients_.planes[2].data()};
    for (std::uint32_t s = 0; s < view_.info.samples; ++s)
      best_.offer(s, code_.mode_distance(e, reference.coefficients.data() + 3 * stride * s, stride, best_.bound()));
  }

  float coverage_of(std::uint32_t sample, const ReferenceView& reference) {
    const std::span<const float> nodes = model_.node_positions(sample);
    for (std::size_t v = 0; v < surface_.size(); ++v)
      for (std::size_t axis = 0; axis < 3; ++axis)
        surface_[v][axis] = nodes[std::size_t{3} * reference.vertex_nodes[v] + axis];
    find_shown(index_, surface_, config_.trusted_distance, is_shown_);
    return share_shown(is_shown_, reference.mass);
  }

  std::string name_;
  Model model_;
  const ModelView& view_;
  MatcherConfig config_;
  const Kernels& code_;
  CloudIndex index_;
  Positions corresponding_, coefficients_;
  BestSamples best_;
  std::vector<PositionSearch> position_searches_;  // Method::vtp: per reference
  std::vector<std::array<float, 3>> surface_;
  std::vector<std::uint8_t> is_shown_;
  std::uint32_t reference_ = 0;
  std::uint32_t cut_ = 0;
  float last_coverage_ = 0;  // stored so that the compiler does not remove the computation
};

/// The product.
class MatcherPipeline : public Pipeline {
 public:
  MatcherPipeline(const Model& model, const MatcherConfig& config) : config_(config), matcher_(model, config) {}

  [[nodiscard]] std::string name() const override { return "lbea"; }

  PipelineTimes match(const Frame& frame) override { return {matcher_.match(frame).elapsed_ns}; }

  // A result does not hold the nearest points. They are computed by the same stages run one by one, whose coefficients
  // must be bitwise equal to those of the matcher.
  [[nodiscard]] Answer answer(const Frame& frame) override {
    if (!stages_) stages_ = kernels_pipeline(matcher_.model(), config_, kernels(), name());
    Answer answer = stages_->answer(frame);
    const MatchResult result = matcher_.match(frame);
    if (!std::ranges::equal(result.coefficients, answer.coefficients))
      throw Error(Status::bad_input,
                  "frame " + std::to_string(frame.id) +
                      ": the coefficients of the matcher differ from those of its stages run one by one");
    answer.reference = result.reference;
    answer.ranked.clear();
    for (const Match& match : result.matches)
      answer.ranked.push_back({matcher_.model().sample_index(match.sample), match.distance});
    return answer;
  }

 private:
  MatcherConfig config_;
  Matcher matcher_;
  std::unique_ptr<Pipeline> stages_;  // made on first use, for the check
};

}  // namespace

std::unique_ptr<Pipeline> kernels_pipeline(const Model& model, const MatcherConfig& config, const Kernels& code,
                                           std::string name) {
  return std::make_unique<KernelsPipeline>(model, config, code, std::move(name));
}

std::string short_name(const Kernels& code) {
  const std::string name = code.name, prefix = "kernels_";
  return name.starts_with(prefix) ? name.substr(prefix.size()) : name;
}

const Kernels& kernels_named(const std::string& name) {
  std::string names;
  for (const Kernels* const* code = available_kernels(); *code != nullptr; ++code) {
    if (short_name(**code) == name) return **code;
    names += (names.empty() ? "" : ", ") + short_name(**code);
  }
  throw Error(Status::bad_config, "kernels \"" + name + "\": this processor runs " + names + "; choose one of them");
}

std::unique_ptr<Pipeline> matcher_pipeline(const Model& model, const MatcherConfig& config) {
  return std::make_unique<MatcherPipeline>(model, config);
}

}  // namespace lbea::tool::bench
