// Opens one simulation run of any format as a SimulationReader.
#pragma once

#include "precompute/simulation.hpp"

#include <lbea/lbea.hpp>

namespace lbea::io {
/// Opens the run at `path`: the first file of a run, or a folder that holds a file named d3plot or one run of another
/// format. The format is recognized by content, not by name. Files whose names differ in the number before the
/// extension are states of one run: they share one mesh, as do all states. Their times are the files' own, in their
/// unit, else the number of the state; a gap in the numbers is refused then. A file with point arrays
/// displacement_t<time> is a run of its own. is_alone: so is any file, also when its name has a number.
/// Throws Error{file_not_found | bad_input | unsupported_input} with a sentence that names file, byte and what to do.
std::unique_ptr<bake::SimulationReader> open_simulation(const std::filesystem::path& path, bool is_alone = false);

/// The names of all formats, separated by commas; and a table of them for --list-formats, a line each.
[[nodiscard]] std::string simulation_format_names();
[[nodiscard]] std::string list_simulation_formats();

/// Opens an LS-DYNA d3plot family by its first file (`d3plot`; `d3plot01`, `d3plot02`, ... `d3plot100` beside it
/// are found and read in numeric order; a missing one is refused).
///
/// Mesh: the shells, then the faces owned by exactly one solid or thick shell; only nodes that these use. Ids are the
/// solver's when the file has them (NARBS), else counted from 1. Beams are not part of the surface. With deletion words
/// per element, the faces by which two solids touch are appended.
///
/// Fields, as far as they are stored: `plastic_strain` and `von_mises` (the maximum over the through-thickness layers
/// of a shell or thick shell, over the integration points of a solid), `thickness`, `internal_energy` (per volume, as
/// LS-DYNA writes it for shells), `effective_strain` (the larger of the two surfaces of a shell). 0 where a kind of
/// element has no such value. An element is eroded when its own deletion word is 0 or, with deletion words per node,
/// one of its nodes' is.
///
/// Histories: the global values of the states, and those of the binout files beside it; see d3plot/binout.hpp. A
/// damaged binout is not used, which remark() says.
///
/// A last state that the file cuts short (an interrupted run) is dropped; a cut anywhere else, decreasing times, and
/// geometry that its file is too short for are refused. A database may have 0 states.
/// Throws Error{file_not_found | bad_input | unsupported_input}; unsupported are compressed (FEMZIP), big-endian,
/// two-dimensional, adaptive, particle, fluid and eigenvector databases, ten-node tetrahedra, states without node
/// positions (IU = 0), and databases without a surface.
std::unique_ptr<bake::SimulationReader> open_d3plot(const std::filesystem::path& first_file);

/// Files of one run may differ in a number at the end of their names: R004A001.vtk, R004A007.vtk, ... These are all
/// files beside `file` whose names differ from its name only in the number before the extension, sorted by it; `file`
/// alone when it has no number. Throws Error{file_not_found} when it does not exist.
[[nodiscard]] std::vector<std::filesystem::path> find_series(const std::filesystem::path& file);

/// Throws Error{bad_input} that names a missing number when the numbers of a series have a gap: files that are counted
/// would get the times of others. Any regular step is accepted, also a shorter last one, as are irregular numbers.
void refuse_gap(const std::vector<std::filesystem::path>& series);

/// A name for all files of a series, another one for every other series; empty for other files and for folders.
[[nodiscard]] std::string series_name(const std::filesystem::path& file);

/// The first file of every series in a folder, sorted by name.
[[nodiscard]] std::vector<std::filesystem::path> first_files(const std::filesystem::path& folder);
}  // namespace lbea::io
