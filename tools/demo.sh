#!/usr/bin/env bash
# The complete chain on real input: bakes an ensemble of crash runs, measures another run with a virtual camera rig, streams
# the frames over ZeroMQ, matches and records them live, receives the results in another process, draws a picture of them,
# and writes the report of the test.
#   bash tools/demo.sh [--out FOLDER] [--build FOLDER_OF_AN_EXISTING_BUILD] [--monitor]
# --monitor continues: it repeats the test and serves the web page that shows it, until Ctrl-C.
set -euo pipefail
project=$(cd "$(dirname "$0")/.." && pwd)
out=$project/build/demo
build=
picture_packages=
monitor=no
while [ $# -gt 0 ]; do
  case "$1" in
    --out) out=$2; shift 2 ;;
    --build) build=$2; shift 2 ;;
    --monitor) monitor=yes; shift ;;
    *) echo "usage: bash tools/demo.sh [--out FOLDER] [--build FOLDER] [--monitor]" >&2; exit 2 ;;
  esac
done

step() { printf '\n== %s\n' "$*"; }
data=$project/tests/data/rail-demo
sockets=$(mktemp -d)
pids=()
clean_up() {
  [ ${#pids[@]} -eq 0 ] || kill "${pids[@]}" 2>/dev/null || true
  rm -rf "$sockets"
}
trap clean_up EXIT

wait_for() {  # text, log file: until a program has logged the text
  for _ in $(seq 200); do
    grep -q "$1" "$2" 2>/dev/null && return
    sleep 0.05
  done
  echo "no '$1' in $2:" >&2
  cat "$2" >&2
  exit 1
}

if [ -z "$build" ]; then
  step "packages and build"
  purpose=demo programs=(lbea-bake lbea-sense lbea-serve lbea-eval lbea-send lbea-report)
  if [ "$monitor" = yes ]; then purpose=monitor programs+=(lbea-monitor); fi
  bash "$project/tools/install-packages.sh" "$purpose"
  bash "$project/tools/install-packages.sh" picture >"$sockets/packages.log" 2>&1 &  # during the compilation
  picture_packages=$!
  pids+=("$picture_packages")
  build=$project/build/$purpose-clang
  (cd "$project" && cmake --preset "$purpose" >/dev/null && cmake --build --preset "$purpose" --target "${programs[@]}")
fi
bin() { printf '%s/tools/%s/lbea-%s' "$build" "$1" "$1"; }
rm -rf "$out"
mkdir -p "$out"

step "bake ten runs into one model, with the depth images that the rig would measure"
"$(bin bake)" "$data/ensemble.toml" -o "$out/rail.lbea"

step "measure a run that is not among them"
"$(bin sense)" "$data/experiment/run_043" --sensor "$data/sensor.json" --out "$out/frames"

step "match its frames live"
frames=ipc://$sockets/frames results=ipc://$sockets/results
"$(bin serve)" "$out/rail.lbea" --method fit --frames "$frames" --results "$results" --pose "$data/sensor.json" \
  --record "$out/test.mcap" 2>"$out/serve.log" >"$out/serve.out" &
serve=$!
pids+=("$serve")
wait_for ready "$out/serve.log"
"$(bin eval)" live "$out/rail.lbea" --results "$results" --truth "$out/frames/truth.csv" --run "$data/experiment/run_043" \
  --pose "$data/sensor.json" --out "$out/evaluation" 2>"$out/eval.log" >"$out/table.txt" &
evaluation=$!
pids+=("$evaluation")
wait_for ready "$out/eval.log"
"$(bin send)" "$out/frames" --to "$frames" --rate 20 >"$out/send.log" 2>&1
wait "$evaluation"
cat "$out/table.txt"
kill -INT "$serve"
wait "$serve"
tail -n 1 "$out/serve.out"

step "report and picture"
"$(bin report)" "$out/test.mcap" -o "$out/report.html" 2>"$out/report.log" &
report=$!
if [ -n "$picture_packages" ] && ! wait "$picture_packages"; then
  cat "$sockets/packages.log" >&2
  exit 1
fi
pids=()
/usr/bin/python3 "$project/tools/picture.py" "$out/evaluation" "$out/demo.png"
wait "$report" || { cat "$out/report.log" >&2; exit 1; }
printf '%s\n' "table:    $out/table.txt" "picture:  $out/demo.png" "report:   $out/report.html" "ParaView: $out/evaluation/matched.pvd"
[ "$monitor" = yes ] || exit 0

step "show it in a browser, until Ctrl-C"
preview=ipc://$sockets/preview
"$(bin serve)" "$out/rail.lbea" --method fit --frames "$frames" --results "$results" --preview "$preview" --pose "$data/sensor.json" 2>"$out/serve.log" >"$out/serve.out" &
pids+=($!)
wait_for ready "$out/serve.log"
"$(bin monitor)" --results "$results" --frames "$preview" --model "$out/rail.lbea" 2>"$out/monitor.log" &
pids+=($!)
wait_for ready "$out/monitor.log"
address=$(grep -o 'http://[^ ]*' "$out/monitor.log")
echo "open $address"
[ -z "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ] || xdg-open "$address" >/dev/null 2>&1 || true
trap 'exit 0' INT TERM
while true; do
  "$(bin send)" "$out/frames" --to "$frames" --rate 5 >"$out/send.log" 2>&1
  sleep 3
done
