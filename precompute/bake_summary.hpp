// What a bake made.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lbea::bake {

/// A run that is not in the model, and why.
struct RunLeftOut {
  std::string name, reason;
};

/// A field stored in 16 bits, and how far any of its values may be off.
struct RoundedField {
  std::string name, unit;
  float largest_error = 0;
};

struct BakeSummary {
  std::uint32_t vertices = 0, modes = 0, samples = 0, simulations = 0, references = 0;  // n, p, s
  std::uint32_t nodes = 0, elements = 0, fields = 0, parameters = 0;                    // N, E
  std::uint64_t file_size = 0;
  double kept_variance = 0;   // share of the samples' variance that p modes keep; NaN when nothing varies
  double basis_residual = 0;  // the largest of all references, see Eigenbasis
  std::string basis_solver;
  std::size_t degenerate_triangles = 0;  // of the reference meshes, skipped
  double highest_eigenvalue = 0;         // of the first reference, 1 / length^2
  std::vector<RunLeftOut> left_out;      // in the ensemble's order
  std::vector<RoundedField> rounded_fields;
  struct Seconds {
    double reading = 0, bases = 0, samples = 0, writing = 0;  // of the steps that this process did; writing: the merge
  } seconds;
};

}  // namespace lbea::bake
