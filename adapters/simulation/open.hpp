// The door to simulation files: one run, whatever its format, as a SimulationReader.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <lbea/lbea.hpp>

#include "precompute/simulation.hpp"

namespace lbea::io {

/// Opens the run at `path`: the first file of a run, or a folder that holds a file named d3plot or one run of another
/// format. The format is told by content, not by name. Files whose names differ in the number before the extension are
/// states of one run: they share one mesh, as do all states. Their times are the files' own, in their unit, else the
/// number of the state. Throws Error{file_not_found | bad_input | unsupported_input} with a sentence that names file,
/// byte and what to do.
std::unique_ptr<bake::SimulationReader> open_simulation(const std::filesystem::path& path);

/// The names of all formats, separated by commas; and a table of them for people, a line each.
[[nodiscard]] std::string simulation_format_names();
[[nodiscard]] std::string list_simulation_formats();

/// Opens an LS-DYNA d3plot family by its first file (`d3plot`; `d3plot01`, `d3plot02`, ... `d3plot100` beside it
/// are found and read in numeric order, gaps are allowed).
///
/// Mesh: the shells and the faces owned by exactly one solid, shells first; only nodes that these use. Ids are the
/// solver's when the file has them (NARBS), else counted from 1. Beams and thick shells are not part of the surface.
/// Faces that appear only when a neighbouring solid erodes are not added: the mesh is the same in all states.
///
/// Fields, as far as the database stores them: `plastic_strain` and `von_mises` (the maximum over the stored
/// through-thickness layers of a shell, over the stored integration points of a solid), `thickness`,
/// `internal_energy` (per volume, as LS-DYNA writes it for shells), `effective_strain` (the larger of the two surfaces
/// of a shell). 0 where the kind of element stores no such value, such as rigid shells or the thickness of a solid.
/// An element is eroded when its own deletion word is 0 or, in databases with deletion words per node, one of its
/// nodes' words is.
///
/// States are indexed at open, read one at a time. A last state that the file cuts short (an interrupted run) is
/// dropped; a cut anywhere else, times that run backwards and geometry that does not fit its file are refused.
/// A database without states has a mesh and 0 states.
/// Throws Error{file_not_found | bad_input | unsupported_input}; unsupported are compressed (FEMZIP), big-endian,
/// two-dimensional, adaptive, particle, fluid and eigenvector databases, ten-node tetrahedra, states without node
/// positions (IU = 0), and databases without a surface.
std::unique_ptr<bake::SimulationReader> open_d3plot(const std::filesystem::path& first_file);

}  // namespace lbea::io
