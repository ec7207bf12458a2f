// The input of bake_model() from the paths in a description: runs, parameters, nodes and visibility of the region.
#pragma once

#include "precompute/bake.hpp"
#include "precompute/ensemble.hpp"

namespace lbea::tool {

/// The name of a run: the last part of its path; for a file named d3plot, that of its folder.
[[nodiscard]] std::string run_name(const std::filesystem::path& run);

/// The run that has this path or name. Throws Error{bad_config} when there is none.
[[nodiscard]] std::filesystem::path find_run(const std::vector<std::filesystem::path>& runs, const std::string& name);

/// Throws Error{bad_config | bad_input | file_not_found}; also for a run that is not in the parameter table.
[[nodiscard]] bake::Ensemble open_ensemble(const bake::EnsembleDescription& description);

/// Opens a run by its EnsembleRun::source.
[[nodiscard]] std::unique_ptr<bake::SimulationReader> open_run(const std::string& source);

/// Opens a run named on a command line. A file of a numbered series stands for all of them, as stderr then says, unless
/// it is a single file.
[[nodiscard]] std::unique_ptr<bake::SimulationReader> open_named_run(const std::filesystem::path& run,
                                                                     bool is_single_file);
inline constexpr auto single_file_help = "the run is this file alone, not all files of its numbered series";

/// The sensor descriptions of the rigs whose depth images the description asks for.
[[nodiscard]] std::vector<std::filesystem::path> rigs_of(const bake::EnsembleDescription& description);

/// Reads the region's node file. A region without criteria becomes what these rigs see at impact.
void complete_region(bake::RegionDescription& region, std::span<const std::filesystem::path> rigs);

/// BakeOptions::visible_nodes: what one of the region's sensors sees; empty when there are none.
[[nodiscard]] decltype(bake::BakeOptions::visible_nodes) visibility(const bake::RegionDescription& region);

/// For the rig described by the file `sensor`; empty for an empty path.
[[nodiscard]] bake::DepthRendering depth_rendering(const std::filesystem::path& sensor);
/// For all rigs of the description.
void add_depth_renderers(bake::BakeOptions& options, const bake::EnsembleDescription& description);

}  // namespace lbea::tool
