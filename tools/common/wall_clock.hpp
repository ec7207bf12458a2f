// What stamps and recordings count time by: one clock for all programs, the recorder's.
#pragma once

#include "adapters/recording/wall_clock.hpp"
