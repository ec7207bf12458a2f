#include "precompute/samples/sample_record.hpp"

#include "precompute/channels/channel_history.hpp"
#include "precompute/parallel.hpp"
#include "precompute/survey/surface_continuation.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/correspondence.hpp"
#include "runtime/src/model/eroded_elements.hpp"

#include <algorithm>
#include <atomic>
#include <numeric>

namespace lbea::bake {
namespace {
// Psi' M f, summed vertex by vertex: the order of summation of a library's product depends on the processor's cache
// sizes, which differ between the nodes of a cluster. Blocks of eight modes stay in registers.
Eigen::MatrixXd product(const Eigen::MatrixXd& projection, const Eigen::MatrixXd& f) {
  constexpr Eigen::Index block = 8;
  Eigen::MatrixXd alpha = Eigen::MatrixXd::Zero(projection.rows(), 3);
  Eigen::Index first = 0;
  for (; first + block <= projection.rows(); first += block) {
    Eigen::Matrix<double, block, 3> sum = Eigen::Matrix<double, block, 3>::Zero();
    for (Eigen::Index v = 0; v < projection.cols(); ++v) {
      const Eigen::Matrix<double, block, 1> weights = projection.block<block, 1>(first, v);
      for (Eigen::Index axis = 0; axis < 3; ++axis) sum.col(axis) += weights * f(v, axis);
    }
    alpha.middleRows<block>(first) = sum;
  }
  for (Eigen::Index v = 0; v < projection.cols(); ++v)
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      alpha.col(axis).tail(projection.rows() - first) += projection.col(v).tail(projection.rows() - first) * f(v, axis);
  return alpha;
}

CellGrid grid_around(const std::array<std::array<float, 3>, 2>& box, std::size_t nodes) {
  constexpr std::size_t most_cells = std::size_t{1} << 20;
  const std::size_t cells =
      std::clamp<std::size_t>(2 * nodes, 64, most_cells);  // most cells around folded sheets are empty
  return bounding_grid(box, static_cast<std::uint32_t>(cells));
}

/// What all runs are projected with, read-only.
struct Projections {
  explicit Projections(std::vector<ReferenceBasis> all) : bases(std::move(all)) {
    for (const ReferenceBasis& basis : bases) {
      Eigen::MatrixXd positions(basis.mass.size(), 3);
      for (Eigen::Index v = 0; v < positions.rows(); ++v)
        for (Eigen::Index axis = 0; axis < 3; ++axis)
          positions(v, axis) =
              double{basis.vertex_positions[static_cast<std::size_t>(v)][static_cast<std::size_t>(axis)]};
      reference_coefficients.push_back(product(basis.projection, positions));
      reference_positions.push_back(std::move(positions));
    }
  }

  std::vector<ReferenceBasis> bases;
  std::vector<Eigen::MatrixXd> reference_positions;     // per reference, n x 3
  std::vector<Eigen::MatrixXd> reference_coefficients;  // per reference, p x 3
};

/// Projects one run; holds one state in memory.
class RunProjector {
 public:
  /// box: of the run's positions, from its survey.
  RunProjector(const BakePlan& plan, const Projections& projections, const std::array<std::array<float, 3>, 2>& box)
      : plan_(plan),
        projections_(projections),
        sample_(plan, projections.bases),
        present_(plan.survey.mesh.elements.size(), 1),
        index_(grid_around(box, sample_.positions.size() / 3),
               static_cast<std::uint32_t>(sample_.positions.size() / 3)),
        corresponding_(projections.bases.front().vertex_nodes.size()),
        places_(projections.bases.front().vertex_nodes.size()),
        moments_(projections.bases.size()) {}

  /// Writes the run's record; a step of the stage is a sample. reference: the reference run's mesh, for places that the
  /// run's own lacks; or nullptr. Throws Error{bad_input} naming the run, also when a node is outside the box.
  void project(SimulationReader& reader, const SimulationMesh* reference, std::size_t run, WorkWriter& record,
               Stage& stage) {
    const std::string& name = plan_.ensemble.runs[run].name;
    const RunSurvey& survey = plan_.survey.runs[run];
    const MeshMapping mapping = map_common(plan_.survey.mesh, reader.mesh(), name);
    ChannelRecorder channels(plan_.channels, mapping.nodes);
    SurfaceContinuation continuation(reader.mesh(), plan_.survey.mesh, mapping, reference);
    for (const std::uint32_t step : states_to_read(reader, survey)) {
      stage.check();
      const bool is_sample = std::ranges::binary_search(survey.steps, step);
      reader.read(step, state_);
      if (is_sample) check_state(reader, state_, name, step);
      continuation.apply(state_);
      if (needs_all_states())
        channels.add(state_.positions, reader.mesh().node_ids, time_s(reader, step), name,
                     free_nodes(reader.mesh(), state_.alive));
      if (!is_sample) continue;
      if (survey.lacks_elements) find_present(reader.mesh(), mapping, step, name);
      copy_positions(mapping);
      copy_fields(mapping, survey);
      channels.add_fields(sample_.fields, present_, plan_.survey.fields, plan_.survey.mesh.element_ids, step, name);
      find_surface_nodes(survey);
      if (index_.build(points_, identity_transform).used != points_.size())
        throw Error(Status::bad_input, "run " + name + " changed while it was read; bake again");
      for (std::size_t part = 0; part < moments_.size(); ++part) project_onto(part);
      write_sample(record, sample_, survey);
      stage.step();
    }
    add_histories(channels, reader, survey, name);
    write_moments(record, moments_);
    write_channel_values(record, channels.values(survey.steps, name));
  }

 private:
  /// Channels of nodes do: displacements count from the first one, derivatives depend on the neighbors.
  [[nodiscard]] bool needs_all_states() const {
    return std::ranges::any_of(plan_.channels, [](const PlannedChannel& c) { return is_of_nodes(c.kind); });
  }
  [[nodiscard]] std::vector<std::uint32_t> states_to_read(const SimulationReader& reader,
                                                          const RunSurvey& survey) const {
    if (!needs_all_states()) return survey.steps;
    std::vector<std::uint32_t> states(reader.states());
    std::iota(states.begin(), states.end(), 0u);
    return states;
  }
  [[nodiscard]] double time_s(const SimulationReader& reader, std::uint32_t state) const {
    return reader.time_s(state) * plan_.description.time_factor;
  }

  void add_histories(ChannelRecorder& channels, SimulationReader& reader, const RunSurvey& survey,
                     const std::string& name) const {
    for (std::size_t c = 0; c < plan_.channels.size(); ++c)
      if (const PlannedChannel& channel = plan_.channels[c]; channel.kind == ChannelKind::history)
        channels.set_values(c, history_values(channel, reader, survey.histories.at(channel.history_index), survey.steps,
                                              plan_.description.time_factor, name));
  }

  void copy_positions(const MeshMapping& mapping) {
    for (std::size_t i = 0; i < mapping.nodes.size(); ++i) {
      const float* from = &state_.positions[3 * std::size_t{mapping.nodes[i]}];
      std::copy_n(from, 3, &sample_.positions[3 * i]);
    }
  }

  void find_present(const SimulationMesh& mesh, const MeshMapping& mapping, std::uint32_t step,
                    const std::string& name) {
    const std::vector<std::uint8_t> surface = exposed_elements(mesh, state_.alive);
    for (std::size_t e = 0; e < present_.size(); ++e) present_[e] = surface[mapping.elements[e]];
    pack_eroded(present_, sample_.eroded);
    if (std::ranges::find(present_, 1) == present_.end())
      throw Error(Status::bad_input, "run " + name + ", state " + std::to_string(step) +
                                         ": all elements are eroded; leave out this state and later ones");
  }

  /// Those that a sensor could see: without the nodes of which all elements are eroded, and those inside of solids.
  void find_surface_nodes(const RunSurvey& survey) {
    const std::size_t nodes = sample_.positions.size() / 3;
    std::vector<std::uint8_t> is_seen(nodes, survey.lacks_elements ? 0 : 1);
    for (std::size_t e = 0; survey.lacks_elements && e < present_.size(); ++e)
      for (const std::uint32_t node : plan_.survey.mesh.elements[e])
        if (present_[e] != 0) is_seen[node] = 1;
    surface_nodes_.clear();
    points_.clear();
    for (std::uint32_t node = 0; node < nodes; ++node) {
      if (is_seen[node] == 0) continue;
      const float* at = &sample_.positions[3 * std::size_t{node}];
      surface_nodes_.push_back(node);
      points_.push_back({at[0], at[1], at[2]});
    }
  }

  void copy_fields(const MeshMapping& mapping, const RunSurvey& run) {
    for (std::size_t field = 0; field < run.fields.size(); ++field) {
      const std::vector<float>& from = state_.fields[run.fields[field]];
      for (std::size_t e = 0; e < mapping.elements.size(); ++e) sample_.fields[field][e] = from[mapping.elements[e]];
      for (std::size_t e = 0; e < present_.size(); ++e)
        if (present_[e] == 0) sample_.fields[field][e] = std::numeric_limits<float>::quiet_NaN();
    }
  }

  // Step 3: the nearest node of the whole deformed surface for every vertex of sim_ref: at a hole one around it, as the
  // frame of such a component has only points around it. Step 5: alpha = Psi' M f (f = x, y, z).
  void project_onto(std::size_t part) {
    const ReferenceBasis& reference = projections_.bases[part];
    correspond(index_, reference.vertex_positions, corresponding_, places_);
    if (!sample_.correspondence.empty())
      std::ranges::transform(places_, sample_.correspondence[part].begin(),
                             [&](std::uint32_t place) { return surface_nodes_[place]; });
    Eigen::MatrixXd f(reference.mass.size(), 3);
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      for (Eigen::Index v = 0; v < f.rows(); ++v)
        f(v, axis) = double{corresponding_.planes[static_cast<std::size_t>(axis)][static_cast<std::size_t>(v)]};
    const Eigen::MatrixXd alpha = product(reference.projection, f);
    copy_coefficients(part, alpha);
    moments_[part].add(reference.mass, f - projections_.reference_positions[part],
                       alpha - projections_.reference_coefficients[part]);
  }

  void copy_coefficients(std::size_t part, const Eigen::MatrixXd& alpha) {
    std::vector<float>& planes = sample_.coefficients[part];  // their padding stays zero
    const std::size_t plane = planes.size() / 3;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t mode = 0; mode < static_cast<std::size_t>(alpha.rows()); ++mode)
        planes[axis * plane + mode] =
            static_cast<float>(alpha(static_cast<Eigen::Index>(mode), static_cast<Eigen::Index>(axis)));
  }

  const BakePlan& plan_;
  const Projections& projections_;
  SampleRecord sample_;
  SimulationState state_;
  std::vector<std::uint8_t> present_;         // E, 0 = the sample lacks it
  std::vector<std::uint32_t> surface_nodes_;  // of the sample
  std::vector<Point> points_;                 // their positions
  CloudIndex index_;
  Positions corresponding_;            // n
  std::vector<std::uint32_t> places_;  // n, places in surface_nodes_
  std::vector<Moments> moments_;       // per reference
};

/// Shared by all threads.
class SampleMaker {
 public:
  SampleMaker(const WorkFolder& work, const BakePlan& plan, const BakeOptions& options)
      : work_(work),
        plan_(plan),
        options_(options),
        projections_(read_bases(work, plan)),
        node_indices_(reference_places(plan.survey)),
        renderer_(make_renderer()) {}

  [[nodiscard]] SampleRecord buffer() const { return {plan_, projections_.bases}; }

  /// False when the run is broken; its failure is noted.
  bool make_run(std::size_t run, SampleRecord& buffer, Stage& stage) const {
    const PlannedRun& planned = plan_.runs[run];
    try {
      make_missing(run, buffer, stage);
      work_.forget_failure(planned.record);
      return true;
    } catch (const DamagedWorkFile& damaged) {  // the run itself is not broken
      work_.remove(damaged);
      throw Error(Status::bad_input, std::string(damaged.what()) + "; it was removed, plan again");
    } catch (const Error& error) {
      if (!options_.leaves_out_broken || error.status == Status::write_failed) throw;
      work_.note_failure(planned.record, error.what());
      return false;
    }
  }

 private:
  [[nodiscard]] std::unique_ptr<DepthRenderer> make_renderer() const {
    return plan_.camera ? planned_renderer(options_.depth_renderer, plan_.survey, *plan_.camera) : nullptr;
  }

  void make_missing(std::size_t run, SampleRecord& buffer, Stage& stage) const {
    const PlannedRun& planned = plan_.runs[run];
    if (!work_.has(planned.record_name())) make_record(run, stage);  // steps 3 and 5
    if (work_.has(planned.grid_and_images_name())) return;
    try {
      write_grid_and_images(work_, plan_, run, buffer, renderer_.get());
    } catch (const DamagedWorkFile& damaged) {  // the record of an earlier process
      work_.remove(damaged);
      make_record(run, stage);
      write_grid_and_images(work_, plan_, run, buffer, renderer_.get());
    }
  }

  void make_record(std::size_t run, Stage& stage) const {
    const auto reader = plan_.ensemble.runs[run].open();
    check_unchanged(run, all_files(*reader));
    const auto box = box_of(read_survey(work_, plan_.runs[run]).extents, node_indices_);
    WorkWriter record = work_.writer(plan_.runs[run].record_name());
    const auto reference =
        reader->mesh().guessed.empty() ? nullptr : plan_.ensemble.runs[plan_.ensemble.reference_run].open();
    RunProjector(plan_, projections_, box)
        .project(*reader, reference != nullptr ? &reference->mesh() : nullptr, run, record, stage);
    check_unchanged(run, all_files(*reader));
    record.commit();
  }

  void check_unchanged(std::size_t run, const std::vector<std::filesystem::path>& files) const {
    if (last_changes(files) != plan_.runs[run].modified)
      throw Error(Status::bad_input, "the files of run " + plan_.ensemble.runs[run].name +
                                         " changed since the bake was planned; plan again");
  }

  const WorkFolder& work_;
  const BakePlan& plan_;
  const BakeOptions& options_;
  Projections projections_;
  std::vector<std::uint32_t> node_indices_;  // in the surveys
  std::unique_ptr<DepthRenderer> renderer_;
};
}  // namespace

std::vector<std::size_t> surveyed_runs(const BakePlan& plan) {
  std::vector<std::size_t> runs;
  for (std::size_t run = 0; run < plan.runs.size(); ++run)
    if (plan.runs[run].failure.empty()) runs.push_back(run);
  return runs;
}

void plan_samples(BakePlan& plan, const BakeOptions& options) {
  const Survey& survey = plan.survey;
  const auto camera_of = [&](const DepthRendering& rendering) {
    return rendering(survey.mesh, survey.min, survey.max)->camera();
  };
  if (options.depth_renderer) plan.camera = camera_of(options.depth_renderer);
  for (const DepthRendering& rendering : options.more_depth_renderers)
    plan.more_cameras.push_back(camera_of(rendering));
  set_keys(plan);
}

std::size_t make_samples(const WorkFolder& work, const BakePlan& plan, const std::vector<std::size_t>& runs,
                         const BakeOptions& options) {
  if (runs.empty()) return 0;
  const SampleMaker shared(work, plan, options);
  std::uint64_t samples = 0;
  for (const std::size_t run : runs) samples += plan.survey.runs[run].steps.size();
  Stage stage(options, "samples", samples);
  std::atomic<std::size_t> failed{0};
  work_in_parallel(runs.size(), options.workers(), [&](const auto& next) {
    SampleRecord buffer = shared.buffer();
    for (std::size_t i = next(); i < runs.size(); i = next())
      if (!shared.make_run(runs[i], buffer, stage)) ++failed;
  });
  return failed;
}
}  // namespace lbea::bake
