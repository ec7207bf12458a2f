#!/usr/bin/env bash
# The archive for another machine: users' programs compile against it, run, and print what they print on this machine.
#   check_archive.sh BUILD HOST_BUILD SENSOR_JSON CC CXX [EMULATOR...]
set -euo pipefail
build=$1 host=$2 sensor=$3 cc=$4 cxx=$5
shift 5
emulator=("$@")
project=$(cd "$(dirname "$0")/../.." && pwd)
model=$host/demo/rail.lbea
[ -e "$model" ] || { echo "skipped: $model is missing; build the preset ci and run its tests first"; exit 77; }
work=$(mktemp -d)
server=
trap '[ -z "$server" ] || kill "$server" 2>/dev/null || true; rm -rf "$work"' EXIT
fail() { printf '%s\n' "$@" >&2; exit 1; }

(cd "$build" && cpack -B "$work" >/dev/null)
cmake -E chdir "$work" cmake -E tar xf "$(find "$work" -maxdepth 1 -name 'lbea-*.zip' -o -maxdepth 1 -name 'lbea-*.tar.gz')"
archive=$(dirname "$work"/lbea-*/README.txt)
libdir=$(dirname "$(find "$archive" -name liblbea.a)")
shared=(-llbea -Wl,-rpath,"$libdir")
if [ -e "$archive/bin/lbea.dll" ]; then
  cp "$archive"/bin/lbea*.dll "$work"
  shared=(-static -l:liblbea.dll.a) # only GCC's libraries inside
fi

warnings=(-O1 -Wall -Wextra -Wpedantic -Werror)
"$cc" -std=c11 "${warnings[@]}" "$archive/examples/match.c" -I"$archive/include" -L"$libdir" -llbea -Wl,-rpath,"$libdir" -o "$work/match"
"$cxx" -std=c++20 "${warnings[@]}" "$project/tests/consumer/main.cpp" -I"$archive/include" -L"$libdir" "${shared[@]}" -o "$work/consumer"
"$cxx" -std=c++20 "${warnings[@]}" "$project/tests/consumer/main.cpp" -I"$archive/include" "$libdir/liblbea.a" -static -o "$work/static_consumer"
wire=no
if [ -e "$archive/include/lbea/wire.h" ]; then
  wire=yes
  for example in publish subscribe; do
    "$cc" -std=c99 "${warnings[@]}" "$archive/examples/$example.c" -I"$archive/include" -L"$libdir" -llbea-wire -Wl,-rpath,"$libdir" -o "$work/$example"
  done
  "$cc" -std=c99 "${warnings[@]}" "$project"/tests/wire/c/*.c "$project/tests/c_api/inputs.c" -I"$project" -I"$archive/include" \
    -L"$libdir" -llbea-wire -Wl,-rpath,"$libdir" -o "$work/client"
fi
# The import libraries, with what has MSVC's ABI and linker: sizes of structs and messages are as by mingw.
msvc=no
if [ -e "$archive/lib/lbea.lib" ] && command -v clang lld-link >/dev/null; then
  msvc=yes
  printf 'LIBRARY kernel32.dll\nEXPORTS\n  GetStdHandle\n  WriteFile\n  ExitProcess\n' >"$work/kernel32.def"
  llvm-dlltool -m i386:x86-64 -d "$work/kernel32.def" -l "$work/kernel32.lib"
  clang --target=x86_64-pc-windows-msvc -ffreestanding -std=c99 "${warnings[@]}" -Wno-language-extension-token \
    -I"$archive/include" -c "$project/tests/package/msvc.c" -o "$work/msvc.obj"
  lld-link /nodefaultlib /entry:start /subsystem:console /opt:ref "$work/msvc.obj" "$libdir/lbea.lib" "$libdir/lbea-wire.lib" \
    "$work/kernel32.lib" "/out:$work/by_msvc.exe"
  "$cc" -std=c99 "${warnings[@]}" -I"$archive/include" -nostartfiles -e start "$project/tests/package/msvc.c" -L"$libdir" \
    -llbea -llbea-wire -lkernel32 -o "$work/by_mingw.exe"
fi
cc -std=c11 -O1 "$archive/examples/match.c" -I"$archive/include" -L"$host/runtime" -llbea -Wl,-rpath,"$host/runtime" -o "$work/here"

python3 - "$host/demo/frames/frame_00010.ply" "$sensor" "$work" <<'PYTHON'
import json, struct, sys
header, points = open(sys.argv[1], "rb").read().split(b"end_header\n", 1)
with open(sys.argv[3] + "/cloud.xyz", "w") as cloud:
    for x, y, z in struct.iter_unpack("<3f", points): print(f"{x:.9g} {y:.9g} {z:.9g}", file=cloud)
pose = json.load(open(sys.argv[2]))["T_reference_sensor"]
print(*sum(pose[:3], []), file=open(sys.argv[3] + "/pose.txt", "w"))
PYTHON
run() { "${emulator[@]}" "$(echo "$work/$1"*)" "${@:2}" | tr -d '\r'; }  # PROGRAM, whatever its suffix, ARGUMENT...
cd "$work"
for method in lbea fit; do
  run match "$model" pose.txt $method <cloud.xyz >printed || fail "match failed:" "$(cat printed)"
  ./here "$model" pose.txt $method <cloud.xyz >expected
  diff expected printed
done
if [ $msvc = yes ]; then
  run by_msvc >printed
  run by_mingw >expected
  diff expected printed
  grep -q '^no such file: cannot open' printed || fail "msvc.c printed:" "$(cat printed)"
fi
for consumer in consumer static_consumer; do
  run $consumer "$model" || fail "$consumer does not find a sample of the model"
  code=0
  run $consumer /no/such/model >/dev/null || code=$?
  [ "$code" -eq 3 ] || fail "$consumer does not catch exceptions of the library"
done
for name in serve send record inspect keygen; do
  [ -e "$build/tools/$name" ] || continue # some of the sources could not be downloaded
  printed=$("${emulator[@]}" "$(echo "$archive/bin/lbea-$name"*)" --version | tr -d '\r')
  [[ $printed == "lbea-$name "* ]] || fail "lbea-$name --version printed: $printed"
done
for license in copyright libzmq libsodium libxxhash-dev libflatbuffers-dev; do
  [ $wire = no ] || ls "$archive"/*"$license.txt" >/dev/null || fail "there is no license of $license"
done
if [ $wire = yes ]; then
  "$host/tools/serve/lbea-serve" "$model" --pose "$sensor" --frames "tcp://127.0.0.1:*" --results "tcp://127.0.0.1:*" >tally 2>log &
  server=$!
  for _ in $(seq 600); do grep -q 'ready: frames on ' log && break; sleep 0.1; done
  frames=$(sed -n 's/.*frames on \([^, ]*\).*/\1/p' log | head -n 1) results=$(sed -n 's/.*results on \([^, ]*\).*/\1/p' log | head -n 1)
  run subscribe "$results" >heard 2>lost &
  subscriber=$!
  while kill -0 "$subscriber" 2>/dev/null; do # it ends with the first test that it hears the end of
    [ "$(run publish "$frames" <cloud.xyz)" = "sent 10, refused 0" ] || fail "publish.c could not send"
  done
  wait "$subscriber" || fail "subscribe.c lost results:" "$(cat lost)"
  grep -q '^[0-9]* ok .* s$' heard || fail "subscribe.c printed:" "$(cat heard)"
  kill -INT "$server"
  wait "$server" || fail "lbea-serve lost frames:" "$(cat tally)"
  server=
  bash "$project/tests/wire/c/client.sh" "$host" tcp "${emulator[@]}" "$(echo "$work/client"*)"
fi
echo "$(basename "$archive"): match.c prints what it prints here; C++ links both libraries; publish.c and subscribe.c: $wire; MSVC's ABI: $msvc"
