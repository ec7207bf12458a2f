#!/usr/bin/env bash
# lbea-inspect.exe prints what lbea-inspect prints on this machine.
#   inspect.sh HOST_BUILD EMULATOR... PROGRAM
set -euo pipefail
host=$1 name=lbea-inspect
shift
windows=("$@")
. "$(dirname "$0")/support.sh"

folder="$work/Prüfstand 1"
mkdir "$folder"
cp "$model" "$folder/Träger.lbea"
for compression in none lz4 zstd; do
  serve --record "$folder/$compression ä.mcap" --record-compression $compression
  "$host/tools/send/lbea-send" "$clouds" --to "$frames" --results "$results" >"$work/sent" 2>&1 || fail "$(cat "$work/sent")"
  kill -INT "$server"
  wait "$server" || fail "lbea-serve lost frames:" "$(cat "$work/log")"
  server=
done

check_same 0 "$folder/Träger.lbea"
check_same 0 "$folder/Träger.lbea" --json
check_same 0 "$folder/Träger.lbea" --diff "$model" --json
check_same 0 "$folder/Träger.lbea" --diff "$model"
for compression in none lz4 zstd; do
  check_same 0 "$folder/$compression ä.mcap" --json
done
check_same 0 "$folder/zstd ä.mcap"

cp "$folder/Träger.lbea" "$folder/damaged ß.lbea"
damage "$folder/damaged ß.lbea"
check_same 1 "$folder/damaged ß.lbea"
truncate -s 1000 "$folder/damaged ß.lbea"
check_same 1 "$folder/damaged ß.lbea" --json
check_same 1 "$folder/fehlt ü.mcap" --json
for compression in none lz4 zstd; do
  recording="$folder/$compression ä.mcap"
  damage "$recording"
  check_same 1 "$recording" --json
  truncate -s -1000 "$recording"
  check_same 1 "$recording"
  "$linux" --recover "$recording" -o "$work/recovered" >/dev/null || fail "--recover failed"
  "${windows[@]}" --recover "$recording" -o "$work/gerettet ö" >/dev/null || fail "--recover failed on Windows"
  cmp "$work/recovered" "$work/gerettet ö" || fail "--recover writes another file on Windows"
  [ ! -e "$work/gerettet ö.partial" ] || fail "--recover leaves a partial file"
  rm "$work/recovered" "$work/gerettet ö"
done
check_same 2 "$model" --recover

# A reader that wants no more is not a failure.
"${windows[@]}" "$model" 2>"$work/err" | head -n 1 >"$work/out"
[ ! -s "$work/err" ] || fail "without a reader it prints:" "$(cat "$work/err")"
code=0
"${windows[@]::${#windows[@]}-1}" "$(dirname "${windows[-1]}")/not_utf16.exe" "${windows[-1]}" >"$work/out" 2>&1 || code=$?
[ "$code" -eq 1 ] && grep -q '^lbea-inspect: error: no-.*\.lbea: cannot open' "$work/out" ||
  fail "exit code $code after an argument that is not UTF-16:" "$(cat "$work/out")"

# A share of another machine, on which nothing may be written where the file system knows such files.
shares=${WINEPREFIX:-$project/build/wine}/dosdevices/unc/lbea-$$
trap 'chattr -i "$work/share" "$work/share"/* 2>/dev/null || true; rm -rf "$shares"; end' EXIT
mkdir -p "$work/share" "$shares"
cp "$model" "$work/share/Träger.lbea"
ln -s "$work/share" "$shares/models"
share="\\\\lbea-$$\\models"
chattr +i "$work/share/Träger.lbea" "$work/share" 2>/dev/null || echo "not read-only: $work has no immutable files"
"${windows[@]}" "$share\\Träger.lbea" --json >"$work/out" 2>&1 || fail "not read from a share:" "$(cat "$work/out")"
"${windows[@]}" "$share\\fehlt ü.lbea" >"$work/out" 2>&1 && fail "a missing file of a share is found"
grep -qF "$share\\fehlt ü.lbea: cannot open the model" "$work/out" || fail "it printed:" "$(cat "$work/out")"
echo "models and recordings, whole and damaged: the same on Windows"
