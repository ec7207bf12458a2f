// One stage of a bake as its caller watches it: progress, and the question whether to go on.
#pragma once

#include "precompute/bake_options.hpp"

#include <cstdint>
#include <mutex>
#include <string_view>

namespace lbea::bake {

class Stage {
 public:
  Stage(const BakeOptions& options, std::string_view name, std::uint64_t total)
      : options_(options), progress_{name, 0, total} {}

  /// Throws BakeCancelled when the caller wants to stop. From any thread, as step() is.
  void check() const {
    if (options_.cancelled && options_.cancelled()) throw BakeCancelled();
  }
  void step() {
    const std::lock_guard lock(mutex_);
    ++progress_.done;
    if (options_.progress) options_.progress(progress_);
  }

 private:
  const BakeOptions& options_;
  std::mutex mutex_;
  BakeProgress progress_;
};

}  // namespace lbea::bake
