#!/usr/bin/env bash
# Branch coverage of everything that reads what others wrote: builds with clang's counters, runs the parsers' tests and the fuzz
# corpora with their seeded mutations, prints a line per file, and fails when all of them together are below 95 %.
#   bash tests/coverage.sh                 minutes
#   BUILD=dir bash tests/coverage.sh       where it is built
#   LIST=1 bash tests/coverage.sh          also the conditions that were never true or never false
# A branch is one outcome of one condition as it stands in the source. What the compiler adds for exceptions that pass through
# is none: gcov counts it, and most of what it then finds missing is the clean-up after a sentence that was not put together.
set -euo pipefail
cd "$(dirname "$0")/.."

build=${BUILD:-build/coverage}
tests=(model wire_codec wire_ring wire_access wire_sockets mcap d3plot simulation_formats ply xyz cloud_formats ensemble tables
       sensor_json monitor_parts monitor_server)
fuzzers=(frame result control model mcap d3plot mesh_files ply xyz cloud tables description http)
parsers=(
  runtime/src/'(model/section_reader|model/model_view|model/mapped_file|depth/depth_images)'
  adapters/wire/'(codec/(result_codec|codec|flatbuffer)|access/keys|sockets/endpoint)'
  adapters/mcap/'(bytes|records|reader|salvage|compression|file_check|recovery)'
  adapters/simulation/'(|d3plot/|grid/|keyword/|mesh/|vtk/)'  # not vtkhdf/: its child process ends by a signal, uncounted
  adapters/clouds/
  adapters/files/'(binary_numbers|ply_header|stl_corners|text_line)'
  adapters/'(ensemble|rig)'/
  tools/monitor/'(access|http_address|foxglove|web_session)'
)
profdata=$(command -v llvm-profdata || ls /usr/lib/llvm-*/bin/llvm-profdata | tail -1)
cov=$(command -v llvm-cov || ls /usr/lib/llvm-*/bin/llvm-cov | tail -1)

if [ -z "${PROFILES:-}" ]; then
  launcher=()
  if command -v ccache >/dev/null; then launcher=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache); fi
  cmake --preset coverage -B "$build" "${launcher[@]}" >/dev/null
  cmake --build "$build" --target "${tests[@]/#/test_}" "${fuzzers[@]/#/fuzz_}" >/dev/null
  PROFILES=$(realpath "$build")/profiles
  rm -rf "$PROFILES"
  names=$(IFS='|'; echo "${tests[*]}|${fuzzers[*]/#/fuzz_}")
  LLVM_PROFILE_FILE=$PROFILES/%p.profraw ctest --test-dir "$build" --parallel 2 --output-on-failure -R "^($names)\$" >"$build/coverage.log" ||
    { cat "$build/coverage.log"; exit 1; }
fi

"$profdata" merge -sparse "$PROFILES"/*.profraw -o "$build/coverage.profdata"
objects=()
for name in "${tests[@]/#/test_}" "${fuzzers[@]/#/fuzz_}"; do
  program=$(find "$build/tests" -name "$name" -type f -executable)
  if [ -n "$program" ]; then objects+=(-object "$program"); fi
done
"$cov" export "${objects[@]}" -instr-profile "$build/coverage.profdata" >"$build/coverage.json" 2>/dev/null
python3 - "$build/coverage.json" "$PWD" "$(IFS='|'; echo "${parsers[*]}")" "${LIST:-}" <<'PYTHON'
import collections, json, os, re, sys

least = 95.0
files, root, parsers, listed = json.load(open(sys.argv[1]))["data"][0]["files"], sys.argv[2], re.compile(f"({sys.argv[3]})[^/]*$"), sys.argv[4]
all_taken = all_there = 0
for file in sorted(files, key=lambda f: f["filename"]):
    name = os.path.relpath(os.path.realpath(file["filename"]), root)
    if not parsers.match(name): continue
    source = open(file["filename"]).read().splitlines()
    counts = collections.defaultdict(lambda: [0, 0])  # by place: the same template or inline function counts once
    for line, column, end_line, end_column, true, false, *_ in file["branches"]:
        if re.search(r"if constexpr|while \(true\)", source[line - 1]): continue  # decided when it is compiled
        counts[line, column, end_line, end_column][0] += true
        counts[line, column, end_line, end_column][1] += false
    there, taken = 2 * len(counts), sum((t > 0) + (f > 0) for t, f in counts.values())
    all_taken, all_there = all_taken + taken, all_there + there
    if there: print(f"{100 * taken / there:6.1f} %  {taken:4} of {there:4}  {name}")
    for (line, column, end_line, end_column), (t, f) in sorted(counts.items()) if listed else []:
        if t and f: continue
        condition = source[line - 1][column - 1:end_column - 1 if end_line == line else None]
        print(f"            {line}: never {'reached' if not t and not f else 'true' if not t else 'false'}: {condition}")
share = 100 * all_taken / max(all_there, 1)
print(f"{share:6.1f} %  {all_taken} of {all_there} branches of the parsers")
sys.exit(share < least)
PYTHON
