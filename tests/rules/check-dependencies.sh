#!/usr/bin/env bash
# Checks the sources: one direction of dependency, one namespace per layer, no output from libraries.
#   runtime <- precompute <- adapters <- tools; an adapter may include adapters/files, but no other adapter.
set -uo pipefail
cd "$(dirname "$0")/../.."
failures=0

report() {  # rule, offending lines
  [ -z "$2" ] && return
  printf '%s\n%s\n\n' "$1" "$2"
  failures=$((failures + 1))
}

includes() { grep -rnE '^ *# *include *["<]' "$@" --include='*.hpp' --include='*.cpp' --include='*.h' --include='*.c'; }
sources() { grep -rnE "$1" "${@:2}" --include='*.hpp' --include='*.cpp' --include='*.h'; }

report "runtime includes only the standard library, POSIX, Windows, glibc's processor features, itself, xxHash and vector types:" \
  "$(includes runtime | grep -vE '[<"](runtime/|lbea/|xxhash\.h|fcntl\.h|unistd\.h|sys/(mman|stat|platform/x86)\.h|windows\.h|immintrin\.h)|<[a-z_]+>|<std(def|int)\.h>')"
report "the public headers include only the standard library and each other:" \
  "$(includes runtime/include | grep -vE '<lbea/|<[a-z_]+>|<std(def|int)\.h>')"
report "precompute includes no adapters, tools or tests:" "$(includes precompute | grep -E '["<](adapters|tools|tests)/')"
report "adapters include no tools or tests:" "$(includes adapters | grep -E '["<](tools|tests)/')"
report "runtime and precompute include no library for messages, files or programs:" \
  "$(includes runtime precompute | grep -E '[<"](zmq|flatbuffers|CLI|spdlog|toml|nlohmann)')"
for adapter in adapters/*/; do
  name=$(basename "$adapter")
  report "adapters/$name includes no other adapter than files:" \
    "$(includes "$adapter" | grep -oE '.*["<]adapters/[a-z_]+/.*' | grep -vE "adapters/($name|files)/[^:]*\"\$")"
done
for program in tools/*/; do
  name=$(basename "$program")
  report "tools/$name includes no other program, only tools/shared and itself:" \
    "$(includes "$program" | grep -E '["<]tools/' | grep -vE "[\"<]tools/($name|shared)/")"
done
# Folder and namespace. The public API and the runtime are in lbea.
while read -r folder namespace; do
  report "everything in $folder is in namespace $namespace:" \
    "$(grep -rnE '^namespace lbea' "$folder" --include='*.hpp' --include='*.cpp' | grep -vE "namespace $namespace(::[a-z0-9_]+)? \{")"
done <<'NAMESPACES'
precompute lbea::bake
adapters/wire lbea::wire
adapters/mcap lbea::mcap
adapters/http lbea::http
adapters/files lbea::io
adapters/simulation lbea::io
adapters/clouds lbea::io
adapters/ensemble lbea::io
adapters/rig lbea::io
adapters/export lbea::io
tools lbea::tool
NAMESPACES
report "libraries are silent: no printing, logging, abort, exit or environment outside tools and tests:" \
  "$(sources '\b(printf|fprintf|puts|abort|exit|_exit|getenv|setenv)\(|std::(cout|cerr|clog)|spdlog::' runtime precompute adapters |
     grep -vE 'snprintf|^[^:]*:[0-9]+: *//')"
report "main() is in tools only:" "$(sources '^int main\(' runtime precompute adapters)"
report "binaries run on any x86-64:" "$(grep -rnE 'march=native' --include='CMakeLists.txt' --include='*.cmake' --include='CMakePresets.json' .  | grep -v '^./build/')"

[ "$failures" -eq 0 ] && echo "dependencies, namespaces and output: no violation"
exit $((failures > 0))
