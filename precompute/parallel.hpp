// Independent jobs on a few threads.
#pragma once

#include <cstddef>
#include <functional>

namespace lbea::bake {
/// Calls worker(next) on `threads` threads (0: all processors, never more than jobs). next() hands out the job numbers
/// 0, 1, ... in order, each once, and `count` when there are no more or another worker has thrown.
/// Returns when all are done; rethrows what the lowest failing job threw.
void work_in_parallel(std::size_t count, unsigned threads,
                      const std::function<void(const std::function<std::size_t()>& next)>& worker);
}  // namespace lbea::bake
