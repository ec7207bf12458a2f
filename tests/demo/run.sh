#!/usr/bin/env bash
# Runs the demo on an existing build and checks its results.
#   run.sh BUILD_DIR OUT_DIR
set -euo pipefail
build=$1 out=$2
project=$(cd "$(dirname "$0")/../.." && pwd)
bash "$project/tools/demo.sh" --build "$build" --out "$out"
/usr/bin/python3 - "$out" <<'EOF'
import csv, sys
from pathlib import Path
import numpy
from PIL import Image

out = Path(sys.argv[1])
rows = list(csv.DictReader(open(out / "evaluation/results.csv")))
truth = list(csv.DictReader(open(out / "frames/truth.csv")))
assert len(truth) == 21 and [r["stamp_ns"] for r in rows] == [t["stamp_ns"] for t in truth], "every frame, in order"
assert all(r["status"] == "ok" for r in rows), "every frame matched"
assert all(r["simulation"] != "run_043" for r in rows), "the experiment is not in the ensemble"
assert all(float(r["EE"]) >= float(r["oracle_EE"]) for r in rows), "no match is better than the oracle"
ratio = sum(float(r["EE"]) for r in rows) / sum(float(r["oracle_EE"]) for r in rows)
assert ratio < 1.5, f"mean EE is {ratio:.2f} times the oracle's; fit reaches about 1.1 to 1.3, the preprint's methods about 2"
mean = lambda column: sum(float(r[column]) for r in rows) / len(rows)
assert mean("estimate_EE") < mean("EE"), "the estimate is better than the best sample"
assert mean("path_EE") <= 1.01 * mean("EE"), "other frames do not make the choice worse"
assert all(float(r["path_EE"]) >= float(r["oracle_EE"]) - 1e-6 for r in rows), "the path is not better than the oracle"
assert len(list((out / "evaluation").glob("matched_*.vtu"))) == 21 and (out / "evaluation/matched.pvd").exists()
tally = (out / "serve.out").read_text()
assert "captured 21 = matched 21 " in tally, tally
pixels = numpy.asarray(Image.open(out / "demo.png").convert("RGB"))
colors = len({tuple(p) for p in pixels[::3, ::3].reshape(-1, 3) // 8})
assert pixels.shape[0] > 500 and colors > 100, f"the picture shows {colors} colors"
report = (out / "report.html").read_text()
assert "21 of 21" in report and 'aria-label="Forecast"' in report, "the report is about the whole test, and its end"
print(f"demo: 21 frames, EE {ratio:.2f} times the oracle's")
EOF
