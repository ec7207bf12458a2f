#!/usr/bin/env bash
# Branch coverage of everything that reads what others wrote: builds with gcov, runs the parsers' tests and the fuzz
# corpora with their seeded mutations, prints a line per file, and fails when all of them together are below 95 %.
#   bash tests/coverage.sh                 minutes; needs gcovr
#   BUILD=dir bash tests/coverage.sh       where it is built
#   LIST=1 bash tests/coverage.sh          also the lines whose branches were not all taken
# Not counted: branches that the compiler adds for exceptions that pass through (--exclude-throw-branches) and those it
# proves impossible (--exclude-unreachable-branches): neither stands in the source.
set -euo pipefail
cd "$(dirname "$0")/.."

build=${BUILD:-build/coverage}
tests=(model wire_codec wire_ring wire_access wire_sockets mcap d3plot simulation_formats ply xyz cloud_formats ensemble tables
       sensor_json monitor_parts monitor_server)
fuzzers=(frame result control model mcap d3plot mesh_files ply xyz cloud tables description http)
parsers=(
  runtime/src/'(section_reader|model_view|read_views|mapped_file)'
  adapters/wire/'(frame_codec|result_codec|control_codec|inference_codec|verified|keys|endpoint)'
  adapters/recording/'(byte_cursor|byte_source|mcap_parse|record_walk|salvage|compression|audit|audit_summary|recovery)'
  adapters/simulation/'(d3plot_|vtk_|grid|keyword_mesh|obj_mesh|ply_mesh|stl_mesh|formats|open|series)'
  adapters/pointcloud/'(pcd|ply|ply_ascii|ply_binary|ply_rows|pointcloud|stamps|stl_cloud|xyz)'
  adapters/file/'(ply_header|stl_corners|text_line)'
  adapters/'(ensemble|sensor)'/
  tools/monitor/'(access|http_address|foxglove|web_session)'
)

cmake --preset coverage -B "$build" >/dev/null
cmake --build "$build" --target "${tests[@]/#/test_}" "${fuzzers[@]/#/fuzz_}" >/dev/null
find "$build" -name '*.gcda' -delete
names=$(IFS='|'; echo "${tests[*]}|${fuzzers[*]/#/fuzz_}")
ctest --test-dir "$build" --parallel 2 --output-on-failure -R "^($names)\$" >"$build/coverage.log" || { cat "$build/coverage.log"; exit 1; }

filters=()
for parser in "${parsers[@]}"; do filters+=(--filter "$PWD/$parser[^/]*$"); done
gcovr --root . --object-directory "$build" "${filters[@]}" --exclude-throw-branches --exclude-unreachable-branches --json "$build/coverage.json" "$build"
python3 - "$build/coverage.json" "${LIST:-}" <<'PYTHON'
import json, sys

least = 95.0
files = json.load(open(sys.argv[1]))["files"]
all_taken = all_there = 0
for file in sorted(files, key=lambda f: f["file"]):
    branches = [b for line in file["lines"] for b in line["branches"]]
    taken = sum(b["count"] > 0 for b in branches)
    all_taken, all_there = all_taken + taken, all_there + len(branches)
    if branches: print(f"{100 * taken / len(branches):6.1f} %  {taken:4} of {len(branches):4}  {file['file']}")
    for line in file["lines"] if sys.argv[2] else []:
        missed = sum(b["count"] == 0 for b in line["branches"])
        if missed: print(f"          line {line['line_number']}: {missed} of {len(line['branches'])} not taken")
share = 100 * all_taken / max(all_there, 1)
print(f"{share:6.1f} %  {all_taken} of {all_there} branches of the parsers")
sys.exit(share < least)
PYTHON
