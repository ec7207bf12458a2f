#!/usr/bin/env bash
# Instructions of one call of each inner loop: NEON beside SSE2, both counted by qemu.
#   cmake --build --preset arm64 --target kernel_calls; cmake --build --preset ci --target kernel_calls
#   count_instructions.sh BUILD_ARM64 BUILD_HERE
set -euo pipefail
arm64=(qemu-aarch64 -L /usr/aarch64-linux-gnu) here=(qemu-x86_64 -cpu qemu64) # a processor without AVX
traced=(-singlestep -d nochain,exec -D /dev/stderr)                           # one line per instruction
instructions() { "$@" 2>&1 >/dev/null | grep -c '^Trace'; }
one_call() { # program, kernel, emulator...
  local program=$1/tests/platforms/kernel_calls kernel=$2
  shift 2
  echo $(($(instructions "$@" "${traced[@]}" "$program" "$kernel" 2) - $(instructions "$@" "${traced[@]}" "$program" "$kernel" 1)))
}
for kernel in $("$2/tests/platforms/kernel_calls"); do
  echo "$kernel: $(one_call "$1" "$kernel" "${arm64[@]}") on ARM64, $(one_call "$2" "$kernel" "${here[@]}") on x86-64"
done
