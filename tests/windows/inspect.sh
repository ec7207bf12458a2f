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
echo "models and recordings, whole and damaged: the same on Windows"
