#!/usr/bin/env bash
# The first steps of a new user on a minimal Debian: first_steps.sh FOLDER_OF_PACKAGES
set -euo pipefail
packages=$1
step() { printf '\n== %s\n' "$*"; }
quietly() { "$@" >log 2>&1 || { cat log; exit 1; }; }
install() { quietly apt-get install -y -qq --no-install-recommends "$@"; }
wait_for() { for _ in $(seq 200); do grep -q "$1" "$2" 2>/dev/null && return; sleep 0.05; done; cat "$2"; return 1; }

step "install the library alone: it needs no other packages"
quietly apt-get update
before=$(dpkg-query -f '${Package}\n' -W | wc -l)
install "$packages"/liblbea0_*.deb
after=$(dpkg-query -f '${Package}\n' -W | wc -l)
echo "liblbea0 installed $((after - before - 1)) other packages"

step "install the programs"
install "$packages"/lbea-tools_*.deb
for program in /usr/bin/lbea-*; do "$program" --version; done
! ldd /usr/bin/lbea-* | grep 'not found'

step "bake, sense, serve, send, evaluate, monitor"
lbea-bake rail-demo/ensemble.toml -o rail.lbea | tail -n 2
lbea-inspect rail.lbea >inspection
head -n 5 inspection
lbea-sense rail-demo/experiment/run_043 --sensor rail-demo/sensor.json --out frames
lbea-serve rail.lbea --frames ipc:///tmp/frames --results ipc:///tmp/results --pose rail-demo/sensor.json >tally 2>serve.log &
server=$!
wait_for ready serve.log
lbea-monitor --results ipc:///tmp/results --model rail.lbea --http 127.0.0.1:8899 >monitor.log 2>&1 &
monitor=$!
lbea-eval live rail.lbea --results ipc:///tmp/results --out evaluation >table 2>eval.log &
evaluation=$!
wait_for ready eval.log
lbea-send frames --to ipc:///tmp/frames --rate 20
wait "$evaluation"
head -n 5 table
exec 3<>/dev/tcp/127.0.0.1/8899
printf 'GET / HTTP/1.0\r\nHost: 127.0.0.1:8899\r\n\r\n' >&3
page=$(cat <&3)
grep -qi '</html>' <<<"$page" || { cat monitor.log; echo "the monitor serves no page: $page"; exit 1; }
echo "the monitor serves its page"
kill -INT "$monitor"
wait "$monitor"
kill -INT "$server"
wait "$server"
tail -n 1 tally
grep -q 'matched 21' tally

step "compile and link the examples: C and C++, one command each"
install "$packages"/liblbea-dev_*.deb "$packages"/liblbea-wire0_*.deb gcc g++ libc6-dev pkg-config libzmq3-dev
cc examples/match.c $(pkg-config --cflags --libs lbea) -o match_c
c++ -std=c++20 examples/match.cpp $(pkg-config --cflags --libs lbea-rig) -o match_cpp
c++ -std=c++20 examples/publish.cpp $(pkg-config --cflags --libs lbea-wire) -o publish
c++ -std=c++20 examples/subscribe.cpp $(pkg-config --cflags --libs lbea-wire) -o subscribe
cc -std=c99 examples/publish.c $(pkg-config --cflags --libs lbea-wire-c) -o publish_c
cc -std=c99 examples/subscribe.c $(pkg-config --cflags --libs lbea-wire-c) -o subscribe_c
printf '0 0 0\n' | ./match_c rail.lbea || true
! ldd match_c match_cpp publish subscribe publish_c subscribe_c | grep 'not found'

if compgen -G "$packages/python3-lbea_*.deb" >/dev/null; then
  step "Python"
  install "$packages"/python3-lbea_*.deb
  python3 -c '
import lbea, lbea_client
model = lbea.Model("rail.lbea")
result = lbea.Matcher(model).match(model.node_positions(5))
assert result.status == "ok" and result.matches[0].sample == 5, result
print(model, result.matches[0])'
fi

step "remove the packages"
quietly apt-get purge -y -qq '*lbea*'
left=$(find /usr -name '*lbea*')
[ -z "$left" ] || { echo "not removed: $left"; exit 1; }
echo "all steps done"
