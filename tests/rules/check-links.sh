#!/usr/bin/env bash
# Pages point at files that exist: every relative link in every Markdown file of the project.
set -uo pipefail
cd "$(dirname "$0")/../.."
dead=0 links=0
while IFS= read -r page; do
  while IFS= read -r link; do
    links=$((links + 1))
    [ -e "$(dirname "$page")/${link%%#*}" ] || { echo "$page: nothing at $link"; dead=$((dead + 1)); }
  done < <(grep -oE '\]\([^) ]+\)' "$page" | sed 's/^](//; s/)$//' | grep -vE '^(https?:|#)')
done < <(find . \( -name build -o -name node_modules -o -name .git \) -prune -o -name '*.md' -print)
echo "$links links, $dead of them dead"
[ "$links" -gt 0 ] && [ "$dead" -eq 0 ]
