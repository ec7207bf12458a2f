// The command line of lbea-serve.
#pragma once

#include "tools/serve/components.hpp"
#include "tools/serve/machine.hpp"
#include "tools/serve/pipeline/inference_publisher.hpp"
#include "tools/serve/pipeline/pipeline.hpp"
#include "tools/serve/rigs.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/recording/recording_options.hpp"

namespace lbea::tool {

struct ServeOptions {
  std::vector<std::string> model_files;  // one per component
  std::string results_endpoint, preview_endpoint, inference_endpoint, inferred_field, metrics_address;
  RigOptions rig_options;
  std::vector<NamedRig> rigs;    // one or several
  std::optional<Method> method;  // none: choose_method() chooses it
  MatcherConfig matcher;
  bool estimates_pose = true;  // with fit, the pose error of each test
  bool frames_alone = false;   // with fit, without what the earlier frames have shown
  PipelineConfig pipeline;
  RecordingOptions recording;
  ServerAccessOptions access;
  PrivilegeRequest privileges;
  bool check = false;
  bool json = false;

  [[nodiscard]] bool has_several_components() const noexcept { return model_files.size() > 1; }
  [[nodiscard]] bool has_several_rigs() const noexcept { return rigs.size() > 1; }
};

void add_options(Tool& tool, ServeOptions& options);
/// Reads what --pose names. Throws Error{file_not_found | bad_input}.
void read_poses(ServeOptions& options, const Model& model);
/// Sets matcher.method: without --method it is fit when all models have depth images for the pose, otherwise lbea.
void choose_method(ServeOptions& options, const std::vector<NamedModel>& models);
/// Warnings for what these options lack for this model: a verdict, or the time of impact. Call after choose_method().
[[nodiscard]] std::vector<Finding> check_options(const ServeOptions& options, const Model& model);
/// --infer's field in each model. Throws Error{bad_config}.
[[nodiscard]] std::vector<InferredField> fields_to_infer(const ServeOptions& options,
                                                         const std::vector<NamedModel>& models);
/// Memory of the queue in bytes: one slot of max_points per rig, waiting frame and further matcher, allocated at the
/// start.
[[nodiscard]] std::uint64_t queue_bytes(const ServeOptions& options);
/// --check: tests everything that does not need frames and prints the findings. Returns the exit code.
int check(ServeOptions options);

}  // namespace lbea::tool
