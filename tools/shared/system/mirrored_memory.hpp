// Memory that is mapped twice in a row: what is written past its end is at its beginning.
#pragma once

#include <cstddef>

namespace lbea::tool {

class MirroredMemory {
 public:
  /// At least `bytes`, rounded up to whole pages, which are touched once to avoid page faults later. Throws
  /// Error{bad_config} when the system has not enough memory.
  explicit MirroredMemory(std::size_t bytes);
  ~MirroredMemory();
  MirroredMemory(const MirroredMemory&) = delete;
  MirroredMemory& operator=(const MirroredMemory&) = delete;

  /// Of one of the two.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::byte* data() const noexcept { return first_; }

 private:
  std::size_t size_;
  std::byte* first_ = nullptr;
};

}  // namespace lbea::tool
