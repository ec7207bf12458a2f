#!/usr/bin/env bash
# Brings the independent readers to FOLDER, once. Exit code 77 where there is no node or no network: a skipped test.
#   bash install.sh SOURCE FOLDER
set -euo pipefail
source=$1 folder=$2
command -v npm >/dev/null && command -v node >/dev/null || { echo "no node or npm"; exit 77; }
mkdir -p "$folder"
cp "$source/check.mjs" "$folder/"
if cmp -s "$source/package-lock.json" "$folder/package-lock.json" && [ -e "$folder/complete" ]; then exit 0; fi
cp "$source/package.json" "$source/package-lock.json" "$folder/"
rm -f "$folder/complete"
(cd "$folder" && npm ci --ignore-scripts --no-audit --no-fund) || { rm -rf "$folder/node_modules"; echo "npm ci failed: no network?"; exit 77; }
touch "$folder/complete"
