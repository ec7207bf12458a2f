// Threads that do the parts of one piece of work at the same time.
#pragma once

#include "tools/shared/matching/barrier.hpp"

#include <lbea/rigs.hpp>

#include <cstddef>
#include <functional>
#include <thread>
#include <vector>

namespace lbea::tool {

class SideBySide {
 public:
  using Part = std::function<void(std::size_t)>;
  /// `threads`, at least 1: the caller of run() and those that this starts, each of which calls `on_start` with its
  /// number, from 1 on.
  explicit SideBySide(std::size_t threads, const Part& on_start = {});
  ~SideBySide() { end(); }
  SideBySide(const SideBySide&) = delete;
  SideBySide& operator=(const SideBySide&) = delete;
  [[nodiscard]] std::size_t threads() const noexcept { return workers_.size() + 1; }
  /// Calls part(0) to part(count - 1), each on its own thread as far as there are enough, and returns when all have
  /// ended. Parts must not throw.
  void run(std::size_t count, const Part& part) noexcept;
  /// The same for a RigMatcher, which must not use them any more when this ends.
  [[nodiscard]] RigThreads for_rigs() noexcept;

 private:
  void work(std::size_t number, const Part& on_start);
  void do_parts_of(std::size_t thread) const noexcept;
  void end() noexcept;

  const Part* part_ = nullptr;  // null: the threads end
  std::size_t count_ = 0;
  Barrier begin_, end_;
  std::vector<std::thread> workers_;
};

}  // namespace lbea::tool
