#!/usr/bin/env bash
# Keys of lbea-keygen.exe serve on this machine; a secret one is for its user alone, and none is overwritten.
#   keygen.sh HOST_BUILD EMULATOR... PROGRAM
set -euo pipefail
host=$1 name=lbea-keygen
shift
windows=("$@")
. "$(dirname "$0")/support.sh"

make_key() { # path without extension, arguments
  "${windows[@]}" "$@" >"$work/printed" || fail "lbea-keygen.exe failed"
  printf '%s.key (secret) and %s.pub: %s\n' "$1" "$1" "$(cut -d ' ' -f 2 "$1.pub")" | cmp - "$work/printed" ||
    fail "it printed:" "$(cat "$work/printed")"
  [[ $(stat -c %a "$1.key") == *0 ]] || fail "others may read $1.key"
  chmod 600 "$1.key" # the emulator lets the group read it
}
make_key "$work/Prüfer ß" --name matcher
make_key "$work/camera"
for kind in key pub; do
  "$linux" "$work/expected_$kind" --name matcher >/dev/null
  for file in "$work/Prüfer ß" "$work/expected_$kind"; do sed 's/key .* matcher$/key KEY matcher/' "$file.$kind" >"$file.text"; done
  cmp "$work/expected_$kind.text" "$work/Prüfer ß.text" || fail "another form of .$kind files"
done
grep -q 'key .* camera$' "$work/camera.pub" || fail "the key is not named after its file"

cp "$work/camera.key" "$work/before"
check_same 1 "$work/camera"
cmp "$work/before" "$work/camera.key" || fail "a secret key was overwritten"
rm "$work/camera.key"
check_same 1 "$work/camera"
[ ! -e "$work/camera.key" ] || fail "half a pair remains"
check_same 1 "$work/no folder/a"
check_same 1 "$work/a" --name "two words"
check_same 2
cp "$work/before" "$work/camera.key"
chmod 600 "$work/camera.key"

serve --key "$work/Prüfer ß.key" --allow "$work/camera.pub"
"$host/tools/send/lbea-send" "$clouds" --to "$frames" --server-key "$work/Prüfer ß.pub" --key "$work/camera.key" >"$work/sent" 2>&1 ||
  fail "lbea-send:" "$(cat "$work/sent")"
stop_serving "$count"
echo "the keys of lbea-keygen.exe serve; none is overwritten"
