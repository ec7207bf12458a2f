// Whether a sanitizer watches: then programs run at a fraction of their speed, and what a test says about keeping a
// pace would be about the sanitizer.
#pragma once

namespace lbea::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool is_instrumented = true;
#else
inline constexpr bool is_instrumented = false;
#endif

}  // namespace lbea::test
