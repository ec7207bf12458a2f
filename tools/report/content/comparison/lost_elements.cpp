#include "tools/report/content/comparison/lost_elements.hpp"

#include "runtime/src/model/eroded_elements.hpp"

#include <optional>

namespace lbea::tool {

std::string lost_elements_sentence(const Model& model, std::uint32_t simulation) {
  std::optional<std::uint32_t> first, last;
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    if (model.sample(s).simulation != simulation) continue;
    if (!first) first = s;
    last = s;
  }
  if (!first || model.view().eroded.empty()) return {};
  const std::vector<std::uint8_t> before = present_elements(model, *first), after = present_elements(model, *last);
  std::size_t had = 0, lost = 0;
  for (std::size_t e = 0; e < before.size(); ++e) {
    had += before[e];
    if (before[e] != 0 && after[e] == 0) ++lost;
  }
  if (lost == 0) return {};
  return "At its end, simulation " + std::string(model.simulation_name(simulation)) + " of the best sample has lost " +
         std::to_string(lost) + " of " + std::to_string(had) + " elements.";
}

}  // namespace lbea::tool
