// Samples that were read before, kept in memory: the same ones are proposed for many left-out frames.
#pragma once

#include "precompute/left_out/left_out_frames.hpp"

namespace lbea::bake {

/// The source with single images and nodes_of from memory where they were read before. Keeps up to 64 MB, whatever
/// the number of samples. The source must outlive it.
[[nodiscard]] SampleSource with_cache(const SampleSource& source);

}  // namespace lbea::bake
