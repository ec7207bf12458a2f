#!/usr/bin/env bash
# What lbea.dll exports and needs.
#   check_dll.sh LBEA_DLL LIBLBEA_A [--update]   compares with runtime/lbea.def, or writes it anew
# It exports what liblbea.so shows (symbols.txt), in the spelling of this compiler.
set -euo pipefail
dll=$1 archive=$2
here=$(cd "$(dirname "$0")" && pwd)
def=$here/../../runtime/lbea.def
target=x86_64-w64-mingw32

# Here size_t is unsigned long long, and int64_t long long.
known=$(sed -n 's/^T //p' "$here/symbols.txt" | sed -E 's/[0-9]ul\>/&l/g; s/\<long\>/long long/g')
names() {  # the mangled names of known functions
  $target-nm --defined-only "$archive" 2>/dev/null | sed -n 's/^[0-9a-f]* T //p' | sort -u | while read -r name; do
    printf '%s\t%s\n' "$name" "$(c++filt "$name")"
  done | awk -F'\t' 'NR == FNR { known[$0]; next } $2 in known { print $1 }' <(printf '%s\n' "$known") - | LC_ALL=C sort
}
written() {
  printf '; What lbea.dll exports. An import library for other compilers: lib /def:lbea.def /machine:x64\nLIBRARY lbea.dll\nEXPORTS\n'
  names | sed 's/^/  /'
}
if [ "${3:-}" = --update ]; then written >"$def"; exit; fi
written | diff -u "$def" - || { echo "lbea.def is not what the library shows; if that is meant: $0 $dll $archive --update" >&2; exit 1; }

dump=$($target-objdump -p "$dll" 2>/dev/null)
exports=$(sed -n '/\[Ordinal\/Name Pointer\] Table/,/^$/s/^.*\] //p' <<<"$dump" | sed 's/^+base\[[^]]*\] *[0-9a-f]* //' | grep -v '^Table$' | LC_ALL=C sort)
diff -u <(sed -n '/^EXPORTS/,$s/^  //p' "$def") - <<<"$exports" || { echo "the exports are not those of lbea.def" >&2; exit 1; }
missing=$(comm -23 <(sort -u <<<"$known") <(c++filt <<<"$exports" | sort -u))
[ -z "$missing" ] || { printf 'not exported: %s\n' "$missing" >&2; exit 1; }

# Moves of more than 16 bytes must not rely on the alignment of the stack, which is 16 bytes (GCC bug 54412).
aligned=$($target-objdump -d "$dll" | grep -E 'vmov(ap[sd]|dqa[0-9]*) .*\(.*%[yz]mm|vmov(ap[sd]|dqa[0-9]*) .*%[yz]mm.*\(' || true)
[ -z "$aligned" ] || { printf 'these moves of wide vectors are aligned:\n%s\n' "$aligned" | head >&2; exit 1; }

needed=$(sed -n 's/^.*DLL Name: //p' <<<"$dump" | sort -fu)
extra=$(grep -viE '^(kernel32|msvcrt|user32|advapi32|ntdll)\.dll$' <<<"$needed" || true)
[ -z "$extra" ] || { echo "lbea.dll needs $extra; only the system's libraries are allowed" >&2; exit 1; }
echo "lbea.dll: $(wc -l <<<"$exports") exports, needs $(echo $needed)"
