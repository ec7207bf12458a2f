#!/usr/bin/env bash
# The programs for Linux on ARM64, with those for this machine at the other end: keys, every frame matched, sent and
# recorded, the results of this machine to the last bit, the same words.
#   programs.sh HOST_BUILD TOOLS EMULATOR...      TOOLS: tools/ of the build for ARM64
set -euo pipefail
host=$1 tools=$2 name=lbea-inspect
emulator=("${@:3}")
windows=("${emulator[@]}" "$tools/inspect/lbea-inspect") # what support.sh compares
. "$(dirname "$0")/../windows/support.sh"
program() { "${emulator[@]}" "$tools/$1/lbea-$1" "${@:2}"; } # NAME without lbea-, ARGUMENT...

for key in matcher camera; do program keygen "$work/$key" >/dev/null; done
for_matcher=(--key "$work/matcher.key" --allow "$work/camera.pub")
for_camera=(--server-key "$work/matcher.pub" --key "$work/camera.key")
here_sends() { "$host/tools/send/lbea-send" "$clouds" "$@" >"$work/sent" 2>&1 || fail "lbea-send:" "$(cat "$work/sent")"; }
results_are_the_same() { # recording
  "$host/tools/replay/lbea-replay" "$1" --model "$model" --pose "$sensor" --against >"$work/replayed" 2>&1 ||
    fail "a replay on this machine gives other results:" "$(cat "$work/replayed")"
  grep -q "^$count results the same, 0 different" "$work/replayed" || fail "not $count results:" "$(cat "$work/replayed")"
}

matcher=("${emulator[@]}" "$tools/serve/lbea-serve")
for method in lbea vtp fit; do
  serve --method $method --record "$work/$method.mcap" --record-memory 64 --record-compression zstd "${for_matcher[@]}"
  here_sends --to "$frames" "${for_camera[@]}"
  stop_serving "$count"
  results_are_the_same "$work/$method.mcap"
done

# Sent and recorded by ARM64, matched here.
matcher=("$host/tools/serve/lbea-serve")
serve "${for_matcher[@]}"
"${emulator[@]}" "$tools/record/lbea-record" "$work/between.mcap" --frames "tcp://127.0.0.1:*" --record-memory 64 --forward "$frames" --results "$results" \
  --server-key "$work/matcher.pub" --client-key "$work/camera.key" --json >"$work/recorded" 2>"$work/record_log" &
recorder=$!
wait_until_ready "$work/record_log" "$recorder" lbea-record
rig=$(sed -n 's/.*ready: frames on //p' "$work/record_log")
program send "$clouds" --to "$rig" --json >"$work/sent" 2>&1 || fail "lbea-send:" "$(cat "$work/sent")"
for _ in $(seq 600); do grep -q 'end of the test' "$work/log" && break; sleep 0.1; done
kill -INT "$recorder"
wait "$recorder" || fail "lbea-record failed:" "$(cat "$work/recorded" "$work/record_log")"
recorder=
grep -qF "\"forwarded\":$count," "$work/recorded" || fail "not all is forwarded:" "$(cat "$work/recorded")"
stop_serving "$count"
results_are_the_same "$work/between.mcap"

check_same 0 "$model" --json
check_same 0 "$work/fit.mcap" --json
damage "$work/fit.mcap"
check_same 1 "$work/fit.mcap"
check_same 1 "$work/no such.lbea"
check_same 2
echo "$count frames by each method, sent, recorded and matched by programs for ARM64: the bits of this machine"
