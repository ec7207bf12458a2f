#include "precompute/model_file/write_model.hpp"

#include "precompute/channels/channel_history.hpp"
#include "precompute/left_out/branches.hpp"
#include "precompute/model_file/model_sections.hpp"
#include "precompute/parallel.hpp"
#include "precompute/samples/sample_record.hpp"
#include "runtime/src/model/eroded_elements.hpp"

namespace lbea::bake {
namespace {

using format::SectionId;

/// Appends run after run to the model.
class RunAppender {
 public:
  RunAppender(const WorkFolder& work, const BakePlan& plan, const std::vector<ReferenceBasis>& bases,
              const format::Info& info, ModelWriter& writer)
      : work_(work),
        plan_(plan),
        writer_(writer),
        sample_(plan, bases),
        fields_(writer, plan.survey.fields.size(), plan.description.compact_fields),
        lacks_elements_(plan.survey.lacks_elements()),
        image_(plan.camera ? padded_cells(*plan.camera) : 0),
        envelope_(plan.survey.min, plan.survey.max, plan.description.margin()),
        moments_(bases.size()) {
    if (has_landmarks(info, plan.description)) landmarks_.emplace(writer, info, bases.front());
  }

  void append(std::size_t run, Stage& stage) {
    WorkReader record = work_.reader(plan_.runs[run].record_name());
    GridAndImagesReader grid_and_images(work_, plan_, run);
    for (std::size_t step = 0; step < plan_.survey.runs[run].steps.size(); ++step, ++samples_) {
      stage.check();
      read_sample(record, sample_, plan_.survey.runs[run]);
      write_sample_rows();
      if (!image_.empty()) grid_and_images.image(image_);
      if (!image_.empty()) writer_.write<std::uint16_t>(SectionId::view_depths, 0, samples_ * image_.size(), image_);
    }
    const std::vector<Moments> run_moments = read_moments(record);
    const std::vector<float> channels = read_channel_values(record);
    record.finish();
    write_channels(channels, plan_.survey.runs[run].steps.size());
    grid_and_images.envelope(envelope_);
    if (run_moments.size() != moments_.size()) record.fail("is damaged");
    for (std::size_t reference = 0; reference < moments_.size(); ++reference)
      moments_[reference].add(run_moments[reference]);
    stage.step();
  }

  [[nodiscard]] EnvelopeBuilder& envelope() noexcept { return envelope_; }
  [[nodiscard]] const std::vector<Moments>& moments() const noexcept { return moments_; }
  [[nodiscard]] const FieldSections& fields() const noexcept { return fields_; }

 private:
  template <class T>
  void write_row(SectionId id, std::size_t part, const std::vector<T>& row) {
    writer_.write<T>(id, static_cast<std::uint32_t>(part), samples_ * row.size(), row);
  }
  /// values: channels x steps of the run whose samples were written last.
  void write_channels(std::span<const float> values, std::size_t steps) {
    const std::size_t all = plan_.survey.samples();
    for (std::size_t channel = 0; channel < plan_.channels.size(); ++channel)
      writer_.write<float>(SectionId::channel_values, 0, channel * all + samples_ - steps,
                           values.subspan(channel * steps, steps));
  }
  void write_sample_rows() {
    write_row(SectionId::node_positions, 0, sample_.positions);
    if (landmarks_) landmarks_->write(samples_, sample_.positions);
    if (lacks_elements_) write_row(SectionId::eroded_elements, 0, sample_.eroded);
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
  bool lacks_elements_;
  std::vector<std::uint16_t> image_;
  EnvelopeBuilder envelope_;
  std::vector<Moments> moments_;  // added in the order of the runs: floating-point sums depend on it
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

/// Deformation branches of the runs' last samples, compared at some hundred nodes.
std::vector<std::uint32_t> branches_of(const BakePlan& plan, const ModelWriter& writer) {
  constexpr std::size_t most = 512;
  std::vector<std::uint64_t> last;
  std::uint64_t samples = 0;
  for (const RunSurvey& run : plan.survey.runs) last.push_back((samples += run.steps.size()) - 1);
  std::vector<float> positions(3 * plan.survey.mesh.node_ids.size());
  return deformation_branches(last.size(), [&](std::size_t run) {
    writer.read<float>(SectionId::node_positions, 0, last[run] * positions.size(), positions);
    return thinned_nodes(positions, most);
  });
}

/// The samples as written so far.
SampleSource source_of(const BakePlan& plan, const ModelWriter& writer, const FieldSections& fields) {
  SampleSource source{
      .camera = *plan.camera, .length_unit = plan.description.length_unit, .nodes = plan.survey.mesh.node_ids.size()};
  for (std::uint32_t run = 0; run < plan.survey.runs.size(); ++run)
    for (const std::uint32_t step : plan.survey.runs[run].steps) source.samples.push_back({run, step});
  for (const RunSurvey& run : plan.survey.runs)
    source.times.insert(source.times.end(), run.times_s.begin(), run.times_s.end());
  source.read_images = [&](std::size_t first, std::span<std::uint16_t> images) {
    writer.read<std::uint16_t>(SectionId::view_depths, 0, first * padded_cells(*plan.camera), images);
  };
  source.read_positions = [&writer](std::size_t sample, std::span<float> positions) {
    writer.read<float>(SectionId::node_positions, 0, sample * positions.size(), positions);
  };
  source.channels.resize(plan.channels.size() * source.samples.size());
  if (!source.channels.empty()) writer.read<float>(SectionId::channel_values, 0, 0, source.channels);
  source.fields = plan.survey.fields.size();
  source.elements = plan.survey.mesh.elements.size();
  source.read_field = [&fields](std::size_t field, std::size_t sample, std::span<float> values) {
    fields.read(static_cast<std::uint32_t>(field), sample, values);
  };
  return source;
}

/// The state of a sample as written. For one thread.
class WrittenState {
 public:
  WrittenState(const BakePlan& plan, const ModelWriter& writer)
      : writer_(writer),
        positions_(3 * plan.survey.mesh.node_ids.size()),
        present_(plan.survey.lacks_elements() ? plan.survey.mesh.elements.size() : 0),
        eroded_(format::words_of_elements(present_.size())) {}

  void read(std::size_t sample) {
    writer_.read<float>(SectionId::node_positions, 0, sample * positions_.size(), std::span(positions_));
    if (present_.empty()) return;
    writer_.read<std::uint32_t>(SectionId::eroded_elements, 0, sample * eroded_.size(), std::span(eroded_));
    unpack_eroded(eroded_, present_);
  }
  [[nodiscard]] std::span<const float> positions() const noexcept { return positions_; }
  /// Per element; empty: all are.
  [[nodiscard]] std::span<const std::uint8_t> present() const noexcept { return present_; }

 private:
  const ModelWriter& writer_;
  std::vector<float> positions_;
  std::vector<std::uint8_t> present_;
  std::vector<std::uint32_t> eroded_;
};

/// What a rig measures of the samples.
void add_points(const BakePlan& plan, const ModelWriter& writer, std::shared_ptr<const DepthRenderer> renderer,
                SampleSource& source) {
  source.most_points = renderer->most_points();
  if (source.most_points == 0) return;
  source.points_of = [&plan, &writer, renderer = std::move(renderer)](std::size_t sample) {
    WrittenState state(plan, writer);
    state.read(sample);
    return renderer->points(state.positions(), state.present());
  };
}

/// What compares points with the samples: places of the observed surface, and the cells of the envelope.
void add_surface(const ReferenceBasis& first, const CommonMesh& mesh, bool has_landmarks, const EnvelopeGrid& envelope,
                 SampleSource& source) {
  source.grid = envelope_grid({envelope.corner, envelope.edge, envelope.cells, envelope.bits});
  source.surface = surface_places(first.vertex_nodes, mesh.elements, mesh.node_ids.size(), has_landmarks);
}

/// The depth images of further rigs, rendered of the samples that are written.
void write_more_views(const BakePlan& plan, const SampleSource& first, const BakeOptions& options,
                      ModelWriter& writer) {
  Stage rendering(options, "views", plan.more_cameras.size() * first.samples.size());
  for (std::uint32_t part = 1; part <= plan.more_cameras.size(); ++part) {
    const DepthCamera& camera = plan.more_cameras[part - 1];
    const bool is_given = part <= options.more_depth_renderers.size();
    const std::shared_ptr<const DepthRenderer> renderer =
        planned_renderer(is_given ? options.more_depth_renderers[part - 1] : DepthRendering(), plan.survey, camera);
    const std::size_t cells = padded_cells(camera);
    work_in_parallel(first.samples.size(), options.workers(), [&](const auto& next) {
      WrittenState state(plan, writer);
      std::vector<std::uint16_t> image(cells);
      for (std::size_t sample = next(); sample < first.samples.size(); sample = next()) {
        rendering.check();
        state.read(sample);
        renderer->render(state.positions(), state.present(), image);
        writer.write<std::uint16_t>(SectionId::view_depths, part, sample * cells, image);
        rendering.step();
      }
    });
    SampleSource source = first;
    source.camera = camera;
    add_points(plan, writer, renderer, source);
    source.channels.clear();  // their bounds are those of the first rig's frames
    source.read_images = [&](std::size_t sample, std::span<std::uint16_t> images) {
      writer.read<std::uint16_t>(SectionId::view_depths, part, sample * cells, images);
    };
    write_learned_fit(writer, camera, learn_fit(source, options.workers()), part);
  }
}

/// One row per run; NaN: not given.
Eigen::MatrixXd parameters_of(const BakePlan& plan) {
  const std::vector<EnsembleRun>& runs = plan.ensemble.runs;
  Eigen::MatrixXd parameters(std::ssize(runs), std::ssize(plan.ensemble.parameter_names));
  for (Eigen::Index run = 0; run < parameters.rows(); ++run)
    for (Eigen::Index p = 0; p < parameters.cols(); ++p)
      parameters(run, p) = runs[static_cast<std::size_t>(run)].parameters[static_cast<std::size_t>(p)];
  return parameters;
}

/// source: without points.
void write_what_fit_learns(const BakePlan& plan, SampleSource& source, const BakeOptions& options,
                           ModelWriter& writer) {
  add_points(plan, writer, planned_renderer(options.depth_renderer, plan.survey, *plan.camera), source);
  const LearnedFit learned = learn_fit(source, options.workers());
  write_learned_fit(writer, *plan.camera, learned, 0);
  source.prices = learned.costs.prices;
  write_more_views(plan, source, options, writer);
  write_channel_bounds(writer, learned);
  write_forecast(writer, learn_forecast(source, learned, parameters_of(plan), options.workers()));
}

BakeSummary summary_of(const format::Info& info, const std::vector<ReferenceBasis>& bases) {
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

/// The nodes as numbers, and how far they are from given points.
ChannelReport described(const PlannedChannel& channel, const Survey& survey) {
  ChannelReport report{channel.name, channel.unit, channel.kind, channel.component, channel.cfc, {}, channel.distances};
  for (const std::uint32_t node : channel.nodes) report.node_ids.push_back(survey.mesh.node_ids[node]);
  report.elements = channel.elements;
  report.areas = channel.areas;
  if (!report.elements.empty()) report.field = survey.fields[channel.field].name;
  report.history = channel.history;
  return report;
}

/// What a user can check: size, times, fields, and what was left out.
void add_facts(const BakePlan& plan, BakeSummary& summary) {
  const Survey& survey = plan.survey;
  for (std::size_t axis = 0; axis < 3; ++axis) summary.size[axis] = survey.max[axis] - survey.min[axis];
  summary.length_unit = plan.description.length_unit;
  summary.first_s = std::numeric_limits<double>::infinity();
  std::vector<double> intervals;
  for (const RunSurvey& run : survey.runs)
    for (std::size_t i = 0; i < run.times_s.size(); ++i) {
      summary.first_s = std::min(summary.first_s, run.times_s[i]);
      summary.last_s = std::max(summary.last_s, run.times_s[i]);
      if (i > 0) intervals.push_back(run.times_s[i] - run.times_s[i - 1]);
    }
  std::ranges::sort(intervals);
  if (!intervals.empty()) summary.interval_s = intervals[intervals.size() / 2];
  summary.stored_fields = survey.fields;
  summary.losses = survey.losses;
  for (std::size_t run = 0; run < survey.runs.size(); ++run)
    if (survey.runs[run].mapping) summary.mapped.push_back({plan.ensemble.runs[run].name, *survey.runs[run].mapping});
  summary.warnings = survey.warnings;
  for (const PlannedChannel& channel : plan.channels) summary.channels.push_back(described(channel, survey));
  constexpr std::size_t few = 5;
  const std::size_t runs = survey.runs.size();  // without those that were left out
  if (plan.camera && runs < few)
    summary.warnings.push_back(std::to_string(runs) +
                               (runs == 1 ? " run gives no verdict and no bound of the error"
                                          : " runs give coarse verdicts and bounds of the error") +
                               ": both are learned from left-out runs");
}

std::vector<std::string> zero_histories(const BakePlan& plan, const ModelWriter& writer) {
  std::vector<std::string> warnings;
  std::vector<float> values(plan.survey.samples());
  for (std::size_t c = 0; c < plan.channels.size(); ++c) {
    if (plan.channels[c].kind != ChannelKind::history) continue;
    writer.read<float>(SectionId::channel_values, 0, c * values.size(), std::span(values));
    if (auto warning = zero_history(plan, c, values)) warnings.push_back(std::move(*warning));
  }
  return warnings;
}

std::vector<std::string> names_of(const std::vector<RunLeftOut>& runs) {
  std::vector<std::string> names;
  for (const RunLeftOut& run : runs) names.push_back(run.name);
  return names;
}

std::vector<RoundedField> rounded_fields(const Survey& survey, const std::vector<float>& errors) {
  std::vector<RoundedField> fields;
  for (std::size_t field = 0; field < survey.fields.size(); ++field)
    fields.push_back({survey.fields[field].name, survey.fields[field].unit, errors[field]});
  return fields;
}

}  // namespace

CollectedRuns collect_runs(const WorkFolder& work, const BakePlan& plan) {
  std::vector<bool> are_kept;
  std::vector<RunLeftOut> left_out;
  std::string missing;
  std::size_t count = 0;
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    const std::string& name = plan.ensemble.runs[run].name;
    std::string reason = plan.runs[run].failure;
    const bool is_kept = reason.empty() && is_complete(work, plan.runs[run]);
    if (!is_kept && reason.empty()) reason = work.failure(plan.runs[run].record).value_or("");
    are_kept.push_back(is_kept);
    if (!reason.empty())
      left_out.push_back({name, reason});
    else if (!is_kept && ++count <= 5)
      missing += (missing.empty() ? "" : ", ") + name;
  }
  if (count > 0)
    throw Error(Status::bad_input, std::to_string(count) + " of " + std::to_string(plan.runs.size()) +
                                       " runs are not baked yet: " + missing + (count > 5 ? ", ..." : "") +
                                       "; run the shards that have them, then merge");
  if (!are_kept[plan.ensemble.reference_run])
    throw Error(Status::bad_input,
                "the reference run could not be baked, and cannot be left out: " + left_out.front().reason);
  return {without_runs(plan, are_kept), std::move(left_out)};
}

BakeSummary write_model(const WorkFolder& work, const CollectedRuns& runs, const std::filesystem::path& output,
                        const BakeOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const BakePlan& plan = runs.plan;
  const std::vector<ReferenceBasis> bases = read_bases(work, plan);
  const std::vector<std::string> left_out = names_of(runs.left_out);
  const EnvelopeBuilder layout(plan.survey.min, plan.survey.max, plan.description.margin());
  const ModelPlan model = plan_model(plan, bases, layout.layout(), left_out);
  ModelWriter writer(output, model.sections);
  model.small.write(writer);

  RunAppender appender(work, plan, bases, model.info, writer);
  Stage merging(options, "merging", plan.runs.size());
  for (std::size_t run = 0; run < plan.runs.size(); ++run) appender.append(run, merging);

  // What all samples determine together.
  const EnvelopeGrid envelope = appender.envelope().finish();
  for (std::uint32_t part = 0; part < model.info.references; ++part)
    writer.write<std::uint32_t>(SectionId::leading_axes, part, 0, appender.moments()[part].leading_axes());
  writer.write<std::uint32_t>(SectionId::simulation_branches, 0, 0, branches_of(plan, writer));
  if (plan.camera) {
    SampleSource source = source_of(plan, writer, appender.fields());
    add_surface(bases.front(), plan.survey.mesh, has_landmarks(model.info, plan.description), envelope, source);
    write_what_fit_learns(plan, source, options, writer);
  }
  writer.write<std::uint64_t>(SectionId::envelope_bits, 0, 0, envelope.bits);
  BakeSummary summary = summary_of(model.info, bases);
  summary.kept_variance = kept_share(bases, appender.moments());
  std::string provenance = provenance_json(plan, bases, summary.kept_variance, left_out);
  provenance.resize(model.provenance_size, ' ');
  writer.write<char>(SectionId::provenance, 0, 0, provenance);
  const std::vector<std::string> zeros = zero_histories(plan, writer);
  options.workers().check();
  writer.commit();
  summary.file_size = writer.file_size();
  summary.left_out = runs.left_out;
  add_facts(plan, summary);
  summary.warnings.insert(summary.warnings.end(), zeros.begin(), zeros.end());
  if (plan.description.compact_fields) summary.rounded_fields = rounded_fields(plan.survey, appender.fields().errors());
  summary.seconds = {plan.reading_seconds, plan.bases_seconds, 0, seconds_since(begin)};
  return summary;
}

}  // namespace lbea::bake
