#include "runtime/src/kernels/kernels.hpp"

#if defined(LBEA_X86_KERNELS) && !defined(__clang__) && __has_include(<sys/platform/x86.h>)
#include <sys/platform/x86.h>  // glibc's detection, 4.5 kB smaller than libgcc's; clang cannot read it in C++
#define LBEA_HAS(feature, name) CPU_FEATURE_ACTIVE(feature)
#elif defined(LBEA_X86_KERNELS)
#define LBEA_HAS(feature, name) __builtin_cpu_supports(name)
#endif

namespace lbea {
#ifdef LBEA_X86_KERNELS
namespace kernels_avx512 {
extern const Kernels table;
}
namespace kernels_avx2 {
extern const Kernels table;
}
#endif
namespace kernels_baseline {
extern const Kernels table;
}

namespace {
struct Choice {
  const Kernels* found[4]{};

  Choice() noexcept {
    std::size_t count = 0;
#ifdef LBEA_X86_KERNELS
    if (LBEA_HAS(AVX512F, "avx512f") && LBEA_HAS(AVX512DQ, "avx512dq") && LBEA_HAS(AVX512BW, "avx512bw"))
      found[count++] = &kernels_avx512::table;
    if (LBEA_HAS(AVX2, "avx2")) found[count++] = &kernels_avx2::table;
#endif
    found[count] = &kernels_baseline::table;
  }
};

const Choice& choice() noexcept {
  static const Choice made;
  return made;
}
}  // namespace

const Kernels& kernels() noexcept { return *choice().found[0]; }
const Kernels* const* available_kernels() noexcept { return choice().found; }
}  // namespace lbea
