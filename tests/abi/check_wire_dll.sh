#!/usr/bin/env bash
# What lbea-wire.dll exports and needs: the functions that liblbea-wire.so shows, and the system's libraries.
#   check_wire_dll.sh LBEA_WIRE_DLL
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
def=$here/../../adapters/wire/c_api/lbea-wire.def
known=$(sed -n 's/^T //p' "$here/wire_symbols.txt")
diff -u <(sed -n '/^EXPORTS/,$s/^  //p' "$def") - <<<"$known" || { echo "lbea-wire.def lists other functions than wire_symbols.txt" >&2; exit 1; }
dump=$(x86_64-w64-mingw32-objdump -p "$1" 2>/dev/null)
exports=$(sed -n '/\[Ordinal\/Name Pointer\] Table/,/^$/s/^.*\] //p' <<<"$dump" | sed 's/^+base\[[^]]*\] *[0-9a-f]* //' | grep -v '^Table$' | LC_ALL=C sort)
diff -u - <(echo "$exports") <<<"$known" || { echo "the exports are not those of lbea-wire.def" >&2; exit 1; }
needed=$(sed -n 's/^.*DLL Name: //p' <<<"$dump" | sort -fu)
extra=$(grep -viE '^(kernel32|msvcrt|user32|advapi32|ntdll|ws2_32|iphlpapi)\.dll$' <<<"$needed" || true)
[ -z "$extra" ] || { echo "lbea-wire.dll needs $extra; only the system's libraries are allowed" >&2; exit 1; }
echo "lbea-wire.dll: $(wc -l <<<"$exports") exports, needs $(echo $needed)"
