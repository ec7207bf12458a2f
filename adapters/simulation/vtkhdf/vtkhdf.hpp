// VTKHDF files: unstructured grids and polygons in HDF5, with the states of a run in one file.
#pragma once

#include "adapters/simulation/grid/grid_reader.hpp"

namespace lbea::io::vtkhdf {
/// Whether the file is HDF5.
[[nodiscard]] bool is_vtkhdf(std::string_view start) noexcept;

/// The states of the file: its steps, or one without steps. Throws Error{bad_input | unsupported_input}; unsupported
/// are other HDF5 files, other kinds of data sets, and all files in a build without HDF5.
[[nodiscard]] std::vector<grid::GridState> list_states(const std::filesystem::path& file);

/// One of these, its parts joined. Throws Error{bad_input | unsupported_input} that names file, step and HDF5 dataset.
[[nodiscard]] grid::Grid read_state(const grid::GridState& state);
}  // namespace lbea::io::vtkhdf
