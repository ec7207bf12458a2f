#!/usr/bin/env bash
# lbea-record.exe records what lbea-send sends on this machine, and forwards it to lbea-serve.
#   record.sh HOST_BUILD EMULATOR... PROGRAM
set -euo pipefail
host=$1 name=lbea-record
shift
windows=("$@")
. "$(dirname "$0")/support.sh"
make_keys

# lbea-record.exe with any port; sets `rig`.
record() { # file, arguments
  : >"$work/record_log" # of an earlier one
  "${windows[@]}" "$1" --frames "tcp://127.0.0.1:*" --record-memory 16 --json "${@:2}" >"$work/tally" 2>"$work/record_log" &
  recorder=$!
  wait_until_ready "$work/record_log" "$recorder" lbea-record.exe
  rig=$(sed -n 's/.*ready: frames on //p' "$work/record_log")
}
# Ctrl-C. The recording must then be complete.
stop_recording() { # file, parts of the tally
  local part
  [ -e "$1.partial" ] && [ ! -e "$1" ] || fail "a recording has its final name before it is complete"
  kill -INT "$recorder"
  wait "$recorder" || fail "lbea-record.exe failed:" "$(cat "$work/tally" "$work/record_log")"
  recorder=
  for part in "${@:2}"; do
    grep -qF "$part" "$work/tally" || fail "lbea-record.exe did not count $part" "$(cat "$work/tally")"
  done
  [ ! -e "$1.partial" ] || fail "the partial file remains"
  "$host/tools/inspect/lbea-inspect" "$1" --json >"$work/inspected" || fail "not complete:" "$(cat "$work/inspected")"
  grep -qF "\"frames\": $count," "$work/inspected" || fail "frames are missing:" "$(cat "$work/inspected")"
}
send() { # arguments
  "$host/tools/send/lbea-send" "$clouds" "$@" >"$work/sent" 2>&1 || fail "lbea-send:" "$(cat "$work/sent")"
}

for compression in none zstd; do
  record "$work/Aufnahme ä $compression.mcap" --record-compression $compression
  send --to "$rig"
  stop_recording "$work/Aufnahme ä $compression.mcap" "\"received\":$count," "\"recorded\":$count,"
done

# Between a rig and a matcher, with keys on both sides. The matcher's results are recorded as well.
serve --key "$work/matcher.key" --allow "$work/camera.pub"
record "$work/forwarded.mcap" --key "$work/matcher.key" --allow "$work/camera.pub" --forward "$frames" \
  --results "$results" --server-key "$work/matcher.pub" --client-key "$work/camera.key"
send --to "$rig" --server-key "$work/matcher.pub" --key "$work/camera.key"
for _ in $(seq 200); do grep -q 'end of the test' "$work/log" && break; sleep 0.02; done
stop_recording "$work/forwarded.mcap" "\"forwarded\":$count," "\"refused\":0," "\"undelivered\":0,"
stop_serving "$count"
"$host/tools/replay/lbea-replay" "$work/forwarded.mcap" --model "$model" --pose "$sensor" --against >"$work/replayed" ||
  fail "a replay gives other results:" "$(cat "$work/replayed")"

check_same 1 "$work/forwarded.mcap" --frames "tcp://127.0.0.1:*"
check_same 1 "$work/no folder ö/a.mcap" --frames "tcp://127.0.0.1:*"
check_same 1 "$work/a.mcap" --frames "tcp://0.0.0.0:5555"
check_same 2 "%q.mcap" --frames "tcp://127.0.0.1:*"
code=0
"${windows[@]}" "$work/a.mcap" --frames "tcp://127.0.0.1:*" --record-window 1:1 2>"$work/err" || code=$?
[ "$code" -eq 1 ] && grep -q 'give --trigger-ns' "$work/err" || fail "a window without a trigger: $(cat "$work/err")"
! "${windows[@]}" --help | grep 'ipc:\|SIGUSR1' || fail "--help names what Windows does not have"
[ ! -e "$work/a.mcap" ] && [ ! -e "$work/a.mcap.partial" ] || fail "a refused recording leaves a file"
echo "$count frames recorded, also forwarded and with keys; Ctrl-C completes the file"
