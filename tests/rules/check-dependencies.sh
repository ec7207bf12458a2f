#!/usr/bin/env bash
# One direction of dependency, and silent libraries: reads the sources, so that nobody has to remember.
#   runtime <- precompute <- adapters <- tools; an adapter may use the file helper, but no other adapter.
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

report "runtime includes only the standard library, POSIX, itself, xxHash and the compiler's vector types:" \
  "$(includes runtime | grep -vE '[<"](runtime/|lbea/|xxhash\.h|fcntl\.h|unistd\.h|sys/(mman|stat)\.h|immintrin\.h)|<[a-z_]+>|<std(def|int)\.h>')"
report "the public headers include only the standard library and each other:" \
  "$(includes runtime/include | grep -vE '<lbea/|<[a-z_]+>|<std(def|int)\.h>')"
report "precompute does not know adapters, tools or tests:" "$(includes precompute | grep -E '["<](adapters|tools|tests)/')"
report "adapters do not know tools or tests:" "$(includes adapters | grep -E '["<](tools|tests)/')"
report "runtime and precompute do not know the wire, the files and the programs' libraries:" \
  "$(includes runtime precompute | grep -E '[<"](zmq|flatbuffers|CLI|spdlog|toml|nlohmann)')"
for adapter in adapters/*/; do
  name=$(basename "$adapter")
  report "adapters/$name does not know other adapters:" \
    "$(includes "$adapter" | grep -oE '.*["<]adapters/[a-z_]+/.*' | grep -vE "adapters/($name|files)/[^:]*\"\$")"
done
for program in tools/*/; do
  name=$(basename "$program")
  report "tools/$name includes no other program, only tools/shared and itself:" \
    "$(includes "$program" | grep -E '["<]tools/' | grep -vE "[\"<]tools/($name|shared)/")"
done
# folder, its namespace; the public API and the runtime behind it are lbea itself.
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
report "programs start in tools only:" "$(sources '^int main\(' runtime precompute adapters)"
report "binaries run on any x86-64:" "$(grep -rnE 'march=native' --include='CMakeLists.txt' --include='*.cmake' --include='CMakePresets.json' .  | grep -v '^./build/')"

[ "$failures" -eq 0 ] && echo "dependencies and silence as they should be"
exit $((failures > 0))
