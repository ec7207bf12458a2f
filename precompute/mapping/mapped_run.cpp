#include "precompute/mapping/mapped_run.hpp"

#include "precompute/mapping/body_frame.hpp"
#include "precompute/survey/survey.hpp"
#include "precompute/work/archive.hpp"

#include <algorithm>

namespace lbea::bake {
namespace {
constexpr std::size_t most_kept = 8;  // mappings: of the runs that are being read, and of one mesh for many runs

class MappedRun final : public DerivedRun {
 public:
  MappedRun(std::unique_ptr<SimulationReader> run, std::shared_ptr<const SurfaceMapping> mapping, std::string name)
      : DerivedRun(std::move(run)), mapping_(std::move(mapping)), name_(std::move(name)) {}

  const SimulationMesh& mesh() const noexcept override { return mapping_->mesh; }
  std::optional<MappingReport> mapping() const override { return mapping_->report; }

  void read(std::uint32_t state, SimulationState& into) override {
    run_->read(state, state_);
    check_state(*run_, state_, name_, state);
    into.time_s = state_.time_s;
    carry(mapping_->nodes, state_.positions, into.positions);
    find_alive(into.alive);
    into.fields.resize(state_.fields.size());
    for (std::size_t field = 0; field < state_.fields.size(); ++field)
      average(state_.fields[field], into.fields[field]);
  }

 private:
  void find_alive(std::vector<std::uint8_t>& into) const {
    const auto is_alive = [&](std::uint32_t element) { return state_.alive[element] != 0; };
    into.resize(mapping_->sources.size());
    for (std::size_t e = 0; e < into.size(); ++e)
      into[e] = std::ranges::all_of(mapping_->sources[e], is_alive) &&
                        std::ranges::all_of(mapping_->mesh.elements[e],
                                            [&](std::uint32_t node) { return is_alive(mapping_->nodes[node].element); })
                    ? 1
                    : 0;
  }
  void average(const std::vector<float>& field, std::vector<float>& into) const {
    into.resize(mapping_->sources.size());
    for (std::size_t e = 0; e < into.size(); ++e) {
      double sum = 0;
      for (const std::uint32_t element : mapping_->sources[e]) sum += double{field[element]};
      into[e] = static_cast<float>(sum / static_cast<double>(mapping_->sources[e].size()));
    }
  }

  std::shared_ptr<const SurfaceMapping> mapping_;
  std::string name_;
  SimulationState state_;
};
}  // namespace

RunMapper::RunMapper(Opener reference, MappingSettings settings, std::string unit)
    : open_reference_(std::move(reference)), settings_(std::move(settings)), unit_(std::move(unit)) {}

std::unique_ptr<SimulationReader> RunMapper::mapped(std::unique_ptr<SimulationReader> reader, const std::string& run) {
  if (!settings_.enabled) return reader;
  check_mesh(reader->mesh(), run);
  if (has_numbers_of(reference(), reader->mesh())) return reader;
  try {
    auto mapping = mapping_of(reader->mesh());
    return std::make_unique<MappedRun>(std::move(reader), std::move(mapping), run);
  } catch (const Error& error) { throw Error(error.status, "run " + run + ": " + error.what()); }
}

const SimulationMesh& RunMapper::reference() {
  const std::lock_guard lock(mutex_);
  if (!reference_) {
    const auto reader = open_reference_();
    check_mesh(reader->mesh(), "with the reference mesh");
    reference_ = reader->mesh();
  }
  return *reference_;
}

RunMapper::Mapping RunMapper::mapping_of(const SimulationMesh& run) {
  const std::uint64_t key = key_of(run.positions, run.elements, run.element_parts, std::uint64_t{run.touching});
  const auto found = [&]() -> Mapping {
    const std::lock_guard lock(mutex_);
    const auto at = std::ranges::find(latest_, key, &std::pair<std::uint64_t, Mapping>::first);
    return at == latest_.end() ? nullptr : at->second;
  };
  if (Mapping known = found()) return known;
  auto mapping = std::make_shared<const SurfaceMapping>(map_surface(reference(), run, settings_, unit_));
  const std::lock_guard lock(mutex_);
  if (latest_.size() == most_kept) latest_.erase(latest_.begin());
  latest_.emplace_back(key, mapping);
  return mapping;
}

void map_runs(Ensemble& ensemble, const EnsembleDescription& description, const std::vector<bool>& is_mapped) {
  const auto mapper = std::make_shared<RunMapper>(ensemble.runs[ensemble.reference_run].open, description.mapping,
                                                  description.length_unit);
  const auto frame = std::make_shared<BodyFrame>(ensemble.runs[ensemble.reference_run].open, description.rigid);
  for (std::size_t i = 0; i < ensemble.runs.size(); ++i) {
    EnsembleRun& run = ensemble.runs[i];
    if (i != ensemble.reference_run && is_mapped[i])
      run.open = [mapper, open = run.open, name = run.name] { return mapper->mapped(open(), name); };
    if (description.rigid.are_set)
      run.open = [frame, open = run.open, name = run.name] { return frame->fixed(open(), name); };
  }
}
}  // namespace lbea::bake
