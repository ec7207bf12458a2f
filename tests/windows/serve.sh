#!/usr/bin/env bash
# lbea-serve.exe matches what lbea-send on this machine sends: the results are those of lbea-serve on this machine, to the
# last bit, for every method, rendered samples and several rigs.
#   serve.sh HOST_BUILD EMULATOR... PROGRAM
set -euo pipefail
host=$1 name=lbea-serve
shift
windows=("$@")
. "$(dirname "$0")/support.sh"
make_subscriber
matcher=("${windows[@]}")
for key in matcher camera; do
  "${windows[@]::${#windows[@]}-1}" "$(dirname "${windows[-1]}")/lbea-keygen.exe" "$work/$key" >"$work/printed"
done
chmod 600 "$work"/*.key # the emulator lets the group read them
folder="$work/Prüfstand 1"
mkdir "$folder"
cp "$model" "$folder/Träger.lbea"
sed 's/$/\r/; 1s/^/\xef\xbb\xbf/' "$sensor" >"$folder/Kamera ä.json" # as editors on Windows save it
sensor="$folder/Kamera ä.json"
model="$folder/Träger.lbea"

send() { # clouds, arguments
  "$host/tools/send/lbea-send" "$@" >"$work/sent" 2>&1 || fail "lbea-send:" "$(cat "$work/sent")"
}
# Matches the recorded frames on this machine, with the recorded settings.
check_recording() { # file, results
  [ ! -e "$1.partial" ] || fail "the partial file remains"
  "$host/tools/replay/lbea-replay" "$1" --model "$model" --against >"$work/replayed" 2>&1 || fail "$(cat "$work/replayed")"
  grep -q "^$2 results the same, 0 different" "$work/replayed" || fail "not $2 results:" "$(cat "$work/replayed")"
}
record() { # file, arguments: for `serve`
  serve --record "$1" --record-memory 16 "${@:2}"
}

# What is published, with keys on both sides; beside it all that has a socket of its own.
publish() { # file, arguments
  local subscriber
  serve --key "$work/matcher.key" --allow "$work/camera.pub" "${@:2}"
  "$work/subscribe" "$results" "$work/matcher.pub" "$work/camera.key" >"$1" 2>"$work/account" &
  subscriber=$!
  wait_for_peer "$results"
  send "$clouds" --to "$frames" --results "$results" --server-key "$work/matcher.pub" --key "$work/camera.key"
  wait "$subscriber" || fail "results are lost:" "$(cat "$work/account")"
}
publish "$work/windows" --record "$folder/veröffentlicht.mcap" --record-memory 16 --record-compression zstd \
  --metrics 127.0.0.1:0 --preview "tcp://127.0.0.1:*" --infer plastic_strain --inference "tcp://127.0.0.1:*"
metrics=$(/usr/bin/python3 -c 'import sys, urllib.request as http; print(http.urlopen(sys.argv[1]).read().decode())' \
  "$(sed -n 's/.*metrics on //p' "$work/log")")
for line in "lbea_frames_total{fate=\"matched\",status=\"ok\"} $count" 'process_resident_memory_bytes [1-9]'; do
  grep -q "^$line" <<<"$metrics" || fail "the metrics lack $line:" "$metrics"
done
stop_serving "$count"
cp "$work/tally" "$work/windows_tally"
check_recording "$folder/veröffentlicht.mcap" "$count"
matcher=("$linux")
publish "$work/linux" --record "$work/published.mcap" --record-memory 16
stop_serving "$count"
matcher=("${windows[@]}")
diff "$work/linux" "$work/windows" || fail "other results are published"
diff "$work/tally" "$work/windows_tally" || fail "frames are accounted for otherwise"

for method in lbea vtp; do
  record "$work/$method.mcap" --method $method --matchers 2
  send "$clouds" --to "$frames"
  stop_serving "$count"
  check_recording "$work/$method.mcap" "$count"
done

# A rig that hangs upside down, for which the samples are rendered at the start.
/usr/bin/python3 - "$sensor" "$clouds" "$work/turned" <<'PYTHON'
import json, pathlib, struct, sys

sensor, clouds, out = map(pathlib.Path, sys.argv[1:])
def product(a, b): return [[sum(a[i][k] * b[k][j] for k in range(4)) for j in range(4)] for i in range(4)]
def inverse(T):
    R = [[T[j][i] for j in range(3)] for i in range(3)]
    return [R[i] + [-sum(R[i][k] * T[k][3] for k in range(3))] for i in range(3)] + [T[3]]
rig = json.loads(sensor.read_text(encoding="utf-8-sig"))
half_turn = [[-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
left, right = [T[:3] + [[0, 0, 0, 1]] for T in (rig["T_reference_sensor"], rig["sensor"]["T_reference_right"])]
turned = product(right, half_turn)  # the right eye becomes the left one
rig["T_reference_sensor"], rig["sensor"]["T_reference_right"] = turned[:3], product(left, half_turn)[:3]
T = product(inverse(turned), left)
out.mkdir()
(out / "sensor.json").write_text(json.dumps(rig))
for cloud in sorted(clouds.glob("*.ply"))[::7]:
    header, points = cloud.read_bytes().split(b"end_header\n", 1)
    moved = [struct.pack("<3f", *(r[0] * x + r[1] * y + r[2] * z + r[3] for r in T[:3])) for x, y, z in struct.iter_unpack("<3f", points)]
    (out / cloud.name).write_bytes(header + b"end_header\n" + b"".join(moved))
PYTHON
turned=$(find "$work/turned" -name '*.ply' | wc -l)
sensor=$work/turned/sensor.json record "$work/turned.mcap" --method fit
grep -q 'rendering .* samples' "$work/log" || fail "the model's images were used for a rig that hangs upside down"
send "$work/turned" --to "$frames"
stop_serving "$turned"
check_recording "$work/turned.mcap" "$turned"

# Two rigs at the same place: their frames are fitted together.
tcp="tcp://127.0.0.1:*"
serve_rigs --pose "left=$sensor" --pose "right=$sensor" --frames "left=$tcp" --frames "right=$tcp" --wait-us 1000000 \
  --record "$work/rigs.mcap" --record-memory 16
senders=()
for rig in left right; do
  of_rig=$(sed -n "s/.*ready: .*frames of $rig on \([^, ]*\).*/\1/p" "$work/log")
  "$host/tools/send/lbea-send" "$clouds" --to "$of_rig" --rate 20 >"$work/sent_$rig" 2>&1 &
  senders+=($!)
done
for sender in "${senders[@]}"; do wait "$sender" || fail "lbea-send:" "$(cat "$work"/sent_*)"; done
stop_serving $((2 * count))
check_recording "$work/rigs.mcap" "$count"

# The exit code when every frame is rejected.
reject() { # file
  local code=0
  serve --max-points 10
  send "$clouds" --to "$frames"
  kill -INT "$server"
  wait "$server" || code=$?
  server=
  [ "$code" -eq 1 ] || fail "exit code $code with all frames rejected"
  cp "$work/tally" "$1"
}
reject "$work/windows"
matcher=("$linux")
reject "$work/linux"
diff "$work/linux" "$work/windows" || fail "rejected frames are accounted for otherwise"

# What cannot work ends as on this machine, with the same words.
endpoints=(--frames "$tcp" --results "$tcp")
cp "$model" "$folder/damaged ß.lbea"
damage "$folder/damaged ß.lbea"
check_same 1 "$folder/damaged ß.lbea" "${endpoints[@]}"
check_same 2 "$model" "${endpoints[@]}" --pose "$folder/fehlt ü.json"
check_same 2 "$model" --frames "$tcp"
refuse() { # what it must print, arguments
  local code=0
  "${windows[@]}" "$model" "${@:2}" >"$work/out" 2>&1 || code=$?
  [ "$code" -eq 1 ] && grep -q "$1" "$work/out" || fail "exit code $code: $(cat "$work/out")"
}
refuse 'write tcp://127.0.0.1:5555' --frames "ipc://$work/frames" --results "$tcp"
refuse '^failed *frames ' --frames "tcp://0.0.0.0:*" --results "$tcp" --check
"${windows[@]}" "$model" "${endpoints[@]}" --pose "$sensor" --record "$folder/geprüft.mcap" --pin 0 --realtime 1 \
  --lock-memory --check --json >"$work/out" || fail "--check failed:" "$(cat "$work/out")"
for part in '"passed":true' 'the matching thread runs on processor 0' 'highest priority' 'stay in RAM' "MB/s" ; do
  grep -qF "$part" "$work/out" || fail "--check does not print $part:" "$(cat "$work/out")"
done
[ -z "$(find "$folder" -name '*geprüft*' -o -name '.lbea*')" ] || fail "--check leaves files"
! "${windows[@]}" --help | grep 'ipc:\|SIGUSR1\|SCHED_FIFO' || fail "--help names what Windows does not have"
echo "$count frames by each method, for another pose and of two rigs: the bits of this machine"
