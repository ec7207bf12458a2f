#!/bin/sh
# Runs a Windows program under Wine, silently and without a desktop, in a prefix of its own beside the builds.
here=$(cd "$(dirname "$0")" && pwd)
export WINEPREFIX="${WINEPREFIX:-$here/../build/wine}" WINEDEBUG=-all WINEDLLOVERRIDES='mscoree,mshtml=' DISPLAY=
exec /usr/lib/wine/wine64 "$@"
