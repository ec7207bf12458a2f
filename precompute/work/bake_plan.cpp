#include "precompute/work/bake_plan.hpp"

#include "precompute/mapping/mapped_run.hpp"
#include "precompute/work/archive.hpp"

namespace lbea::bake {
namespace {
// To be raised with every change of the content of records, grids and images, or of how it is computed.
constexpr std::uint32_t work_version = 11;
// The number: to be raised with every change of the content of a plan.
constexpr WorkName plan_name{WorkKind::plan, 10};
}  // namespace

// Not in the unnamed namespace: the archive finds them by argument-dependent lookup.
static void members(auto& a, SimulationField& f) { a(f.name, f.unit, f.source); }
static void members(auto& a, SolverHistory& h) { a(h.name, h.owner, h.number); }
static void members(auto& a, SimulationHistory& h) { a(h.name, h.owner, h.ids); }
static void members(auto& a, InputFile& f) { a(f.name, f.size, f.hash); }
static void members(auto& a, MappingReport& m) {
  a(m.run_elements, m.elements, m.mapped_elements, m.mean, m.largest, m.worst_element, m.shift, m.tells_parts, m.key);
}
static void members(auto& a, MappingSettings& m) { a(m.enabled, m.distance, m.share, m.by_part, m.parts); }
static void members(auto& a, BodyFrameNodes& b) { a(b.are_set, b.ids); }
static void members(auto& a, RunSurvey& s) {
  a(s.steps, s.times_s, s.fields, s.histories, s.files, s.mapping, s.lacks_elements);
}
static void members(auto& a, RunHistory& h) {
  a(h.steps, h.times, h.fields, h.histories, h.files, h.remark, h.misfit, h.mapping, h.has_values, h.erosion, h.common,
    h.extents);
}
static void members(auto& a, CommonMesh& m) { a(m.node_ids, m.elements, m.element_ids, m.element_parts); }
static void members(auto& a, MeshLosses& l) {
  a(l.elements, l.nodes, l.eroded, l.missing, l.eroding, l.nodes_left_out, l.exposed, l.runs);
}
static void members(auto& a, Survey& s) {
  a(s.runs, s.mesh, s.reference_node_ids, s.min, s.max, s.fields, s.losses, s.warnings);
}
static void members(auto& a, StepSelection& s) { a(s.first, s.last, s.stride, s.list); }
static void members(auto& a, Box& b) { a(b.min, b.max); }
static void members(auto& a, RegionDescription& r) { a(r.parts, r.box, r.node_ids, r.node_file, r.sensors); }
static void members(auto& a, ChannelPoint& p) { a(p.is_node, p.node, p.position); }
static void members(auto& a, ChannelDescription& c) {
  a(c.name, c.kind, c.component, c.cfc, c.points, c.reach, c.field, c.parts, c.elements, c.history, c.unit);
}
static void members(auto& a, PlannedChannel& c) {
  a(c.name, c.unit, c.kind, c.component, c.cfc, c.nodes, c.distances, c.field, c.elements, c.areas, c.history,
    c.history_index);
}
static void members(auto& a, EnsembleDescription& d) {
  a(d.runs, d.reference_run, d.impact_step, d.steps, d.mode, d.modes, d.region, d.fields, d.parameters, d.length_unit,
    d.time_factor, d.envelope_margin, d.correspondence, d.compact_fields, d.landmarks, d.mapping, d.rigid, d.channels,
    d.depth_sensor, d.more_depth_sensors, d.output);
}
static void members(auto& a, EnsembleRun& r) { a(r.name, r.parameters, r.source, r.files); }
static void members(auto& a, Ensemble& e) {
  std::uint64_t reference_run = e.reference_run;
  a(e.runs, e.parameter_names, reference_run);
  e.reference_run = reference_run;
}
static void members(auto& a, PlannedRun& r) { a(r.modified, r.survey, r.record, r.grid_and_images, r.failure); }
static void members(auto& a, DepthCamera& c) {
  a(c.T_reference_sensor, c.focal, c.center_column, c.center_row, c.depth_origin, c.depth_step, c.columns, c.rows);
}
static void members(auto& a, BakePlan& p) {
  a(p.description, p.ensemble, p.survey, p.runs, p.bases, p.channels, p.camera, p.more_cameras);
}
static void members(auto& a, BakedTree& t) { a(t.order, t.boxes, t.ranges); }
static void members(auto& a, ReferenceBasis& b) {
  std::uint64_t degenerate = b.degenerate_triangles;
  a(b.time_s, b.vertex_nodes, b.vertex_positions, b.tree, b.mass, b.eigenvalues, b.projection, b.residual, b.solver,
    degenerate);
  b.degenerate_triangles = degenerate;
}
static void members(auto& a, ObservedRegion& r) { a(r.nodes, r.elements); }
static void members(auto& a, SimulationMesh& m) {
  a(m.positions, m.node_ids, m.elements, m.element_ids, m.element_parts, m.has_solver_ids);
}

namespace {
template <class T>
void write_value(const WorkFolder& work, WorkName name, const T& value) {
  WorkWriter file = work.writer(name);
  Saver{file}(value);
  file.commit();
}

template <class T>
T read_value(const WorkFolder& work, WorkName name) {
  WorkReader file = work.reader(name);
  T value;
  Loader{file}(value);
  file.finish();
  return value;
}
}  // namespace

void write_plan(const WorkFolder& work, const BakePlan& plan) { write_value(work, plan_name, plan); }

BakePlan read_plan(const WorkFolder& work, const RunOpener& opener) {
  if (!work.has(plan_name))
    throw Error(Status::bad_input, work.path().string() + " holds no plan of a bake; make one with lbea-bake plan");
  auto plan = read_value<BakePlan>(work, plan_name);
  for (EnsembleRun& run : plan.ensemble.runs) run.open = [source = run.source, opener] { return opener(source); };
  std::vector<bool> is_mapped;
  for (const RunSurvey& survey : plan.survey.runs) is_mapped.push_back(survey.mapping.has_value());
  map_runs(plan.ensemble, plan.description, is_mapped);
  return plan;
}

std::vector<ReferenceBasis> read_bases(const WorkFolder& work, const BakePlan& plan) {
  std::vector<ReferenceBasis> bases;
  try {
    for (const std::uint64_t key : plan.bases)
      bases.push_back(read_value<ReferenceBasis>(work, {WorkKind::basis, key}));
  } catch (const DamagedWorkFile& damaged) {
    work.remove(damaged);
    throw Error(Status::bad_input, std::string(damaged.what()) + "; it was removed, plan again");
  }
  return bases;
}

void write_basis(const WorkFolder& work, std::uint64_t key, const ReferenceBasis& basis) {
  write_value(work, {WorkKind::basis, key}, basis);
}

RunHistory read_survey(const WorkFolder& work, const PlannedRun& run) {
  return read_value<RunHistory>(work, run.survey_name());
}

void write_survey(const WorkFolder& work, const PlannedRun& run, const RunHistory& history) {
  write_value(work, run.survey_name(), history);
}

std::uint64_t survey_key(const SimulationMesh& reference, const EnsembleDescription& description) {
  return key_of(work_version, reference, description.steps, description.mapping, description.rigid,
                description.length_unit);  // remarks name lengths
}

std::uint64_t survey_key(std::uint64_t common_key, const std::string& name,
                         const std::vector<std::filesystem::path>& files, const std::vector<std::int64_t>& modified) {
  std::vector<std::string> names;
  std::vector<std::uint64_t> sizes;
  for (const auto& file : files) {
    names.push_back(file.filename().string());
    sizes.push_back(std::filesystem::file_size(file));
  }
  return key_of(common_key, name, names, sizes, modified);
}

std::uint64_t basis_key(const ObservedRegion& region, const CommonMesh& mesh, const std::vector<float>& positions,
                        std::uint32_t modes, double time_s) {
  return key_of(work_version, region, mesh.node_ids, positions, modes, time_s);
}

std::uint64_t camera_key(const DepthCamera& camera) { return key_of(camera); }

std::vector<std::int64_t> last_changes(const std::vector<std::filesystem::path>& files) {
  std::vector<std::int64_t> times;
  for (const auto& file : files) {
    std::error_code error;
    times.push_back(std::filesystem::last_write_time(file, error).time_since_epoch().count());
    if (error) throw Error(Status::bad_input, "cannot read " + file.string() + ": " + error.message());
  }
  return times;
}

void set_keys(BakePlan& plan) {
  std::uint64_t common = key_of(work_version, plan.survey.mesh, plan.bases, plan.survey.fields,
                                plan.description.correspondence, plan.description.rigid);
  if (!plan.channels.empty()) common = key_of(common, plan.channels, plan.description.time_factor);
  const std::uint64_t place = key_of(plan.survey.min, plan.survey.max, plan.description.margin(), plan.camera);
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    const RunSurvey& survey = plan.survey.runs[run];
    const std::string name =
        survey.files.empty() ? plan.ensemble.runs[run].name : "";  // runs without files differ only in name
    plan.runs[run].record = key_of(common, name, survey.files, survey.steps);
    if (survey.mapping) plan.runs[run].record = key_of(plan.runs[run].record, survey.mapping->key);
    plan.runs[run].grid_and_images = key_of(plan.runs[run].record, place);
  }
}

/// Only of runs that the plan still has.
static void keep_losses(BakePlan& plan) {
  MeshLosses& losses = plan.survey.losses;
  std::erase_if(losses.runs, [&](const std::string& name) {
    return std::ranges::find(plan.ensemble.runs, name, &EnsembleRun::name) == plan.ensemble.runs.end();
  });
  if (losses.runs.empty()) losses.eroding = 0;
}

BakePlan without_runs(const BakePlan& plan, const std::vector<bool>& is_kept) {
  BakePlan kept = plan;
  kept.ensemble.runs.clear();
  kept.survey.runs.clear();
  kept.runs.clear();
  for (std::size_t run = 0; run < plan.runs.size(); ++run) {
    if (!is_kept[run]) continue;
    if (run == plan.ensemble.reference_run) kept.ensemble.reference_run = kept.runs.size();
    kept.ensemble.runs.push_back(plan.ensemble.runs[run]);
    kept.survey.runs.push_back(plan.survey.runs[run]);
    kept.runs.push_back(plan.runs[run]);
  }
  keep_losses(kept);
  return kept;
}
}  // namespace lbea::bake
