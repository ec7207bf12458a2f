#!/usr/bin/env bash
# What a shared library, liblbea.so or liblbea-wire.so, shows, needs and weighs.
#   check.sh LIBRARY            compare with symbols.txt or wire_symbols.txt
#   check.sh LIBRARY --update   write that file anew; a lost or changed line asks for a higher SOVERSION
set -euo pipefail
library=$1
case "$(basename "$library")" in # bytes: stripped. A library that grows more has gained code by accident.
  liblbea-wire.so*) name=liblbea-wire known=wire_symbols.txt more_needs='|libsodium\.so\.23' most_bytes=1000000 ;;
  *) name=liblbea known=symbols.txt more_needs='' most_bytes=500000 ;; # 478352 when this was written
esac
known=$(dirname "$0")/$known

# Weak functions are inline ones, which differ with the level of optimisation.
shown() { "${NM:-nm}" -DC --defined-only --without-symbol-versions "$library" | grep -vE '^[0-9a-f]+ [AW] ' | cut -d' ' -f2- | LC_ALL=C sort -u; }

if [ "${2:-}" = --update ]; then shown >"$known"; exit; fi
shown | diff -u "$known" - || { echo "the library's symbols changed; if that is meant: $0 $library --update" >&2; exit 1; }

needed=$(readelf -d "$library" | sed -n 's/.*(NEEDED).*\[\(.*\)\]/\1/p')
extra=$(grep -vE '^(libstdc\+\+\.so\.6|libgcc_s\.so\.1|libm\.so\.6|libc\.so\.6|ld-linux-.*'"$more_needs"')$' <<<"$needed" || true)
[ -z "$extra" ] || { echo "the library needs $extra, which is not allowed" >&2; exit 1; }
readelf -d "$library" | grep -q "SONAME.*\[$name\.so\.0\]" || { echo "soname is not $name.so.0" >&2; exit 1; }

stripped=$(mktemp)
trap 'rm -f "$stripped"' EXIT
"${STRIP:-strip}" --strip-unneeded -o "$stripped" "$library"
bytes=$(stat -c %s "$stripped")
[ "$bytes" -le "$most_bytes" ] || { echo "the library has $bytes bytes, more than $most_bytes" >&2; exit 1; }
echo "$name.so: $(wc -l <"$known") symbols, $bytes bytes, needs $(echo $needed)"
