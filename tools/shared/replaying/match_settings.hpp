// The settings with which the frames of a recording are matched again.
#pragma once

#include "tools/shared/recording/recorded_run.hpp"

namespace lbea::tool {

struct SettingsOptions {
  std::string recording, model_file, pose_file;
  std::vector<std::string> rig_pose_files{};  // per rig of a recording of several, empty: the recorded pose; or none
  bool without_pose = false;                  // frames are in the reference's coordinates
  bool frames_alone = false;                  // with fit; of a recording by lbea-record, which does not know it
  std::optional<Method> method;               // instead of the recorded one
  bool needs_all = false;                     // settings that are not in the recording must be given
};

/// The recorded settings, changed by `options`. Settings that lbea-record did not know are taken from the recorded
/// states of the matcher. A setting that is still unknown causes a warning, or with needs_all and for the
/// pose of one of several rigs Error{bad_config}. Throws Error{bad_input} for invalid files.
[[nodiscard]] RunSettings replay_settings(RunSettings recorded, const Model& model, const SettingsOptions& options);

/// Those that the recording or, of lbea-record, a recorded state of the matcher names; none: one model.
[[nodiscard]] std::vector<ComponentSettings> recorded_components(const RunSettings& recorded, const std::string& file);

/// With fit, a frame is matched with what the earlier ones of its test have shown, one after the other, unless the run
/// did not.
[[nodiscard]] inline bool has_history(const RunSettings& settings) noexcept {
  return settings.matcher.method == Method::fit && settings.frames_alone == 0;
}

}  // namespace lbea::tool
