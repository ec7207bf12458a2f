// Denormal numbers as zeros. Only kernel files include this.
#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include <cstdint>

namespace lbea::LBEA_KERNELS {
/// In its scope, denormal numbers count as zeros: many processors compute with them a hundred times more slowly.
class DenormalsAreZero {
#if defined(__SSE2__) || defined(__aarch64__)
 public:
  DenormalsAreZero() : before_(mode()) { set_mode(before_ | as_zero); }
  ~DenormalsAreZero() { set_mode(before_); }
  DenormalsAreZero(const DenormalsAreZero&) = delete;
  DenormalsAreZero& operator=(const DenormalsAreZero&) = delete;

 private:
#if defined(__SSE2__)
  using Mode = unsigned;
  static Mode mode() { return _mm_getcsr(); }
  static void set_mode(Mode mode) { _mm_setcsr(mode); }
  static constexpr Mode as_zero = 1u << 15 | 1u << 6;  // results; operands
#else
  using Mode = std::uint64_t;
  static Mode mode() {
    Mode mode;
    asm volatile("mrs %0, fpcr" : "=r"(mode));
    return mode;
  }
  static void set_mode(Mode mode) { asm volatile("msr fpcr, %0" ::"r"(mode) : "memory"); }
  static constexpr Mode as_zero = 1u << 24;
#endif
  Mode before_;
#endif
};
}  // namespace lbea::LBEA_KERNELS
