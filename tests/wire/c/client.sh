#!/usr/bin/env bash
# The C client with real processes of lbea-serve, over tcp and where given over ipc.
#   client.sh HOST_BUILD TRANSPORTS CLIENT...     HOST_BUILD: with lbea-serve, lbea-keygen, a model and its frames
set -euo pipefail
build=$1 transports=$2
shift 2
client=("$@")
sensor=$(cd "$(dirname "$0")/../../data/rail-demo" && pwd)/sensor.json
model=$build/tests/wire/rail.lbea clouds=$build/tests/wire/frames
for needed in "$build/tools/serve/lbea-serve" "$build/tools/keygen/lbea-keygen" "$model"; do
  [ -e "$needed" ] || { echo "skipped: $needed is missing; build the preset ci and run its tests first"; exit 77; }
done
export LC_ALL=C.UTF-8 # Wine reads file names by it
work=$(mktemp -d)
server=
trap '[ -z "$server" ] || kill -9 "$server" 2>/dev/null || true; rm -rf "$work"' EXIT
fail() { printf '%s\n' "$@" >&2; exit 1; }

start() { # method, endpoint of frames, of results, further arguments
  serve --pose "$sensor" --method "$1" --frames "$2" --results "$3" "${@:4}"
}
serve() { # arguments
  : >"$work/log"  # else the ready line of the server before may be found
  "$build/tools/serve/lbea-serve" "$model" --json "$@" >"$work/tally" 2>"$work/log" &
  server=$!
  for _ in $(seq 600); do
    grep -q 'ready: frames ' "$work/log" && break
    kill -0 "$server" 2>/dev/null || fail "lbea-serve ended:" "$(cat "$work/log")"
    sleep 0.1
  done
  frames=$(sed -n 's/.*frames on \([^, ]*\).*/\1/p' "$work/log" | head -n 1)
  left=$(sed -n 's/.*frames of left on \([^, ]*\).*/\1/p' "$work/log" | head -n 1)
  right=$(sed -n 's/.*frames of right on \([^, ]*\).*/\1/p' "$work/log" | head -n 1)
  results=$(sed -n 's/.*results on \([^, ]*\).*/\1/p' "$work/log" | head -n 1)
}
# Ends lbea-serve and checks its account of 1,000 captures.
end_with() { # exit code, received, matched, rejected, dropped
  local code=0
  kill -INT "$server"
  wait "$server" || code=$?
  server=
  [ "$code" -eq "$1" ] || fail "lbea-serve ended with $code:" "$(cat "$work/log")"
  for count in "\"captured\":1000,\"received\":$2," "\"matched\":$3," "\"rejected\":$4," "\"dropped\":$5,"; do
    grep -qF "$count" "$work/tally" || fail "lbea-serve did not count $count" "$(cat "$work/tally")"
  done
}
stop() { end_with 1 980 950 30 20; }

for name in matcher camera stranger; do "$build/tools/keygen/lbea-keygen" "$work/$name" >/dev/null; done
keys=("$work/matcher.pub" "$work/camera.key")
sed 's/$/\r/' "$work/matcher.pub" >"$work/Prüfstand 1.pub"
sed 's/$/\r/' "$work/camera.key" >"$work/Prüfstand 1.key"
chmod 600 "$work/Prüfstand 1.key"
for transport in $transports; do
  ends=("tcp://127.0.0.1:*" "tcp://127.0.0.1:*")
  if [ "$transport" = ipc ]; then ends=("ipc://$work/frames" "ipc://$work/results"); fi
  start lbea "${ends[@]}"
  "${client[@]}" account "$frames" "$results" "$clouds"
  stop
  for arguments in "" "--key $work/matcher.key --allow $work/camera.pub"; do
    start lbea "${ends[@]}" $arguments
    "${client[@]}" whole "$frames" "$results" "$clouds" ${arguments:+"${keys[@]}"}
    end_with 0 1000 1000 0 0
  done
  start fit "${ends[@]}"
  "${client[@]}" fit "$frames" "$results" "$clouds"
  kill -INT "$server"
  wait "$server" || fail "lbea-serve lost frames:" "$(cat "$work/log")"
  ends_of_rigs=("tcp://127.0.0.1:*" "tcp://127.0.0.1:*")
  if [ "$transport" = ipc ]; then ends_of_rigs=("ipc://$work/left" "ipc://$work/right"); fi
  serve --frames "left=${ends_of_rigs[0]}" --frames "right=${ends_of_rigs[1]}" --pose "left=$sensor" \
    --pose "right=$sensor" --results "${ends[1]}" --wait-us 1000000
  "${client[@]}" rigs "$left" "$right" "$results" "$clouds"
  kill -INT "$server"
  wait "$server" || fail "lbea-serve lost frames of rigs:" "$(cat "$work/log")"
  start lbea "${ends[@]}"
  nobody="ipc://$work/nobody"
  if [ "$transport" = tcp ]; then nobody=tcp://127.0.0.1:1; fi
  "${client[@]}" refusals "$frames" "$results" "$nobody"
  "${client[@]}" dead "$frames" "$results" >"$work/dead" &
  program=$!
  for _ in $(seq 600); do
    if grep -q connected "$work/dead" || ! kill -0 "$program" 2>/dev/null; then break; fi
    sleep 0.1
  done
  kill -9 "$server"
  code=0
  wait "$server" 2>/dev/null || code=$?
  server=
  [ "$code" -eq 137 ] || fail "lbea-serve ended with $code:" "$(cat "$work/log")"
  wait "$program" || fail "$(cat "$work/dead")" "lbea-serve:" "$(cat "$work/log")"
  start lbea "${ends[@]}" --key "$work/matcher.key" --allow "$work/camera.pub"
  "${client[@]}" account "$frames" "$results" "$clouds" "${keys[@]}"
  (cd "$work" && "${client[@]}" names "$frames" "$results")
  "${client[@]}" keys "$frames" "$results" "${keys[@]}" "$work/stranger.key" "$work/stranger.pub"
  stop
  echo "$transport: accounts, refusals, keys and a killed matcher are as expected"
done
