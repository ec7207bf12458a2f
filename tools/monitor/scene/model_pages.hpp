// What the browser has to know of the model once: names, parameters, ranges, curves, the mesh's elements.
#pragma once

#include <lbea/lbea.hpp>

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <string>
#include <vector>

namespace lbea::tool {

struct FieldRange {
  float lo = 0, hi = 1;
};

/// Over all samples, or evenly picked ones when they are very many.
struct ModelRanges {
  std::array<float, 3> lo{}, hi{};  // of the nodes
  std::vector<FieldRange> fields;
};

[[nodiscard]] ModelRanges ranges_of(const Model& model);
[[nodiscard]] std::vector<std::string> simulation_names(const Model& model);
/// One packet; "elements": elements() x 4 node indices, "curves": points x 5 (simulation, time in s, x, y, z).
/// "recording": what is said of one, when the page shows one.
[[nodiscard]] std::string model_packet(const Model& model, const ModelRanges& ranges, const nlohmann::json& recording);

}  // namespace lbea::tool
