#!/usr/bin/env bash
# Every C and C++ file is as clang-format writes it: clang-format -i FILE mends one that is not.
set -euo pipefail
cd "$(dirname "$0")/../.."
mapfile -t files < <(find runtime precompute adapters tools tests docs \( -name '*.cpp' -o -name '*.hpp' -o -name '*.h' -o -name '*.c' \) -not -path '*/node_modules/*')
clang-format --dry-run --Werror "${files[@]}"
echo "${#files[@]} files are formatted"
