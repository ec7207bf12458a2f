// What a sensed experiment really looked like: the run it was sensed from, on the model's nodes.
#pragma once

#include "precompute/simulation.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace lbea::tool {

class Truth {
 public:
  struct Row {
    std::uint64_t frame = 0;
    std::filesystem::path cloud;  // the frame's file
    std::int64_t stamp_ns = 0;
    double state = 0;  // of the run; between two states the mesh is interpolated
    double time_s = 0;
  };

  /// `table`: truth.csv as lbea-sense writes it, columns found by name. Throws Error{bad_input} naming file and line.
  Truth(const std::filesystem::path& table, std::unique_ptr<bake::SimulationReader> run, const Model& model);

  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }
  /// The row captured at this stamp; nullptr when there is none. Frames are told apart by their stamps, because a
  /// sender that loops or skips numbers its frames anew.
  [[nodiscard]] const Row* at(std::int64_t stamp_ns) const noexcept;
  /// model nodes x 3: the true mesh of a row.
  [[nodiscard]] const std::vector<float>& positions(const Row& row);

 private:
  void read_state(std::uint32_t state, std::vector<float>& into);

  std::vector<Row> rows_;
  std::unique_ptr<bake::SimulationReader> run_;
  std::vector<std::uint32_t> node_of_;  // model node -> node of the run
  bake::SimulationState state_;
  std::vector<float> positions_, next_;
};

}  // namespace lbea::tool
