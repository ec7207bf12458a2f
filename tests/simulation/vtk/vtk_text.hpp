// Parts of VTK files in text, and the arrays that are read from them.
#pragma once

#include <doctest/doctest.h>

#include "adapters/simulation/grid/grid.hpp"

#include <string>
#include <vector>

namespace lbea::test {

inline const std::string legacy_head = "# vtk DataFile Version 3.0\ntitle\nASCII\n";
inline const std::string grid_head = legacy_head + "DATASET UNSTRUCTURED_GRID\n";
inline const std::string three_points = "POINTS 3 float\n0 0 0 1 0 0 0 1 0\n";
inline const std::string one_triangle = three_points + "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n";

/// An array of an XML file; `more` attributes.
inline std::string data_array(const std::string& name, const std::string& type, const std::string& text,
                              const std::string& more = "") {
  return "<DataArray type=\"" + type + "\" Name=\"" + name + "\" format=\"ascii\" " + more + ">" + text +
         "</DataArray>";
}
inline std::string float_array(const std::string& name, const std::string& text, int components = 1) {
  return data_array(name, "Float32", text, "NumberOfComponents=\"" + std::to_string(components) + "\"");
}

inline const io::grid::Array& array_in(const std::vector<io::grid::Array>& arrays, const std::string& name) {
  const io::grid::Array* found = io::grid::find_array(arrays, name);
  REQUIRE(found != nullptr);
  return *found;
}

}  // namespace lbea::test
