#include "precompute/jobs/model_run.hpp"

#include <cmath>
#include <limits>
#include <utility>

namespace lbea::bake {
namespace {

SimulationMesh mesh_of(const Model& model) {
  SimulationMesh mesh;
  const auto positions = model.node_positions(0);
  const auto corners = model.element_nodes();
  mesh.positions.assign(positions.begin(), positions.end());
  mesh.node_ids.assign(model.node_ids().begin(), model.node_ids().end());
  mesh.element_ids.assign(model.element_ids().begin(), model.element_ids().end());
  mesh.element_parts.assign(model.element_parts().begin(), model.element_parts().end());
  for (std::size_t e = 0; e < model.elements(); ++e)
    mesh.elements.push_back({corners[4 * e], corners[4 * e + 1], corners[4 * e + 2], corners[4 * e + 3]});
  return mesh;
}

// What gives `seconds` when it is multiplied again; division alone may be a bit off.
double in_units(double seconds, double factor) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const double time = seconds / factor;
  for (const double near : {time, std::nextafter(time, infinity), std::nextafter(time, -infinity)})
    if (near * factor == seconds) return near;
  return time;
}

}  // namespace

ModelRun::ModelRun(Model model, std::uint32_t simulation, double time_factor, std::filesystem::path file)
    : model_(std::move(model)),
      simulation_(simulation),
      time_factor_(time_factor),
      file_(std::move(file)),
      mesh_(mesh_of(model_)) {
  for (std::uint32_t field = 0; field < model_.fields(); ++field)
    if (model_.field(field).location == FieldInfo::Location::element)
      fields_.push_back({std::string(model_.field(field).name), std::string(model_.field(field).unit)});
  for (std::uint32_t s = 0; s < model_.samples(); ++s)
    if (model_.sample(s).simulation == simulation_) states_ = model_.sample(s).time_step + 1;
}

std::uint32_t ModelRun::sample(std::uint32_t state) const {
  const std::uint32_t place = model_.sample_index({simulation_, state});
  if (place == model_.samples())
    throw Error(Status::bad_config, file_.string() + " does not hold state " + std::to_string(state) + " of run " +
                                        std::string(model_.simulation_name(simulation_)) +
                                        "; select the steps it was baked with, or read the run itself");
  return place;
}

double ModelRun::time_s(std::uint32_t state) const {
  return in_units(model_.sample_time_s(sample(state)), time_factor_);
}

void ModelRun::read(std::uint32_t state, SimulationState& into) {
  const std::uint32_t place = sample(state);
  const auto positions = model_.node_positions(place);
  into.time_s = time_s(state);
  into.positions.assign(positions.begin(), positions.end());
  into.alive.assign(model_.elements(), 1);
  into.fields.resize(fields_.size());
  for (std::uint32_t field = 0, next = 0; field < model_.fields(); ++field) {
    if (model_.field(field).location != FieldInfo::Location::element) continue;
    into.fields[next].resize(model_.field_size(field));
    model_.read_field(field, place, into.fields[next++]);
  }
}

}  // namespace lbea::bake
