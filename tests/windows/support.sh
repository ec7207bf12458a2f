# For the tests of the programs for Windows and ARM64: compared with those of the build for this machine (HOST_BUILD), and with its
# programs at the other end. The scripts set `host`, `windows` (the emulator and the program) and `name`.
export LC_ALL=C.UTF-8 # the emulator reads file names by it
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
sensor=$project/tests/data/rail-demo/sensor.json model=$host/demo/rail.lbea clouds=$host/demo/frames
linux=$host/tools/${name#lbea-}/$name
for needed in "$model" "$linux" "$host/tools/serve/lbea-serve" "$host/tools/keygen/lbea-keygen"; do
  [ -e "$needed" ] || { echo "skipped: $needed is missing; build the preset ci and run its tests first"; exit 77; }
done
"${windows[@]}" --version >/dev/null 2>&1 || { echo "skipped: ${windows[*]} does not run; install wine64 or qemu-user"; exit 77; }
work=$(mktemp -d)
server= recorder=
end() {
  for process in $server $recorder; do kill -9 "$process" 2>/dev/null || true; done
  rm -rf "$work"
}
trap end EXIT
# While a program runs in Wine, others start in a second instead of several.
if [[ ${windows[-1]} == *.exe ]]; then
  mkfifo "$work/idle"
  "${windows[@]::${#windows[@]}-1}" cmd.exe /c pause <"$work/idle" >/dev/null 2>&1 &
  exec 9>"$work/idle"
fi
fail() { printf '%s\n' "$@" >&2; exit 1; }
wait_until_ready() { # log, process, name
  for _ in $(seq 600); do
    grep -q 'ready: frames ' "$1" && return
    kill -0 "$2" 2>/dev/null || fail "$3 ended:" "$(cat "$1")"
    sleep 0.1
  done
  fail "$3 is not ready:" "$(cat "$1")"
}
damage() { printf '\377\376\375\374' | dd of="$1" bs=1 seek="$(($(stat -c %s "$1") / 2))" conv=notrunc status=none; }
count=$(find "$clouds" -name '*.ply' | wc -l)
make_keys() { for key in matcher camera; do "$host/tools/keygen/lbea-keygen" "$work/$key" >/dev/null; done; }

# A matcher with any ports; sets `frames` and `results`.
matcher=("$host/tools/serve/lbea-serve")
serve() { serve_rigs --pose "$sensor" --frames "tcp://127.0.0.1:*" "$@"; }
serve_rigs() { # arguments
  : >"$work/log" # of an earlier one
  "${matcher[@]}" "$model" --results "tcp://127.0.0.1:*" --queue 64 --json "$@" >"$work/tally" 2>"$work/log" &
  server=$!
  wait_until_ready "$work/log" "$server" lbea-serve
  frames=$(sed -n 's/.*ready: frames[^,]* on \([^, ]*\).*/\1/p' "$work/log")
  results=$(sed -n 's/.*results on \([^, ]*\).*/\1/p' "$work/log" | head -n 1)
}
# Ctrl-C; every one of so many captures must have been matched.
stop_serving() { # captures
  kill -INT "$server"
  wait "$server" || fail "lbea-serve lost frames:" "$(cat "$work/tally" "$work/log")"
  server=
  for part in "\"captured\":$1,\"received\":$1," "\"matched\":$1,"; do
    grep -qF "$part" "$work/tally" || fail "lbea-serve did not count $part" "$(cat "$work/tally")"
  done
}

make_subscriber() {
  cc -O1 "$project/docs/examples/subscribe.c" -I"$project/adapters/wire/include" -I"$project/runtime/include" \
    -L"$host/adapters/wire" -llbea-wire -Wl,-rpath,"$host/adapters/wire" -o "$work/subscribe"
}
# Until somebody is connected, and a little longer, for a subscription.
wait_for_peer() { # endpoint
  local port
  port=$(printf ':%04X' "${1##*:}")
  for _ in $(seq 200); do
    awk -v port="$port" 'substr($2, 9) == port && $4 == "01" { found = 1 } END { exit !found }' /proc/net/tcp && break
    sleep 0.05
  done
  sleep 0.3
}

# The program for Windows must print what the one for this machine prints, and end with the same exit code, which must
# be `expected`.
check_same() { # expected exit code, arguments
  local expected=$1 code=0 windows_code=0
  shift
  "$linux" "$@" >"$work/out" 2>"$work/err" || code=$?
  "${windows[@]}" "$@" >"$work/windows_out" 2>"$work/windows_err" || windows_code=$?
  [ "$code" -eq "$expected" ] || fail "$name $*: exit code $code instead of $expected" "$(cat "$work/err")"
  [ "$windows_code" -eq "$expected" ] ||
    fail "$name.exe $*: exit code $windows_code instead of $expected" "$(cat "$work/windows_err")"
  cmp "$work/out" "$work/windows_out" || fail "$name $* prints on Windows:" "$(head -c 4000 "$work/windows_out")"
  diff "$work/err" <(tr '\\' / <"$work/windows_err") || # separators in paths
    fail "$name $*: another message on Windows"
}
