#!/usr/bin/env bash
# Checks that every relative link in the Markdown files of the project points to an existing file.
set -uo pipefail
cd "$(dirname "$0")/../.."
dead=0 links=0
while IFS= read -r page; do
  while IFS= read -r link; do
    links=$((links + 1))
    [ -e "$(dirname "$page")/${link%%#*}" ] || { echo "$page: no file $link"; dead=$((dead + 1)); }
  done < <(grep -oE '\]\([^) ]+\)' "$page" | sed 's/^](//; s/)$//' | grep -vE '^(https?:|#)')
done < <(find . \( -name build -o -name node_modules -o -name .git \) -prune -o -name '*.md' -print)
echo "$links links, $dead of them dead"
[ "$links" -gt 0 ] && [ "$dead" -eq 0 ]
