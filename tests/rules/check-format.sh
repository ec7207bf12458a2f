#!/usr/bin/env bash
# Checks that every C and C++ file is formatted; clang-format -i FILE formats one.
set -euo pipefail
cd "$(dirname "$0")/../.."
mapfile -t files < <(find runtime precompute adapters tools tests docs \( -name '*.cpp' -o -name '*.hpp' -o -name '*.h' -o -name '*.c' \) -not -path '*/node_modules/*')
clang-format --dry-run --Werror "${files[@]}"
echo "${#files[@]} files are formatted"
