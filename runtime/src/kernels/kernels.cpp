#include "runtime/src/kernels/kernels.hpp"

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
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw"))
      found[count++] = &kernels_avx512::table;
    if (__builtin_cpu_supports("avx2")) found[count++] = &kernels_avx2::table;
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
