#!/usr/bin/env bash
# man_page.sh HELP2MAN PROGRAM PAGE: the page's one-line description is the first sentence of the program's --help.
set -euo pipefail
help2man=$1 program=$2 page=$3
mkdir -p "$(dirname "$page")"
sentence=$("$program" --help | head -n 1 | sed 's/\([.:]\) .*/\1/; s/[.:]$//')
"$help2man" --no-info --section 1 --name "${sentence,}" --source lbea --manual "lbea" "$program" | gzip -9n >"$page.part"
mv "$page.part" "$page"
