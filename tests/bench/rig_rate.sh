#!/usr/bin/env bash
# Two rigs at full rate: counts frames sent, matched and lost of each, and processor times of lbea-serve by thread.
#   bash tests/bench/rig_rate.sh BUILD                62,000 points, 650 frames/s each, 2 s, a crash in the middle
#   POINTS=16000 RATE=400 TIME=5 bash ...             other settings; RUNS=number of runs, QUEUE=length of each queue
#   RUN='nice -n -15'                                 before each program
# Exit code 0: in one of the runs, no frame was lost. 1: frames were lost and counted. 2: a frame was not counted.
set -euo pipefail
build=$(realpath "${1:-build/release}") source=$(realpath "$(dirname "$0")/../..")
points=${POINTS:-62000} rate=${RATE:-650} demo=$source/tests/data/rail-demo
PATH=$(printf '%s:' "$build"/tools/{bake,sense,serve,send})$PATH
folder=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$folder"' EXIT

cp -r "$demo"/. "$folder"
# The other rig: turned by 180 degrees about the vertical axis through the rail's middle.
python3 - "$folder" <<'PYTHON'
import json, pathlib, sys
folder = pathlib.Path(sys.argv[1])
rig = json.loads((folder / "sensor.json").read_text())
def turned(T):
    return [[-T[0][0], -T[0][1], -T[0][2], 400 - T[0][3]], [-v for v in T[1]], T[2]]
rig["T_reference_sensor"] = turned(rig["T_reference_sensor"])
rig["sensor"]["T_reference_right"] = turned(rig["sensor"]["T_reference_right"])
(folder / "opposite.json").write_text(json.dumps(rig))
ensemble = (folder / "ensemble.toml").read_text().replace('views = "sensor.json"', 'views = ["sensor.json", "opposite.json"]')
(folder / "two.toml").write_text(ensemble)
PYTHON
lbea-bake "$folder/two.toml" -o "$folder/rail.lbea" >/dev/null
run=$demo/experiment/run_043 # not in the model
for rig in sensor opposite; do
  lbea-sense "$run" --sensor "$folder/$rig.json" --rate "$rate" --out "$folder/moving-$rig" >/dev/null
  for still in 0 20; do
    for seed in 1 2 3 4; do
      lbea-sense "$run" --sensor "$folder/$rig.json" --steps $still:$still --seed $seed --out "$folder/$still-$seed-$rig" >/dev/null
    done
  done
done

for ((i = 0; i < ${RUNS:-1}; ++i)); do
  python3 "$source/tests/bench/rig_rate.py" "$folder" "$points" "$rate" "${TIME:-2}" "${QUEUE:-64}" ${RUN:-} && exit
  [ $? = 1 ] || exit 2
done
exit 1
