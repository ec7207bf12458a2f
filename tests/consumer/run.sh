#!/usr/bin/env bash
# Installs the build into a clean prefix and builds projects with the installed files only: by CMake, by pkg-config, in
# C++, in C alone, and the examples with the command in their first comment.
#   run.sh BUILD_DIR MODEL
set -euo pipefail
build=$1 model=$2
here=$(cd "$(dirname "$0")" && pwd)
examples=$here/../../docs/examples
work=$(mktemp -d)
server=
trap '[ -z "$server" ] || kill "$server" 2>/dev/null || true; rm -rf "$work"' EXIT
fail() { printf '%s\n' "$@" >&2; exit 1; }

cmake --install "$build" --prefix "$work/installed" >/dev/null
mv "$work/installed" "$work/prefix"  # installed files must not contain the prefix
prefix=$work/prefix
libdir=$(dirname "$(find "$prefix" -name 'liblbea.so.0')")
# Regression: lbea/test_history.hpp was not installed.
for header in "$here"/../../runtime/include/lbea/* "$here"/../../adapters/wire/include/lbea/*; do
  [ -f "$prefix/include/lbea/${header##*/}" ] || fail "lbea/${header##*/} is not installed"
done
export LD_LIBRARY_PATH=$libdir PKG_CONFIG_PATH=$libdir/pkgconfig

for project in . only_c; do
  cmake -S "$here/$project" -B "$work/build/$project" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_BUILD_TYPE=Release \
        -DEXAMPLES="$examples" >/dev/null
  cmake --build "$work/build/$project" >/dev/null
done
for consumer in consumer consumer_static; do
  "$work/build/$consumer" "$model" || fail "$consumer does not find a sample of the model"
  code=0
  "$work/build/$consumer" /no/such/model >/dev/null || code=$?
  [ "$code" -eq 3 ] || fail "$consumer does not catch exceptions of the library"
done
[ -n "$(ldd "$work/build/consumer" | grep "$libdir/liblbea.so.0")" ] || fail "consumer does not use the shared library"
ldd "$work/build/consumer_static" | grep -q liblbea && fail "consumer_static uses the shared library"

compile() {  # compiler, example, name for pkg-config, flags
  local compiler=$1 example=$2 package=$3
  shift 3
  # shellcheck disable=SC2046
  "$compiler" -O1 -Wall -Wextra -Wpedantic -Werror "$@" "$examples/$example" $(pkg-config --cflags --libs "$package") -o "$work/$example.out"
}
compile "${CC:-cc}" match.c lbea -std=c11
compile "${CXX:-c++}" match.cpp lbea-rig -std=c++20
compile "${CXX:-c++}" publish.cpp lbea-wire -std=c++20
compile "${CXX:-c++}" subscribe.cpp lbea-wire -std=c++20
compile "${CC:-cc}" publish.c lbea-wire-c -std=c99
compile "${CC:-cc}" subscribe.c lbea-wire-c -std=c99
[ -n "$(ldd "$work/publish.c.out" | grep "$libdir/liblbea-wire.so.0")" ] || fail "publish.c does not use the shared library"
ldd "$work/publish.c.out" | grep -qE 'liblbea\.so|libzmq' && fail "publish.c needs more than liblbea-wire.so"

"$work/build/consumer" "$model" --points >"$work/cloud.xyz"
# The same cloud from a sensor that is turned by 90 degrees and moved.
echo '{"T_reference_sensor": [[0, -1, 0, 10], [1, 0, 0, 20], [0, 0, 1, 30]]}' >"$work/sensor.json"
echo '0 -1 0 10  1 0 0 20  0 0 1 30' >"$work/pose.txt"
awk '{ print $2 - 20, 10 - $1, $3 - 30 }' OFMT=%.9g "$work/cloud.xyz" >"$work/seen.xyz"
for example in "$work/match.c.out" "$work/match.cpp.out" "$work/build/match_c" "$work/build/match_cpp" "$work/build/only_c/match_only_c"; do
  pose=$work/pose.txt
  [ "$example" = "${example/cpp/}" ] || pose=$work/sensor.json
  for cloud in cloud seen; do
    [ $cloud = cloud ] && arguments=("$model") || arguments=("$model" "$pose")
    "$example" "${arguments[@]}" <"$work/$cloud.xyz" >"$work/output" || fail "$example failed:" "$(cat "$work/output")"
    grep -q '^ok, 100 % of the surface seen' "$work/output" || fail "$example printed:" "$(cat "$work/output")"
  done
done
cmp <("$work/match.c.out" "$model" <"$work/cloud.xyz" | sed -n 1,4p) <("$work/match.cpp.out" "$model" <"$work/cloud.xyz") ||
  fail "the outputs in C and C++ differ"

"$prefix/bin/lbea-serve" "$model" --frames "ipc://$work/frames" --results "ipc://$work/results" >"$work/tally" 2>/dev/null &
server=$!
published=0
for subscribe in "$work/subscribe.cpp.out" "$work/build/subscribe" "$work/subscribe.c.out" "$work/build/subscribe_c" \
  "$work/build/only_c/subscribe_only_c"; do
  "$subscribe" "ipc://$work/results" >"$work/heard" 2>&1 &
  subscriber=$!
  while kill -0 "$subscriber" 2>/dev/null; do # it ends with the first test that it hears the end of
    for publish in "$work/publish.cpp.out" "$work/build/publish" "$work/publish.c.out" "$work/build/publish_c" \
      "$work/build/only_c/publish_only_c"; do
      [ "$("$publish" "ipc://$work/frames" <"$work/cloud.xyz")" = "sent 10, refused 0" ] || fail "$publish could not send"
      published=$((published + 10))
    done
  done
  wait "$subscriber" || fail "$subscribe lost results:" "$(cat "$work/heard")"
  grep -q "^[0-9]* ok unknown .* s$" "$work/heard" || fail "$subscribe printed:" "$(cat "$work/heard")"
done
kill -INT "$server"
wait "$server" || fail "lbea-serve lost frames:" "$(cat "$work/tally")"
server=
grep -q "matched $published" "$work/tally" || fail "lbea-serve did not match all:" "$(cat "$work/tally")"
echo "installed library and examples: built and run by CMake and pkg-config, in C and C++"
