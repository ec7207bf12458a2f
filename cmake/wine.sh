#!/bin/sh
# Runs a Windows program under Wine, silently and without a desktop, in a prefix of its own beside the builds.
here=$(cd "$(dirname "$0")" && pwd)
export WINEPREFIX="${WINEPREFIX:-$here/../build/wine}" WINEDEBUG=-all WINEDLLOVERRIDES='mscoree,mshtml=' DISPLAY=
# Without a running server, some of the programs that start at the same time fail.
mkdir -p "$WINEPREFIX"
flock --close "$WINEPREFIX/starting" /usr/lib/wine/wineserver64 -p3 2>/dev/null
exec /usr/lib/wine/wine64 "$@"
