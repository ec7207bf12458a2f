// The rigs that a program takes frames from: their options and poses.
#pragma once

#include "tools/shared/intake/rig_options.hpp"
#include "tools/shared/recording/recording_format.hpp"

namespace lbea::tool {

/// As the command line gives it.
struct RigOptions {
  std::vector<std::string> frames, poses, clock_offsets;  // with several rigs: NAME=VALUE
};

struct NamedRig : RigSettings {
  std::string endpoint, pose_file;
};

/// Throws WrongUsage unless there is one rig, or each of several has its own name and endpoint, and poses and offsets
/// are those of rigs.
[[nodiscard]] std::vector<NamedRig> read_rigs(const RigOptions& options);
/// An option's value for each of a recording's rigs; one without a name if it has one rig. See values_per_rig().
[[nodiscard]] std::vector<std::optional<std::string>> values_per_recorded_rig(const std::vector<RigSettings>& rigs,
                                                                              const std::string& option,
                                                                              const std::string& value,
                                                                              const std::vector<std::string>& texts);
/// The files of --pose, empty where there is none. Throws WrongUsage for what is no file.
[[nodiscard]] std::vector<std::string> pose_files(const std::vector<std::optional<std::string>>& values);
/// Reads the poses and descriptions from their files; length_unit: that they must have, unless empty. Throws
/// Error{file_not_found | bad_input}.
void read_poses(std::vector<NamedRig>& rigs, std::string_view length_unit = {});
/// "--frames", or with several rigs "--frames NAME", with the endpoints.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> frames_endpoints(const std::vector<NamedRig>& rigs);

}  // namespace lbea::tool
