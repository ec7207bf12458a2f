#include "runtime/src/track/sample_probabilities.hpp"

#include <algorithm>

namespace lbea {

SampleProbabilities::SampleProbabilities(const Model& model)
    : first_(model.simulations() + 1),
      kind_(model.simulations()),
      own_(model.samples()),
      is_separate_(model.simulations()) {
  for (std::uint32_t s = 0; s < model.samples(); ++s) ++first_[model.sample(s).simulation + 1];
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  separate_.reserve(kind_.size());
  for (std::uint32_t i = 0; i < kind_.size(); ++i) {
    const std::size_t kind = kind_of(model, i);
    kind_[i] = static_cast<std::uint32_t>(kind);
    if (kind == kinds_.size()) {
      kinds_.push_back({i, i, shared_.size(), 0, 0, 0});
      shared_.resize(shared_.size() + steps(i));
    }
    ++kinds_[kind].all;
  }
  reset();
}

/// The number of a new kind if it is none of the known ones.
std::size_t SampleProbabilities::kind_of(const Model& model, std::uint32_t simulation) const {
  const auto has_same_steps = [&](const Kind& kind) {
    const std::uint32_t other = kind.first_simulation;
    if (steps(other) != steps(simulation)) return false;
    for (std::uint32_t i = 0; i < steps(other); ++i)
      if (model.sample(first_[other] + i).time_step != model.sample(first_[simulation] + i).time_step) return false;
    return true;
  };
  const auto known = std::span(kinds_).first(std::min(kinds_.size(), most_kinds));
  const auto same = std::ranges::find_if(known, has_same_steps);
  return same == known.end() ? kinds_.size() : static_cast<std::size_t>(same - known.begin());
}

void SampleProbabilities::reset() noexcept {
  for (const std::uint32_t simulation : separate_) is_separate_[simulation] = false;
  separate_.clear();
  for (Kind& kind : kinds_) {
    kind.sharing = kind.all;
    kind.first_sharing = kind.first_simulation;
  }
  std::ranges::fill(shared_, 1.0 / static_cast<double>(own_.size()));
}

void SampleProbabilities::separate(std::uint32_t simulation) noexcept {
  if (is_separate_[simulation]) return;
  Kind& kind = kinds_[kind_[simulation]];
  std::ranges::copy(block(kind).values, block(simulation).values.begin());
  is_separate_[simulation] = true;
  separate_.push_back(simulation);
  if (--kind.sharing == 0) return;
  while (is_separate_[kind.first_sharing] || kind_[kind.first_sharing] != kind_[simulation]) ++kind.first_sharing;
}

void SampleProbabilities::normalize() noexcept {
  double all = 0;
  for_each([&](const ProbabilityBlock& block) {
    double sum = 0;
    for (const double p : block.values) sum += p;
    all += block.simulations * sum;
  });
  for_each([&](const ProbabilityBlock& block) {
    for (double& p : block.values) p /= all;
  });
}

void SampleProbabilities::add_up(std::span<float> simulations) noexcept {
  const auto sum = [](const ProbabilityBlock& block) {
    float all = 0;
    for (const double p : block.values) all += static_cast<float>(p);
    return all;
  };
  for (Kind& kind : kinds_) kind.sum = sum(block(kind));
  for (std::uint32_t i = 0; i < kind_.size(); ++i)
    simulations[i] = is_separate_[i] ? sum(block(i)) : kinds_[kind_[i]].sum;
}

std::pair<std::uint32_t, double> SampleProbabilities::likeliest() noexcept {
  std::pair<std::uint32_t, double> best{0, -1};
  for_each([&](const ProbabilityBlock& block) {
    if (block.values.empty()) return;
    const auto most = std::ranges::max_element(block.values);
    const auto sample = block.first + static_cast<std::uint32_t>(most - block.values.begin());
    if (*most > best.second || (*most == best.second && sample < best.first)) best = {sample, *most};
  });
  return best;
}

}  // namespace lbea
