// Whether this is a sanitizer build. Programs are then much slower, and tests do not check rates.
#pragma once

namespace lbea::test {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool is_instrumented = true;
#else
inline constexpr bool is_instrumented = false;
#endif

}  // namespace lbea::test
