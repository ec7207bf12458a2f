#!/usr/bin/env bash
# Runs ten million inputs through every parser, by libFuzzer with the address and undefined-behavior sanitizers, one
# parser after another on one processor. Prints a line for each: inputs, inputs per second, findings.
#   bash tests/fuzz/long.sh                    all parsers
#   bash tests/fuzz/long.sh frame mcap         these parsers
#   RUNS=100000 bash tests/fuzz/long.sh        fewer inputs
#   BUILD=dir, WORK=dir                        folder of the build; folder of corpora, logs and findings
# MCAP's decompressors and the TOML library allocate so much that the address sanitizer would take hours. Their ten million
# inputs run in a build with the checks of the standard library and the undefined-behavior sanitizer, and a tenth of them here.
# VTKHDF is read in a process for each input, so a thousandth of them must do.
# Inputs with findings are stored in WORK/NAME.findings; `fuzz_NAME FILE` of any build replays one.
set -euo pipefail
cd "$(dirname "$0")/../.."

build=${BUILD:-build} work=${WORK:-build/fuzz-long} runs=${RUNS:-10000000}
# Parser and its longest input: long enough for every kind of record, short enough to be fast.
declare -A longest=([frame]=1024 [result]=1024 [control]=256 [model]=14000 [mcap]=1024 [d3plot]=4096 [mesh_files]=2048
                    [vtkhdf]=16384
                    [ply]=512 [xyz]=256 [cloud]=512 [tables]=512 [description]=512 [http]=1024)
chosen=("$@")
if [ ${#chosen[@]} = 0 ]; then chosen=(frame result control model mcap d3plot mesh_files vtkhdf ply xyz cloud tables description http); fi

launcher=()
if command -v ccache >/dev/null; then launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
make_program() {  # preset, parser
  cmake --preset "$1" -B "$build/$1" "${launcher[@]}" >/dev/null
  cmake --build "$build/$1" --target "fuzz_$2" >/dev/null
}

export UBSAN_OPTIONS=print_stacktrace=1 ASAN_OPTIONS=malloc_context_size=2:quarantine_size_mb=16
found=0
run() {  # preset, parser, inputs
  local preset=$1 name=$2 corpus=$work/$2.corpus findings=$work/$2.findings log=$work/$2.$1.log verdict="no finding"
  mkdir -p "$corpus" "$findings"
  make_program "$preset" "$name"
  local program begin
  program=$(find "$build/$preset/tests" -name "fuzz_$name" -type f -executable)
  begin=$(date +%s)
  "$program" -runs="$3" -max_len="${longest[$name]}" -entropic=0 -timeout=20 -rss_limit_mb=3000 -print_final_stats=1 \
    -artifact_prefix="$findings/" "$corpus" "tests/data/fuzz/$name" >"$log" 2>&1 || { verdict="FINDING, see $log"; found=1; }
  if grep -q "run interrupted" "$log"; then verdict="interrupted, no finding so far"; fi
  local inputs seconds=$(($(date +%s) - begin))
  inputs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  printf '%-12s %-10s %10s inputs  %6d s  %7d /s  %s\n' "$name" "$preset" "${inputs:-0}" "$seconds" \
    "$((${inputs:-0} / (seconds > 0 ? seconds : 1)))" "$verdict"
}

for name in "${chosen[@]}"; do
  if [ "$name" = mcap ] || [ "$name" = description ]; then
    run fuzz-fast "$name" "$runs"
    run fuzz "$name" $((runs / 10))
  elif [ "$name" = vtkhdf ]; then
    run fuzz "$name" $((runs / 1000))
  else
    run fuzz "$name" "$runs"
  fi
done
exit $found
