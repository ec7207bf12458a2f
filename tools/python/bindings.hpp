// The runtime for Python: numpy arrays in, plain objects and views of the model out.
#pragma once

#include <lbea/lbea.hpp>

#include <pybind11/pybind11.h>

namespace lbea::tool {

void bind_model(pybind11::module_& module);
void bind_matcher(pybind11::module_& module);

}  // namespace lbea::tool
