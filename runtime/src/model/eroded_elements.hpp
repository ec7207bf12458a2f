// Which elements of the component a sample lacks: eroded ones, and faces of solids that no erosion exposes there.
#pragma once

#include "runtime/src/model/model_view.hpp"

namespace lbea {

/// From 1 or 0 per element: bit (element mod 32) of word (element div 32) is 1 where it is 0.
inline void pack_eroded(std::span<const std::uint8_t> present, std::span<std::uint32_t> words) noexcept {
  for (std::uint32_t& word : words) word = 0;
  for (std::size_t e = 0; e < present.size(); ++e) words[e / 32] |= std::uint32_t{present[e] == 0} << e % 32;
}

/// The reverse.
inline void unpack_eroded(std::span<const std::uint32_t> words, std::span<std::uint8_t> present) noexcept {
  for (std::size_t e = 0; e < present.size(); ++e) present[e] = (words[e / 32] >> e % 32 & 1) != 0 ? 0 : 1;
}

/// Per element 1, or 0 where the sample lacks it; empty when no sample lacks elements.
[[nodiscard]] inline std::vector<std::uint8_t> present_elements(const Model& model, std::uint32_t sample) {
  const auto all = model.view().eroded;
  std::vector<std::uint8_t> present(all.empty() ? 0 : model.elements());
  const std::size_t words = format::words_of_elements(model.elements());
  if (!present.empty()) unpack_eroded(all.subspan(sample * words, words), present);
  return present;
}

/// Per element 1, or 0 where one of the samples lacks it; empty when no sample of the model lacks elements.
[[nodiscard]] inline std::vector<std::uint8_t> present_in_all(const Model& model,
                                                              std::span<const std::uint32_t> samples) {
  std::vector<std::uint8_t> all(model.view().eroded.empty() ? 0 : model.elements(), 1);
  for (const std::uint32_t sample : samples) {
    const std::vector<std::uint8_t> present = present_elements(model, sample);
    for (std::size_t e = 0; e < present.size(); ++e)
      if (present[e] == 0) all[e] = 0;
  }
  return all;
}

}  // namespace lbea
