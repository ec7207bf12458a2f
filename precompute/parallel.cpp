#include "precompute/parallel.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

namespace lbea::bake {
namespace {
struct Failure {
  std::mutex mutex;
  std::size_t job = std::numeric_limits<std::size_t>::max();
  std::exception_ptr exception;

  void keep_lowest(std::size_t failed_job, std::exception_ptr thrown) {
    const std::lock_guard lock(mutex);
    if (exception && failed_job >= job) return;
    job = failed_job;
    exception = std::move(thrown);
  }
};
}  // namespace

void work_in_parallel(std::size_t count, const Workers& workers,
                      const std::function<void(const std::function<std::size_t()>& next)>& worker) {
  std::atomic<std::size_t> jobs_given{0};
  std::atomic<bool> stopped{false};
  Failure failure;
  const auto work = [&] {
    std::size_t job = count;
    const auto next = [&] {
      workers.check();
      job = stopped ? count : std::min(jobs_given.fetch_add(1), count);
      return job;
    };
    try {
      worker(next);
    } catch (...) {
      stopped = true;
      failure.keep_lowest(job, std::current_exception());
    }
  };
  const std::size_t processors =
      workers.threads > 0 ? workers.threads : std::max(1u, std::thread::hardware_concurrency());
  {
    std::vector<std::jthread> others;
    for (std::size_t i = 1; i < std::min(processors, count); ++i) others.emplace_back(work);
    work();
  }
  if (failure.exception) std::rethrow_exception(failure.exception);
}
}  // namespace lbea::bake
