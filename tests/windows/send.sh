#!/usr/bin/env bash
# lbea-send.exe sends the demo's frames to lbea-serve on this machine.
#   send.sh HOST_BUILD EMULATOR... PROGRAM
set -euo pipefail
host=$1 name=lbea-send
shift
windows=("$@")
. "$(dirname "$0")/support.sh"
make_subscriber
make_keys
folder="$work/Tür 2" # also with a blank
cp -r "$clouds" "$folder"

# The frames by one program; what lbea-serve publishes goes to a file.
send_by() { # file, keys of lbea-serve, keys of the clients, program
  local server_keys client_keys subscriber
  read -ra server_keys <<<"$2"
  read -ra client_keys <<<"$3"
  serve "${server_keys[@]}"
  "$work/subscribe" "$results" ${client_keys[0]:+"$work/matcher.pub" "$work/camera.key"} >"$1" 2>"$1.account" &
  subscriber=$!
  wait_for_peer "$results"
  "${@:4}" "$folder" --to "$frames" --results "$results" --json "${client_keys[@]}" >"$work/sent" 2>"$work/sent_log" ||
    fail "$4 failed:" "$(cat "$work/sent" "$work/sent_log")"
  wait "$subscriber" || fail "results are lost:" "$(cat "$1.account")"
  stop_serving "$count"
  grep -qF "{\"captured\":$count,\"sent\":$count,\"refused\":0,\"handed_over\":$count," "$work/sent" ||
    fail "$4 printed:" "$(cat "$work/sent")"
}

for keys in without with; do
  server_keys='' client_keys=''
  if [ $keys = with ]; then
    server_keys="--key $work/matcher.key --allow $work/camera.pub"
    client_keys="--server-key $work/matcher.pub --key $work/camera.key"
  fi
  send_by "$work/linux_$keys" "$server_keys" "$client_keys" "$linux"
  send_by "$work/windows_$keys" "$server_keys" "$client_keys" "${windows[@]}"
  diff "$work/linux_$keys" "$work/windows_$keys" || fail "$keys keys, the results differ"
  [ "$(wc -l <"$work/windows_$keys")" -eq "$count" ] || fail "not one result per frame"
done

# Ctrl-C ends it with its tally.
serve
"${windows[@]}" "$folder" --to "$frames" --loop 0 --json >"$work/sent" 2>"$work/sent_log" &
sender=$!
wait_for_peer "$frames"
kill -INT "$sender"
wait "$sender" || fail "Ctrl-C: exit code $?" "$(cat "$work/sent" "$work/sent_log")"
grep -q '^{"captured":[0-9]*,"sent":' "$work/sent" || fail "after Ctrl-C it printed: $(cat "$work/sent")"
kill -9 "$server"
wait "$server" 2>/dev/null || true
server=

# What cannot work ends as on this machine, with the same words.
cp -r "$clouds" "$work/damaged"
truncate -s -7 "$(find "$work/damaged" -name '*.ply' | sort | head -n 1)"
check_same 0 --version
check_same 0 --list-formats
check_same 1 "$folder" --to tcp://127.0.0.1:1
check_same 1 "$work/fehlt ä" --to tcp://127.0.0.1:1
check_same 1 "$work/damaged" --to tcp://127.0.0.1:1
check_same 2 "$folder"
code=0
"${windows[@]}" "$folder" --to "ipc://$work/frames" 2>"$work/err" || code=$?
[ "$code" -eq 1 ] && grep -q 'not available on Windows' "$work/err" || fail "ipc is not refused: $(cat "$work/err")"
"${windows[@]}" --help | grep -q 'ipc:' && fail "--help names ipc endpoints"
echo "$count frames without and with keys: the results are those of lbea-send on this machine"
