// The results of the shown components for one frame, which come one after the other.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <algorithm>
#include <optional>
#include <vector>

namespace lbea::tool {

class FrameResults {
 public:
  explicit FrameResults(std::size_t components) : results_(components) {}
  /// A result of the whole frame is that of each component.
  FrameResults(std::size_t components, const wire::WireResult& result) : results_(components, result) {}

  [[nodiscard]] bool is_empty() const noexcept { return std::ranges::none_of(results_, has_result); }
  [[nodiscard]] bool is_complete() const noexcept { return std::ranges::all_of(results_, has_result); }
  /// Whether the result is of the same frame as all others; of any frame without others.
  [[nodiscard]] bool is_of(const wire::WireResult& result) const noexcept {
    return is_empty() || (first().session == result.session && first().frame_id == result.frame_id);
  }
  [[nodiscard]] bool is_matched() const noexcept {
    return std::ranges::any_of(results_,
                               [](const auto& r) { return r && wire::fate_of(r->status) == wire::Fate::matched; });
  }
  /// Not empty.
  [[nodiscard]] const wire::WireResult& first() const noexcept { return **std::ranges::find_if(results_, has_result); }
  void add(std::size_t component, const wire::WireResult& result) { results_[component] = result; }
  /// Replaces those of the components that have a result here.
  void copy_to(std::vector<wire::WireResult>& results) const {
    for (std::size_t i = 0; i < results_.size(); ++i)
      if (results_[i]) results[i] = *results_[i];
  }
  /// Leaves it empty.
  [[nodiscard]] FrameResults take() { return std::exchange(*this, FrameResults(results_.size())); }

 private:
  static bool has_result(const std::optional<wire::WireResult>& result) noexcept { return result.has_value(); }
  std::vector<std::optional<wire::WireResult>> results_;
};

}  // namespace lbea::tool
