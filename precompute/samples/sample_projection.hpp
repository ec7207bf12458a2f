// Second pass over the runs, method steps 3 and 5: every sample brought onto every reference mesh and projected.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/jobs/run_record.hpp"
#include "precompute/stage.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/correspondence.hpp"

#include <Eigen/Dense>

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lbea::bake {

/// What all runs are projected with, read-only.
class SampleProjection {
 public:
  /// Keeps references to both.
  SampleProjection(const BakePlan& plan, const std::vector<ReferenceBasis>& bases);

  /// Reads a run and writes its record, with one state in memory; a step of the stage is a sample.
  /// low, high: the box of its nodes as surveyed.
  /// Throws Error{bad_input} naming the run, also when it leaves that box, Error{write_failed} and BakeCancelled.
  void project_run(std::size_t run, SimulationReader& reader, const std::array<std::array<float, 3>, 2>& box,
                   WorkWriter& record, Stage& stage) const;

 private:
  friend class RunProjector;
  const BakePlan& plan_;
  const std::vector<ReferenceBasis>& bases_;
  std::vector<Eigen::MatrixXd> reference_positions_;     // per reference, n x 3
  std::vector<Eigen::MatrixXd> reference_coefficients_;  // per reference, p x 3
};

}  // namespace lbea::bake
