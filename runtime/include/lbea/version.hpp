// version.hpp - the library's version, written once: CMake, --version and the model's provenance read it here.
#pragma once

#define LBEA_VERSION_MAJOR 0
#define LBEA_VERSION_MINOR 1
#define LBEA_VERSION_PATCH 0
#define LBEA_VERSION_STRING "0.1.0"
