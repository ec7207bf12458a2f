// Independent jobs on a few threads.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <utility>

namespace lbea::bake {

/// Requested by the caller, not a failure. No model is written.
struct BakeCancelled : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "the bake was cancelled; no model was written"; }
};

struct Workers {
  unsigned threads;                 // 0: all processors
  std::function<bool()> cancelled;  // called before every job, from any thread

  Workers(unsigned count = 0, std::function<bool()> is_cancelled = {})
      : threads(count), cancelled(std::move(is_cancelled)) {}
  /// Throws BakeCancelled.
  void check() const {
    if (cancelled && cancelled()) throw BakeCancelled();
  }
};

/// Calls worker(next) on the threads, never more than jobs. next() hands out the job numbers 0, 1, ... in order, each
/// once, and `count` when there are no more or another worker has thrown; it throws BakeCancelled when the work is
/// cancelled.
/// Returns when all are done; rethrows what the lowest failing job threw.
void work_in_parallel(std::size_t count, const Workers& workers,
                      const std::function<void(const std::function<std::size_t()>& next)>& worker);

}  // namespace lbea::bake
