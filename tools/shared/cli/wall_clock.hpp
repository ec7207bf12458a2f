// What stamps and recordings count time by: one clock for all programs, the recorder's.
#pragma once

#include "adapters/mcap/wall_clock.hpp"
