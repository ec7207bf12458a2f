// How the frames of a recording are matched: as they were then, where the command line does not say otherwise.
#pragma once

#include "tools/shared/recording/run_settings.hpp"

#include <optional>
#include <string>

namespace lbea::tool {

struct SettingsOptions {
  std::string recording, model_file, pose_file;
  bool without_pose = false;     // frames are in the reference's coordinates
  std::optional<Method> method;  // another than the recording's
  bool needs_all = false;        // what the recording does not know has to be given
};

/// What lbea-record was not told is taken from the matcher's states. Warns of what nobody knows. Throws
/// Error{bad_config} when that is needed, Error{bad_input} when a file is not what it should be.
[[nodiscard]] RunSettings replay_settings(RunSettings recorded, const Model& model, const SettingsOptions& options);

}  // namespace lbea::tool
