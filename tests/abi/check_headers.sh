#!/usr/bin/env bash
# The C headers compile in every language that they are promised for, and need no compiler's extension on Windows.
#   check_headers.sh CC CXX
set -euo pipefail
cc=$1 cxx=$2
project=$(cd "$(dirname "$0")/../.." && pwd)
include=$project/runtime/include wire=$project/adapters/wire/include
warnings=(-pedantic -Wall -Wextra -Werror -fsyntax-only -I "$include" -I "$wire")
for header in lbea wire; do
  for language in c99 c11 c17; do
    "$cc" -std=$language -x c "${warnings[@]}" - <<<"#include <lbea/$header.h>"
  done
  for language in c++11 c++20; do
    "$cxx" -std=$language -x c++ "${warnings[@]}" - <<<"#include <lbea/$header.h>"
  done
done
# Without C library and GCC's extensions, for MSVC's ABI.
if command -v clang++ >/dev/null; then
  for header in lbea wire; do
    clang --target=x86_64-pc-windows-msvc -ffreestanding -std=c99 -x c "${warnings[@]}" - <<<"#include <lbea/$header.h>"
    clang++ --target=x86_64-pc-windows-msvc -ffreestanding -std=c++14 -x c++ "${warnings[@]}" - <<<"#include <lbea/$header.h>"
  done
fi
# Without GCC's attributes, as MSVC reads it.
marks=$("$cc" -D_WIN32 -E -P -I "$include" -x c - <<<$'#include <lbea/api.h>\nLBEA_API LBEA_HIDDEN end' | tr -d ' \n')
[ "$marks" = end ] || { echo "on Windows, LBEA_API is '$marks'" >&2; exit 1; }
others=$(grep -nE '__(attribute__|declspec|extension__|builtin_)|#include <[^ls]' "$include/lbea/lbea.h" "$include/lbea/version.hpp" "$wire/lbea/wire.h" || true)
[ -z "$others" ] || { printf 'not standard C:\n%s\n' "$others" >&2; exit 1; }
echo "lbea.h, wire.h: C99, C11, C17, C++11 and C++20 by $("$cc" -dumpmachine)"
