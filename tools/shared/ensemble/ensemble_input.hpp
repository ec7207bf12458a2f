// From a description's paths to what bake() takes: runs that open, parameters, the region's nodes and visibility.
#pragma once

#include "precompute/bake.hpp"
#include "precompute/ensemble.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace lbea::tool {

/// How a run is called: the last part of its path; of a file named d3plot, its folder's.
[[nodiscard]] std::string run_name(const std::filesystem::path& run);

/// The run that has this path or name. Throws Error{bad_config} when there is none.
[[nodiscard]] std::filesystem::path find_run(const std::vector<std::filesystem::path>& runs, const std::string& name);

/// Throws Error{bad_config | bad_input | file_not_found}: runs that the parameter table lacks are refused.
[[nodiscard]] bake::Ensemble open_ensemble(const bake::EnsembleDescription& description);

/// The region's node file as ids, beside those given.
void read_region_nodes(bake::RegionDescription& region);

/// BakeOptions::visible_nodes for the region's sensor; empty when there is none.
[[nodiscard]] decltype(bake::BakeOptions::visible_nodes) visibility(const bake::RegionDescription& region,
                                                                    unsigned threads);

/// BakeOptions::depth_renderer for the rig that `sensor` describes; empty when that is.
[[nodiscard]] decltype(bake::BakeOptions::depth_renderer) depth_rendering(const std::filesystem::path& sensor);

}  // namespace lbea::tool
