// An open d3plot database: control words, geometry, layout of a state, and the place of each state in the files.
#pragma once

#include "adapters/simulation/d3plot/words.hpp"
#include "precompute/simulation.hpp"

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
  std::uint64_t materials = 0;         // NUMMAT8 + NUMMAT2 + NUMMAT4 + NUMMATT
  std::uint64_t fluid_materials = 0;   // IALEMAT
  std::uint64_t numbering_words = 0;   // NARBS
  std::uint64_t extra_node_words = 0;  // connectivity of higher-order elements after the numbering

  double version = 0;                     // of LS-DYNA
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

/// Elements of one kind. Node indices count from 0, parts are numbers inside the database, from 1.
template <std::size_t Corners>
struct Elements {
  std::vector<std::array<std::uint32_t, Corners>> nodes;
  std::vector<std::uint32_t> parts;
  std::vector<std::uint32_t> ids;

  [[nodiscard]] std::size_t size() const noexcept { return nodes.size(); }
};

/// Nodes, elements and their numbering.
struct Geometry {
  std::vector<float> positions;         // nodes x 3
  std::vector<std::uint32_t> node_ids;  // nodes
  Elements<8> solids;                   // then the thick shells, which have the same corners
  Elements<4> shells;
  std::vector<std::uint8_t> shell_is_rigid;  // shells; a rigid shell has no row in the states of a d3plot file
  std::uint64_t rigid_shells = 0;
  std::vector<std::uint32_t> part_ids;  // by database number - 1; empty: the number is the id
  std::uint64_t moving_roads = 0;
  std::uint64_t end_word = 0;  // where states may begin in the first file
};

/// Reads what follows the control words. Throws Error{bad_input}.
[[nodiscard]] Geometry read_geometry(const WordFile& file, const Header& header);

/// The contents of one element's row. Points are through-thickness layers or integration points.
struct RowFields {
  std::uint64_t points = 0, point_words = 0;
  std::optional<std::uint64_t> stress;          // in each point: xx yy zz xy yz zx
  std::optional<std::uint64_t> plastic_strain;  // in each point
  std::optional<std::uint64_t> thickness, internal_energy;
  std::optional<std::uint64_t> strain;  // first of `strains` tensors, `strain_stride` apart
  std::uint64_t strains = 0, strain_stride = 0;
};

struct Block {
  std::uint64_t start = 0, rows = 0, row_words = 0;
};

/// The layout of one state, in words from its start.
struct StateLayout {
  std::uint64_t words = 0;  // of one state
  std::uint64_t positions = 0;
  Block solids, thick_shells, shells;
  RowFields solid, thick_shell, shell;
  // first words of the deletion flags: one per node or one per element; those of thick shells follow those of solids
  std::uint64_t node_flags = 0, solid_flags = 0, shell_flags = 0;
};

/// Throws Error{bad_input} when the control words contradict each other.
[[nodiscard]] StateLayout lay_out_state(const WordFile& file, const Header& header, const Geometry& geometry);

/// The global values (NGLBV) whose meaning is certain: of the run, of parts, of rigid walls.
struct StoredHistories {
  std::vector<bake::SimulationHistory> histories;
  std::vector<std::uint64_t> words;  // of each of their numbers, from the start of a state
};
/// part_ids: of the geometry. Without parts where the control words leave their number or place open.
[[nodiscard]] StoredHistories stored_histories(const Header& header, const std::vector<std::uint32_t>& part_ids);

enum class Field { plastic_strain, von_mises, thickness, internal_energy, effective_strain };

/// The fields that solids, thick shells or shells store, in the order of Field.
[[nodiscard]] std::vector<Field> stored_fields(const StateLayout& layout);
[[nodiscard]] bake::SimulationField describe(Field field);

/// The field's value from one row: the maximum over its points; 0 when it is not stored.
[[nodiscard]] float field_value(Field field, const RowFields& fields, std::span<const float> row);

struct StatePlace {
  std::uint32_t file = 0;  // index in the family
  std::uint64_t word = 0;
  double time_s = 0;
};

struct Database {
  Header header;
  Geometry geometry;
  StateLayout layout;
  std::uint64_t word_bytes = 4;
  std::vector<std::filesystem::path> family;
  std::vector<StatePlace> states;
  std::string remark;  // as in SimulationReader
};

/// Throws Error{file_not_found | bad_input | unsupported_input}.
[[nodiscard]] Database open_database(const std::filesystem::path& first_file);

/// Reads the states of an open database, keeping one file open.
class StateFile {
 public:
  explicit StateFile(const Database& database);
  /// Reads `into.size()` words of the state at `place`, from word `start` of the state.
  void read(const StatePlace& place, std::uint64_t start, std::span<float> into);
  [[nodiscard]] double real(const StatePlace& place, std::uint64_t word);

 private:
  WordFile& file_of(const StatePlace& place);

  std::vector<std::filesystem::path> family_;
  std::uint64_t word_bytes_;
  std::uint32_t open_ = 0;
  std::optional<WordFile> file_;
};
}  // namespace lbea::io::d3plot
