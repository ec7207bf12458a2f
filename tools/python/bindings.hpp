// Parts of the Python module `lbea`.
#pragma once

#include <lbea/lbea.hpp>

#include <pybind11/pybind11.h>

namespace lbea::tool {

void bind_matcher(pybind11::module_& module);

}  // namespace lbea::tool
