#include "precompute/model_file/estimate.hpp"

#include "precompute/model_file/model_sections.hpp"
#include "precompute/samples/sample_record.hpp"
#include "precompute/work/archive.hpp"

namespace lbea::bake {
namespace {
/// A plan of only the first samples of the reference run, with keys of its own.
BakePlan probe(const BakePlan& plan, std::size_t samples) {
  std::vector<bool> is_kept(plan.runs.size(), false);
  is_kept[plan.ensemble.reference_run] = true;
  BakePlan few = without_runs(plan, is_kept);
  RunSurvey& survey = few.survey.runs.front();
  survey.steps.resize(samples);
  survey.times_s.resize(samples);
  PlannedRun& run = few.runs.front();
  run.record = key_of(std::string("probe"), run.record, std::uint64_t{samples});
  run.grid_and_images = key_of(run.record);
  return few;
}

double seconds_of(const WorkFolder& work, const BakePlan& probe, const BakeOptions& options) {
  BakeOptions quietly = options;
  quietly.progress = {};
  quietly.leaves_out_broken = false;
  const auto begin = std::chrono::steady_clock::now();
  (void)make_samples(work, probe, {0}, quietly);
  const double seconds = seconds_since(begin);
  std::error_code none;
  std::filesystem::remove(work.file(probe.runs.front().record_name()), none);
  std::filesystem::remove(work.file(probe.runs.front().grid_and_images_name()), none);
  return seconds;
}

// Differences exclude the cost of a run that does not depend on its number of samples; one sample alone has none.
double seconds_of_a_sample(const WorkFolder& work, const BakePlan& plan, const BakeOptions& options) {
  constexpr std::size_t most = 16;
  const std::size_t samples = std::min(most, plan.survey.runs[plan.ensemble.reference_run].steps.size());
  const double first = seconds_of(work, probe(plan, 1), options);
  if (samples == 1) return first;
  const double all = seconds_of(work, probe(plan, samples), options);
  return std::max((all - first) / static_cast<double>(samples - 1), 1e-6);
}

/// Of the files that planning wrote and this plan needs.
std::uint64_t bytes_so_far(const WorkFolder& work, const BakePlan& plan) {
  std::vector<WorkName> names;
  for (const std::uint64_t key : plan.bases) names.push_back({WorkKind::basis, key});
  for (const PlannedRun& run : plan.runs)
    if (run.failure.empty()) names.push_back(run.survey_name());
  std::uint64_t bytes = 0;
  std::error_code error;
  for (const WorkName name : names)
    if (const auto size = std::filesystem::file_size(work.file(name), error); !error) bytes += size;
  return bytes;
}

/// The sections that must be in memory for matching by methods lbea and fit.
std::vector<PlannedSection> hot(const ModelPlan& model) {
  std::vector<PlannedSection> sections = model.sections;
  const bool has_landmarks =
      std::ranges::find(sections, format::SectionId::landmark_positions, &PlannedSection::id) != sections.end();
  std::erase_if(sections, [=](const PlannedSection& section) { return format::is_cold(section.id, has_landmarks); });
  return sections;
}

BakeEstimate sizes(const WorkFolder& work, const BakePlan& plan) {
  std::vector<bool> is_kept;
  std::vector<std::string> left_out;
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    is_kept.push_back(plan.runs[run].failure.empty());
    if (!is_kept.back()) left_out.push_back(plan.ensemble.runs[run].name);
  }
  const BakePlan kept = without_runs(plan, is_kept);
  const std::vector<ReferenceBasis> bases = read_bases(work, plan);
  const EnvelopeBuilder envelope(plan.survey.min, plan.survey.max, plan.description.margin());
  const SampleRecord sample(plan, bases);
  const std::size_t nodes = plan.survey.mesh.node_ids.size(), vertices = bases.front().vertex_nodes.size();

  BakeEstimate result;
  result.runs = kept.runs.size();
  result.samples = kept.survey.samples();
  const ModelPlan model = plan_model(kept, bases, envelope.layout(), left_out);
  result.model_bytes = model_size(model.sections);
  result.hot_bytes = model_size(hot(model));
  const std::size_t image = plan.camera ? padded_cells(*plan.camera) * sizeof(std::uint16_t) : 0;
  const std::size_t moments = bases.size() * 24 * (vertices + 2 * plan.description.modes);
  result.work_bytes = result.samples * (sample.bytes() + image) +
                      result.runs * (moments + 8 * envelope.layout().bits.size()) + bytes_so_far(work, plan);
  for (const ReferenceBasis& basis : bases)
    result.shared_bytes += static_cast<std::uint64_t>(basis.projection.size()) * sizeof(double);
  result.thread_bytes = 2 * sample.bytes() + 160 * nodes + 80 * vertices + moments;
  return result;
}
}  // namespace

void check_space(const WorkFolder& work, const BakePlan& plan) {
  const BakeEstimate needed = sizes(work, plan);
  std::error_code error;
  const auto free = std::filesystem::space(work.path(), error).available;
  if (!error && free < needed.model_bytes + needed.work_bytes)
    throw Error(Status::write_failed, "the model needs " + std::to_string(needed.model_bytes) +
                                          " bytes and its making " + std::to_string(needed.work_bytes) + ", but " +
                                          work.path().parent_path().string() + " has " + std::to_string(free) +
                                          " free; make room or choose another folder");
}

BakeEstimate estimate(const WorkFolder& work, const BakePlan& plan, const BakeOptions& options) {
  BakeEstimate result = sizes(work, plan);
  result.seconds_per_sample = seconds_of_a_sample(work, plan, options);
  return result;
}
}  // namespace lbea::bake
