// A simulation of a finished model, read as the run that it was baked from: the component's common mesh, the samples.
#pragma once

#include "precompute/simulation.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace lbea::bake {

class ModelRun : public SimulationReader {
 public:
  /// time_factor: seconds per unit of the run's times, as the model was baked with. file: the model's.
  ModelRun(Model model, std::uint32_t simulation, double time_factor, std::filesystem::path file);

  const SimulationMesh& mesh() const noexcept override { return mesh_; }
  const std::vector<SimulationField>& fields() const noexcept override { return fields_; }
  std::uint32_t states() const noexcept override { return states_; }
  /// This and read() throw Error{bad_config} for a state that is not one of the model's samples.
  double time_s(std::uint32_t state) const override;
  void read(std::uint32_t state, SimulationState& into) override;
  std::vector<std::filesystem::path> files() const override { return {file_}; }

 private:
  [[nodiscard]] std::uint32_t sample(std::uint32_t state) const;

  Model model_;
  std::uint32_t simulation_;
  double time_factor_;
  std::filesystem::path file_;
  SimulationMesh mesh_;
  std::vector<SimulationField> fields_;
  std::uint32_t states_ = 0;
};

}  // namespace lbea::bake
