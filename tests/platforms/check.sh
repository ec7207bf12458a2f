#!/usr/bin/env bash
# The results of the demo's frames, with all their bits.
#   check.sh [--write] EXPECTED DEMO SENSOR_JSON PROGRAM...   compares what the program prints with EXPECTED, or writes it
set -euo pipefail
write=no
if [ "$1" = --write ]; then write=yes; shift; fi
expected=$1 demo=$2 sensor=$3
shift 3
model=$demo/rail.lbea
if [ ! -e "$model" ] || { [ $write = no ] && [ ! -e "$expected" ]; }; then
  echo "skipped: $expected is missing; build the preset ci and run its tests first"
  exit 77
fi
printed=$(mktemp)
trap 'rm -f "$printed"' EXIT
"$@" "$model" "$sensor" "$demo/frames" | tr -d '\r' >"$printed"
if [ $write = yes ]; then cp "$printed" "$expected"; fi
cmp "$expected" "$printed" || { diff "$expected" "$printed" | head -20; exit 1; }
echo "$(grep -c '^frame' "$printed") frames, $(wc -l <"$printed") lines of results: the same bits"
