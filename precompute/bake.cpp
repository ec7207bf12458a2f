#include "precompute/bake.hpp"

#include "precompute/channels/free_channel_nodes.hpp"
#include "precompute/channels/plan_channels.hpp"
#include "precompute/model_file/estimate.hpp"
#include "precompute/model_file/model_writer.hpp"
#include "precompute/model_file/write_model.hpp"
#include "precompute/samples/sample_record.hpp"
#include "precompute/survey/survey.hpp"

namespace lbea::bake {
BakeSummary bake_model(const Ensemble& ensemble, const EnsembleDescription& description,
                       const std::filesystem::path& output, const BakeOptions& options) {
  check_replaceable(output);
  const TemporaryWorkFolder temporary(output);  // holds the results of the steps: memory does not grow with the runs
  const WorkFolder& work = temporary.folder();

  // Step 2. The nodes and elements common to all samples; sim_ref (a) at impact or (b) over time; the observed region.
  BakePlan plan = survey_runs(work, ensemble, description, options);
  const Reference reference = choose_reference(plan, options);

  // Step 5. Cotangent stiffness L, lumped mass M; L psi = lambda M psi, the p smallest lambda, psi' M psi = I.
  solve_bases(work, plan, reference, options);
  plan_channels(plan, reference);  // the nodes of the quantities of interest
  refuse_free_channel_nodes(work, plan);

  // Step 3. The nearest node of each sample for every vertex of sim_ref. Step 5. alpha = Psi' M f for f = x, y, z.
  // Then the depth image of each sample from the sensor's pose, and the envelope of all surfaces.
  plan_samples(plan, options);
  check_space(work, plan);
  const auto begin = std::chrono::steady_clock::now();
  make_samples(work, plan, surveyed_runs(plan), options);
  const double samples_seconds = seconds_since(begin);

  // The model file: all samples, and what they determine together: the axes of highest variance (step 8), deformation
  // branches, the residuals that an unseen run leaves in the depth images.
  BakeSummary summary = write_model(work, collect_runs(work, plan), output, options);
  summary.seconds.samples = samples_seconds;
  return summary;
}
}  // namespace lbea::bake
