// The control words of a d3plot database: what is in it and how much of each.
#pragma once

#include "adapters/simulation/d3plot/words.hpp"

namespace lbea::io::d3plot {

enum class Deletion { none, nodes, elements };

/// Names in comments are those of the LS-DYNA database manual.
struct Header {
  std::uint64_t control_words = 0;   // 64 + EXTRA
  bool stores_rigid_shells = false;  // a d3part file writes results of rigid shells, a d3plot file does not
  bool has_material_types = false;   // NDIM 5 and 7
  bool has_road = false;             // NDIM 7

  std::uint64_t nodes = 0;             // NUMNP
  std::uint64_t solids = 0;            // NEL8
  std::uint64_t thick_shells = 0;      // NELT
  std::uint64_t beams = 0;             // NEL2
  std::uint64_t shells = 0;            // NEL4
  std::uint64_t parts = 0;             // NMMAT, 0 when the file lists none
  std::uint64_t fluid_materials = 0;   // IALEMAT
  std::uint64_t numbering_words = 0;   // NARBS
  std::uint64_t extra_node_words = 0;  // connectivity of higher-order elements after the numbering

  std::uint64_t globals = 0;              // NGLBV
  bool has_positions = false;             // IU
  std::uint64_t node_words = 0;           // per node: positions, temperatures, velocities, ...
  std::uint64_t solid_thermal_words = 0;  // NT3D, per solid
  std::uint64_t solid_words = 0;          // NV3D, per solid
  std::uint64_t thick_shell_words = 0;    // NV3DT
  std::uint64_t beam_words = 0;           // NV1D
  std::uint64_t shell_words = 0;          // NV2D
  std::uint64_t solid_history = 0;        // NEIPH
  std::uint64_t shell_history = 0;        // NEIPS
  std::uint64_t shell_points = 0;         // through-thickness layers times in-plane points
  bool has_solid_stress = false, has_solid_plastic_strain = false;
  bool has_shell_stress = false, has_shell_plastic_strain = false;  // IOSHL(1), IOSHL(2)
  bool has_shell_forces = false, has_shell_extra = false;           // IOSHL(3), IOSHL(4)
  bool has_strain = false;                                          // ISTRN
  Deletion deletion = Deletion::none;                               // MDLOPT
};

/// Detects the word size, sets it in `file`, and reads the control words.
/// Throws Error{bad_input | unsupported_input}.
[[nodiscard]] Header read_header(WordFile& file);

}  // namespace lbea::io::d3plot
