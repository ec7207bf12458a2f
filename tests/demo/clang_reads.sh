#!/usr/bin/env bash
# Checks that clang accepts the demo's sources in precompute and tools. The sanitized tests compile the other sources
# with clang.
#   clang_reads.sh BUILD_DIR
set -euo pipefail
build=$1
project=$(cd "$(dirname "$0")/../.." && pwd)
cd "$project"
cmake --preset demo -B "$build" >/dev/null
headers=CMakeFiles/lbea_precompiled_
ninja -C "$build" ${headers}{eigen,libraries}.dir/cmake_pch.hxx.pch >/dev/null
cd "$build"
ninja -t commands lbea-{bake,sense,serve,eval,send,report} | grep -E ' -c [^ ]*/(precompute|tools)/' >commands.txt
[ "$(wc -l <commands.txt)" -gt 20 ]
sed 's/$/ -fsyntax-only/' commands.txt | xargs -d '\n' -n 1 -P "$(nproc)" bash -c
