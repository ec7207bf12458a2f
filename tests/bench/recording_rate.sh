#!/usr/bin/env bash
# Matches and records frames at full rate: counts frames sent, matched, recorded, lost and announced, and processor times.
#   bash tests/bench/recording_rate.sh BUILD          62,000 points, 1,000 frames/s, 10 s
#   POINTS=16000 RATE=1300 TIME=5 bash ...            other settings; METHOD=lbea|vtp|fit, QUEUE=length of the queue
#   DISK=folder                                       folder of the recording (default: in memory)
#   RUN='nice -n -15'                                 before each program
# Exit code 0: no frame was lost. 1: frames were lost and counted. 2: a frame was not counted.
set -euo pipefail
build=$(realpath "${1:-build/release}") source=$(realpath "$(dirname "$0")/../..")
points=${POINTS:-62000} rate=${RATE:-1000} time=${TIME:-10} method=${METHOD:-lbea} disk=${DISK:-/dev/shm}
PATH=$(printf '%s:' "$build"/tools/{bake,sense,serve,send,inspect})$PATH
folder=$(mktemp -d) recordings=$(mktemp -d -p "$disk")
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$folder" "$recordings"' EXIT
demo=$source/tests/data/rail-demo

lbea-bake "$demo/ensemble.toml" -o "$folder/rail.lbea" >/dev/null
lbea-sense "$demo/runs/run_023" --sensor "$demo/sensor.json" --out "$folder/frames" --frames 8 >/dev/null
mkdir "$folder/clouds"
python3 - "$folder" "$points" <<'PYTHON'
import pathlib, random, struct, sys
folder, points = pathlib.Path(sys.argv[1]), int(sys.argv[2])
random.seed(1)
for source in sorted((folder / "frames").glob("*.ply")):
    head, body = source.read_bytes().split(b"end_header\n", 1)
    cloud = list(struct.iter_unpack("<3f", body)) if b"binary" in head else [tuple(map(float, l.split()[:3])) for l in body.decode().splitlines()]
    chosen = [random.choice(cloud) for _ in range(points)]  # points of the frame, repeated with noise
    moved = b"".join(struct.pack("<3f", *(v + random.gauss(0, 0.1) for v in p)) for p in chosen)
    header = f"ply\nformat binary_little_endian 1.0\nelement vertex {points}\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
    (folder / "clouds" / source.name).write_bytes(header.encode() + moved)
PYTHON
count=$(ls "$folder/clouds" | wc -l) loops=$((rate * time / $(ls "$folder/clouds" | wc -l)))

${RUN:-} lbea-serve "$folder/rail.lbea" --frames "ipc://$folder/f" --results "ipc://$folder/r" --pose "$demo/sensor.json" --method "$method" \
  --queue "${QUEUE:-64}" --record "$recordings/run.mcap" --record-memory "${MEMORY:-1024}" --json >"$folder/serve.json" 2>"$folder/serve.log" &
server=$!
until grep -q 'ready: ' "$folder/serve.log"; do kill -0 $server && sleep 0.05; done
${RUN:-} lbea-send "$folder/clouds" --to "ipc://$folder/f" --results "ipc://$folder/r" --rate "$rate" --loop "$loops" --json >"$folder/send.json" || true
times=$(awk '{print $14 / 100, $15 / 100}' /proc/$server/stat)
kill -INT $server
wait $server || true
lbea-inspect "$recordings/run.mcap" --json >"$folder/inspect.json" || true

python3 - "$folder" "$count" "$times" <<'PYTHON'
import json, pathlib, sys
folder = pathlib.Path(sys.argv[1])
sent, served, found = (json.loads((folder / f"{name}.json").read_text()) for name in ("send", "serve", "inspect"))
user, system = map(float, sys.argv[3].split())
lost = sent["captured"] - served["matched"]
announced = served["captured"] - served.get("unannounced", 0)
print(f"captured {sent['captured']} in {sent['seconds']:.1f} s, sent {sent['sent']}, withheld {sent['refused']}")
print(f"matched {served['matched']}, not matched {lost}: " + ", ".join(f"{k} {v}" for g in ("rejected_by_reason", "dropped_by_reason") for k, v in served[g].items() if v))
print(f"announced {announced}, recorded {served['recorded']}, not recorded {served['unrecorded']}, in the file {found['frames']}")
print(f"lbea-serve: {user:.1f} s user time, {system:.1f} s system time, for {sent['seconds']:.1f} s of frames")
exact = served["adds_up"] and served["captured"] == sent["captured"] and found["frames"] == served["recorded"]
print("all frames are counted" if exact else "A FRAME IS NOT COUNTED")
sys.exit(2 if not exact else 1 if lost or served["unrecorded"] else 0)
PYTHON
