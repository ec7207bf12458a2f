// Writes small LS-DYNA d3plot databases for tests of the reader, independently of its code.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace lbea::test {

/// Results of one layer of a shell or one integration point of a solid.
struct D3plotPoint {
  std::array<double, 6> stress{};  // xx yy zz xy yz zx
  double plastic_strain = 0;
  std::vector<double> history;
};

struct D3plotShellResult {
  std::vector<D3plotPoint> layers;
  double thickness = 0, internal_energy = 0;
  std::array<std::array<double, 6>, 2> strain{};  // inner, outer surface
};

struct D3plotState {
  double time = 0;
  std::vector<double> globals;  // as many as D3plot::globals; empty: noise
  std::vector<std::array<double, 3>> positions;
  std::vector<D3plotShellResult> shells;               // one per shell; those of rigid shells are not written
  std::vector<std::vector<D3plotPoint>> solids;        // one per solid
  std::vector<std::vector<D3plotPoint>> thick_shells;  // layers, one per entry of D3plot::thick_shell_nodes
  std::vector<double> node_flags;                      // deletion words, 0 = deleted
  std::vector<double> shell_flags, solid_flags, thick_shell_flags;
};

/// A database. Data that the reader skips (beams, thick shells, velocities, ...) are filled with noise.
struct D3plot {
  std::size_t word_bytes = 4;
  bool is_big_endian = false;
  int file_type = 1, ndim = 4;
  double version = 971;
  std::string title = "written by a test";

  std::vector<std::array<double, 3>> nodes;
  std::vector<std::array<std::uint32_t, 8>> solids;  // node indices from 0
  std::vector<std::array<std::uint32_t, 4>> shells;
  std::vector<int> solid_parts, shell_parts;  // from 1
  std::size_t beams = 0, thick_shells = 0;    // without area; not with thick_shell_nodes
  std::vector<std::array<std::uint32_t, 8>> thick_shell_nodes;
  std::vector<int> thick_shell_ids;
  std::size_t parts = 1;

  bool has_numbering = true, has_part_ids = true, has_titles = true;
  std::vector<int> node_ids, solid_ids, shell_ids, part_ids;
  std::vector<int> material_types;  // per part, written when ndim is 5 or 7; 20 is rigid

  std::size_t globals = 6;
  int it = 0, iu = 1, iv = 0, ia = 0, idtdt = 0;
  std::size_t extra_words = 0, solid_thermal = 0, eight_node_shells = 0;  // solid_thermal needs extra_words
  std::size_t layers = 1, solid_points = 1, history = 0;                  // layers are written as MAXINT
  bool has_stress = false, has_plastic_strain = true, has_forces = false, has_extra = false, has_strain = false;
  enum class Deletion { none, nodes, elements } deletion = Deletion::elements;
  std::map<std::size_t, std::int64_t> overrides;  // control words to write unchanged, for tests of refusals

  std::vector<D3plotState> states;
  std::size_t states_per_file = 0;  // 0: all in the first file, after the geometry
  bool has_end_markers = true;
  std::vector<std::size_t> file_numbers;  // of the continuations; empty: 1, 2, 3, ...
};

/// The files in order, each padded with zeros to a multiple of 512 words.
[[nodiscard]] std::vector<std::vector<std::byte>> d3plot_files(const D3plot& database);

/// Writes them as `folder/name`, `folder/name01`, ...; returns the first.
std::filesystem::path write_d3plot(const D3plot& database, const std::filesystem::path& folder,
                                   const std::string& name = "d3plot");

/// A bent plate of two by two quads and a triangle, and beside it a block of one brick, one wedge and one tetrahedron.
/// The results differ in every element, layer and state.
[[nodiscard]] D3plot sample_d3plot(std::size_t states);

/// Fills the results of the states again after a change of layers, points or history.
void fill_states(D3plot& database, std::size_t states);

/// Databases in one file each, by name: the initial corpus of the fuzzer.
[[nodiscard]] std::map<std::string, D3plot> d3plot_corpus();

}  // namespace lbea::test
