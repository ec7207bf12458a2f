#include "tools/shared/matching/side_by_side.hpp"

namespace lbea::tool {

SideBySide::SideBySide(std::size_t threads, const Part& on_start)
    : begin_(static_cast<std::ptrdiff_t>(threads)), end_(static_cast<std::ptrdiff_t>(threads)) {
  workers_.reserve(threads - 1);
  try {
    for (std::size_t i = 1; i < threads; ++i) workers_.emplace_back([this, i, on_start] { work(i, on_start); });
  } catch (...) {  // the destructor does not run after an exception
    for (std::size_t i = workers_.size() + 1; i < threads; ++i) begin_.arrive_and_drop();
    end();
    throw;
  }
}

void SideBySide::run(std::size_t count, const Part& part) noexcept {
  count_ = count;
  part_ = &part;
  const bool needs_others = count > 1 && threads() > 1;
  if (needs_others) begin_.arrive_and_wait();
  do_parts_of(0);
  if (needs_others) end_.arrive_and_wait();
}

RigThreads SideBySide::for_rigs() noexcept {
  return {[](void* threads, std::size_t parts, void (*part)(const void*, std::size_t), const void* work) {
            static_cast<SideBySide*>(threads)->run(parts, [part, work](std::size_t i) { part(work, i); });
          },
          this};
}

void SideBySide::do_parts_of(std::size_t thread) const noexcept {
  for (std::size_t i = thread; i < count_; i += threads()) (*part_)(i);
}

void SideBySide::work(std::size_t number, const Part& on_start) {
  if (on_start) on_start(number);
  while (true) {
    begin_.arrive_and_wait();
    if (part_ == nullptr) return;
    do_parts_of(number);
    end_.arrive_and_wait();
  }
}

void SideBySide::end() noexcept {
  part_ = nullptr;
  if (!workers_.empty()) begin_.arrive_and_wait();
  for (std::thread& worker : workers_) worker.join();
}

}  // namespace lbea::tool
