// The rigs that lbea-serve takes frames from: their options, poses and depth images.
#pragma once

#include "tools/shared/recording/recording_format.hpp"

#include <lbea/rigs.hpp>

namespace lbea::tool {

/// As the command line gives it.
struct RigOptions {
  std::vector<std::string> frames, poses, clock_offsets;  // with several rigs: NAME=VALUE
};

struct ServedRig : RigSettings {
  std::string endpoint, pose_file;
};

/// Throws WrongUsage unless there is one rig, or each of several has its own name and endpoint, and poses and offsets
/// are those of rigs.
[[nodiscard]] std::vector<ServedRig> read_rigs(const RigOptions& options);
/// Reads the poses and descriptions from their files. Throws Error{file_not_found | bad_input}.
void read_poses(std::vector<ServedRig>& rigs, const Model& model);
/// Those of the model, or rendered. Throws Error{bad_config | bad_input}.
[[nodiscard]] SensorViews views_for(const ServedRig& rig, const MatcherConfig& config, const Model& model);
/// For a RigMatcher. Throws the same.
[[nodiscard]] std::vector<Rig> matched_rigs(const std::vector<ServedRig>& rigs, const MatcherConfig& config,
                                            const Model& model);

}  // namespace lbea::tool
