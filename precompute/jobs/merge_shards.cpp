#include "precompute/jobs/merge_shards.hpp"

#include "precompute/basis/kept_variance.hpp"
#include "precompute/depth_images/branches.hpp"
#include "precompute/jobs/footprint.hpp"
#include "precompute/jobs/model_plan.hpp"
#include "precompute/jobs/run_record.hpp"
#include "precompute/model_file/model_writer.hpp"
#include "precompute/model_file/provenance.hpp"
#include "precompute/samples/field_sections.hpp"
#include "precompute/samples/landmarks.hpp"
#include "precompute/stage.hpp"
#include "runtime/src/match/stopwatch.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <limits>
#include <optional>
#include <string>

namespace lbea::bake {
namespace {

using format::SectionId;

/// What the runs left, sorted.
struct Harvest {
  std::vector<bool> is_kept;
  std::vector<RunLeftOut> left_out;
};

bool is_complete(const WorkFolder& work, const PlannedRun& run) {
  return work.has(run.record_name()) && work.has(run.footprint_name());
}

Harvest harvest(const WorkFolder& work, const BakePlan& plan) {
  Harvest harvest;
  std::string missing;
  std::size_t count = 0;
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    const std::string& name = plan.ensemble.runs[run].name;
    std::string reason = plan.runs[run].failure;
    const bool is_kept = reason.empty() && is_complete(work, plan.runs[run]);
    if (!is_kept && reason.empty()) reason = work.failure(plan.runs[run].record).value_or("");
    harvest.is_kept.push_back(is_kept);
    if (!reason.empty())
      harvest.left_out.push_back({name, reason});
    else if (!is_kept && ++count <= 5)
      missing += (missing.empty() ? "" : ", ") + name;
  }
  if (count > 0)
    throw Error(Status::bad_input, std::to_string(count) + " of " + std::to_string(plan.runs.size()) +
                                       " runs are not baked yet: " + missing + (count > 5 ? ", ..." : "") +
                                       "; run the shards that have them, and merge then");
  if (!harvest.is_kept[plan.ensemble.reference_run])
    throw Error(Status::bad_input,
                "the reference run could not be baked, and cannot be left out: " + harvest.left_out.front().reason);
  return harvest;
}

/// Takes run after run into the model.
class Merger {
 public:
  Merger(const WorkFolder& work, const BakePlan& plan, const std::vector<ReferenceBasis>& bases,
         const format::Info& info, ModelWriter& writer)
      : work_(work),
        plan_(plan),
        writer_(writer),
        sample_(plan, bases),
        fields_(writer, plan.survey.fields.size(), plan.description.compact_fields),
        image_(plan.camera ? padded_cells(*plan.camera) : 0),
        envelope_(plan.survey.min, plan.survey.max, plan.description.envelope_margin),
        moments_(bases.size()) {
    if (has_landmarks(info, plan.description)) landmarks_.emplace(writer, info, bases.front());
  }

  void take(std::size_t run, Stage& stage) {
    WorkReader record = work_.reader(plan_.runs[run].record_name());
    FootprintReader footprint(work_, plan_, run);
    for (std::size_t step = 0; step < plan_.survey.runs[run].steps.size(); ++step, ++samples_) {
      stage.check();
      read_sample(record, sample_);
      write_sample_rows();
      if (!image_.empty()) footprint.image(image_);
      if (!image_.empty()) writer_.write<std::uint16_t>(SectionId::view_depths, 0, samples_ * image_.size(), image_);
    }
    const std::vector<Moments> of_run = read_moments(record);
    record.finish();
    footprint.envelope(envelope_);
    if (of_run.size() != moments_.size()) record.fail("is damaged");
    for (std::size_t reference = 0; reference < moments_.size(); ++reference)
      moments_[reference].add(of_run[reference]);
    stage.step();
  }

  [[nodiscard]] EnvelopeBuilder& envelope() noexcept { return envelope_; }
  [[nodiscard]] const std::vector<Moments>& moments() const noexcept { return moments_; }
  [[nodiscard]] const std::vector<float>& field_errors() const noexcept { return fields_.errors(); }

 private:
  template <class T>
  void write_row(SectionId id, std::size_t part, const std::vector<T>& row) {
    writer_.write<T>(id, static_cast<std::uint32_t>(part), samples_ * row.size(), row);
  }
  void write_sample_rows() {
    write_row(SectionId::node_positions, 0, sample_.positions);
    if (landmarks_) landmarks_->write(samples_, sample_.positions);
    for (std::uint32_t field = 0; field < sample_.fields.size(); ++field)
      fields_.write(field, samples_, sample_.fields[field]);
    for (std::size_t part = 0; part < sample_.coefficients.size(); ++part)
      write_row(SectionId::coefficients, part, sample_.coefficients[part]);
    for (std::size_t part = 0; part < sample_.correspondence.size(); ++part)
      write_row(SectionId::correspondence, part, sample_.correspondence[part]);
  }

  const WorkFolder& work_;
  const BakePlan& plan_;
  ModelWriter& writer_;
  SampleRecord sample_;
  FieldSections fields_;
  std::optional<LandmarkSection> landmarks_;
  std::vector<std::uint16_t> image_;
  EnvelopeBuilder envelope_;
  std::vector<Moments> moments_;  // sums of floating-point numbers: always in the order of the runs
  std::uint64_t samples_ = 0;
};

double kept_share(const std::vector<ReferenceBasis>& bases, const std::vector<Moments>& moments) {
  double kept = 0, total = 0;
  for (std::size_t reference = 0; reference < bases.size(); ++reference) {
    kept += moments[reference].kept();
    total += moments[reference].total(bases[reference].mass);
  }
  return total > 0 ? kept / total : std::numeric_limits<double>::quiet_NaN();
}

// Of each run's last sample: some hundred nodes, x 3.
std::vector<std::uint32_t> branches_of(const BakePlan& plan, const ModelWriter& writer) {
  constexpr std::size_t most = 512;
  std::vector<std::uint64_t> last;
  std::uint64_t samples = 0;
  for (const RunSurvey& run : plan.survey.runs) last.push_back((samples += run.steps.size()) - 1);
  std::vector<float> positions(3 * plan.survey.mesh.node_ids.size());
  const std::size_t nodes = positions.size() / 3, every = (nodes + most - 1) / most;
  return deformation_branches(last.size(), [&](std::size_t run) {
    writer.read<float>(SectionId::node_positions, 0, last[run] * positions.size(), positions);
    std::vector<float> chosen;
    for (std::size_t i = 0; i < nodes; i += every)
      chosen.insert(chosen.end(), positions.begin() + static_cast<std::ptrdiff_t>(3 * i),
                    positions.begin() + static_cast<std::ptrdiff_t>(3 * i + 3));
    return chosen;
  });
}

void learn_and_write_views(const BakePlan& plan, ModelWriter& writer, unsigned threads) {
  std::vector<Sample> samples;
  for (std::uint32_t run = 0; run < plan.survey.runs.size(); ++run)
    for (const std::uint32_t step : plan.survey.runs[run].steps) samples.push_back({run, step});
  const auto read = [&](std::size_t first, std::span<std::uint16_t> images) {
    writer.read<std::uint16_t>(SectionId::view_depths, 0, first * padded_cells(*plan.camera), images);
  };
  write_views(writer, *plan.camera, learn_views(*plan.camera, samples, read, threads));
}

BakeSummary summarise(const format::Info& info, const std::vector<ReferenceBasis>& bases) {
  BakeSummary summary;
  summary.vertices = info.vertices;
  summary.modes = info.modes;
  summary.samples = info.samples;
  summary.simulations = info.simulations;
  summary.references = info.references;
  summary.nodes = info.nodes;
  summary.elements = info.elements;
  summary.fields = info.fields;
  summary.parameters = info.parameters;
  const auto worst = std::ranges::max_element(bases, {}, &ReferenceBasis::residual);
  summary.basis_residual = worst->residual;
  summary.basis_solver = worst->solver;
  for (const ReferenceBasis& basis : bases) summary.degenerate_triangles += basis.degenerate_triangles;
  summary.highest_eigenvalue = bases.front().eigenvalues[bases.front().eigenvalues.size() - 1];
  return summary;
}

std::vector<std::string> names_of(const std::vector<RunLeftOut>& runs) {
  std::vector<std::string> names;
  for (const RunLeftOut& run : runs) names.push_back(run.name);
  return names;
}

BakeSummary merge(const WorkFolder& work, const BakePlan& planned, const std::filesystem::path& output,
                  const BakeOptions& options) {
  Stopwatch watch;
  const Harvest runs = harvest(work, planned);
  const BakePlan plan = without_runs(planned, runs.is_kept);
  const std::vector<ReferenceBasis> bases = read_bases(work, plan);
  const std::vector<std::string> left_out = names_of(runs.left_out);
  const EnvelopeBuilder layout(plan.survey.min, plan.survey.max, plan.description.envelope_margin);
  const ModelPlan model = plan_model(plan, bases, layout.layout(), left_out);
  ModelWriter writer(output, model.sections);
  model.small.write(writer);

  Merger merger(work, plan, bases, model.info, writer);
  Stage merging(options, "merging", plan.runs.size());
  for (std::size_t run = 0; run < plan.runs.size(); ++run) merger.take(run, merging);

  // What was learned on the way: the view's axes, the branches, how well simulations explain one another.
  for (std::uint32_t part = 0; part < model.info.references; ++part)
    writer.write<std::uint32_t>(SectionId::leading_axes, part, 0, merger.moments()[part].leading_axes());
  writer.write<std::uint32_t>(SectionId::simulation_branches, 0, 0, branches_of(plan, writer));
  if (plan.camera) learn_and_write_views(plan, writer, options.threads);
  writer.write<std::uint64_t>(SectionId::envelope_bits, 0, 0, merger.envelope().finish().bits);
  BakeSummary summary = summarise(model.info, bases);
  summary.kept_variance = kept_share(bases, merger.moments());
  std::string provenance =
      provenance_json(plan.description, plan.ensemble, plan.survey, bases, summary.kept_variance, left_out);
  provenance.resize(model.provenance_size, ' ');
  writer.write<char>(SectionId::provenance, 0, 0, provenance);
  writer.commit();
  work.sweep();
  summary.file_size = writer.file_size();
  summary.left_out = runs.left_out;
  if (plan.description.compact_fields)
    for (std::size_t field = 0; field < plan.survey.fields.size(); ++field)
      summary.rounded_fields.push_back(
          {plan.survey.fields[field].name, plan.survey.fields[field].unit, merger.field_errors()[field]});
  summary.seconds = {planned.reading_seconds, planned.bases_seconds, 0, watch.lap_s()};
  return summary;
}

}  // namespace

BakeSummary merge_shards(const WorkFolder& work, const BakePlan& plan, const std::filesystem::path& output,
                         const BakeOptions& options) {
  try {
    return merge(work, plan, output, options);
  } catch (const DamagedWorkFile& damaged) {
    work.remove(damaged);
    throw Error(
        Status::bad_input,
        std::string(damaged.what()) + "; it was removed: run plan and the shards once more, they make what is missing");
  }
}

}  // namespace lbea::bake
