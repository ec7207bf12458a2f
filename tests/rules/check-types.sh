#!/usr/bin/env bash
# Checks that no qualified type name is defined in two files: two different definitions are undefined behavior, which the
# linker does not report. Of http/server.cpp and http/no_server.cpp a build contains only one, as of NAME.cpp and
# NAME_windows.cpp.
set -euo pipefail
cd "$(dirname "$0")/../.."
definitions=$(find runtime precompute adapters tools \( -name '*.cpp' -o -name '*.hpp' \) -not -path '*/node_modules/*' -not -name no_server.cpp -not -name '*_windows.cpp' |
  ctags -L - -f - --languages=C++ --map-C++=+.hpp --kinds-C++=cgsu --fields=s --fields-C++= --excmd=number)
# Types in unnamed namespaces, which ctags calls __anon..., are local to their file.
named=$(printf '%s\n' "$definitions" | grep -v '__anon' | awk -F'\t' '{
  scope = ""
  for (i = 4; i <= NF; ++i) if ($i ~ /^(namespace|class|struct):/) { scope = $i; sub(/^[a-z]*:/, "", scope) }
  if (scope ~ /^lbea/) print scope "::" $1 "\t" $2
}')
[ "$(printf '%s\n' "$named" | wc -l)" -gt 200 ] || { echo "ctags found too few types"; exit 1; }
twice=$(printf '%s\n' "$named" | sort -u | cut -f 1 | sort | uniq -d)
[ -z "$twice" ] || { echo "defined in more than one file:"; printf '%s\n' "$named" | sort -u | grep -wF "$twice"; exit 1; }
echo "$(printf '%s\n' "$named" | wc -l) types, each defined once"
