#!/usr/bin/env bash
# Installs missing packages, builds, and runs the tests: under the sanitizers, as released, and in emulators.
#   bash tests/run.sh            the daily tests: of ARM64 and Windows those of the libraries
#   bash tests/run.sh --quick    as released only
#   bash tests/run.sh --cross    as released, then ARM64 and Windows without tests that bake
#   bash tests/run.sh --long     all of that, the long tests, whole programs under the address sanitizer, and the tests
#                                labelled `threads` under the thread sanitizer
set -euo pipefail
cd "$(dirname "$0")/.."

sanitizers=yes everything=no purpose=daily
# The target that the address sanitizer builds, then the arguments that select its tests for ctest. The HTTP server takes
# minutes to compile.
addresses=(sanitized_tests --label-regex sanitized) http=OFF
emulated=(emulated_library_tests --label-regex emulated-library)
case "${1:-}" in
  "") ;;
  --quick) sanitizers=no purpose=test ;;
  --cross) sanitizers=no purpose=cross emulated=(emulated_tests --label-regex emulated) ;;
  --long)
    export LBEA_LONG_TESTS=1
    everything=yes purpose=cross http=ON
    addresses=(all --label-exclude release-only) emulated=(all)  # those of ARM64 that bake, too
    ;;
  *) echo "usage: bash tests/run.sh [--quick | --cross | --long]" >&2; exit 2 ;;
esac

bash tools/install-packages.sh "${purpose/daily/test}"
launcher=()
if command -v ccache >/dev/null; then launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
export CCACHE_SLOPPINESS=pch_defines,time_macros  # ccache caches nothing that uses precompiled headers without these

build_and_test() {  # preset, target to build, then arguments for ctest
  local preset=$1 target=$2
  shift 2
  printf '\n== %s\n' "$preset"
  cmake --preset "$preset" "${launcher[@]}" "${options[@]}" >/dev/null
  cmake --build --preset "$preset" --target "$target"
  ctest --preset "$preset" --parallel $((2 * $(nproc))) "$@"  # many tests wait for most of their time
}

export UBSAN_OPTIONS=print_stacktrace=1 TSAN_OPTIONS=halt_on_error=1
export LSAN_OPTIONS=suppressions=$PWD/tests/wire/lsan.supp:print_suppressions=0
options=(-DLBEA_HTTP=$http -DLBEA_MONITOR=$http)
if [ "$sanitizers" = yes ]; then
  build_and_test asan-ubsan "${addresses[@]}"
  if [ "$everything" = yes ]; then build_and_test tsan threaded_tests --label-regex threads; fi
fi
options=()
build_and_test ci all

# With the models and results of the build above. Only --long runs the tests of ARM64 that bake.
if [ $purpose = daily ] && ! bash tools/install-packages.sh cross; then
  echo "not tested: ARM64 and Windows, whose compilers and emulators could not be installed" >&2
elif [ $purpose != test ]; then
  for preset in arm64 windows; do build_and_test $preset "${emulated[@]}"; done
fi
