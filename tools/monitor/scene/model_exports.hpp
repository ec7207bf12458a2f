// What browsers get of the model: its description for the page, and meshes for ParaView.
#pragma once

#include "tools/monitor/feeds/feed.hpp"

#include <lbea/lbea.hpp>

#include <nlohmann/json_fwd.hpp>

namespace lbea::tool {

struct ColorRange {
  float lo = 0, hi = 1;
};

/// Over all samples, or over evenly spaced ones of a large ensemble.
struct ModelRanges {
  std::array<float, 3> lo{}, hi{};  // of the node positions
  std::vector<ColorRange> fields;
};
[[nodiscard]] ModelRanges ranges_of(const Model& model);

/// The description of the model as one packet. Sections: "elements": elements() x 4 node indices; "curves": points x 5
/// (simulation, time in s, x, y, z). `recording`: what the page shows of a recording; null for a running test.
[[nodiscard]] std::string model_packet(const Model& model, const ModelRanges& ranges, const nlohmann::json& recording);

/// A file for ParaView of a shape as "3:17:0.75,4:16:0.25" describes it, or why there is none.
[[nodiscard]] http::Response mesh_response(const Model& model, std::string_view shape, const std::string& file_prefix);

}  // namespace lbea::tool
