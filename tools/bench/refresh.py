#!/usr/bin/env python3
"""Repeats the measurements and writes the tables into BENCHMARK.md, between their marks, and the plots into docs/growth.png.

usage: refresh.py BUILD_FOLDER MODEL CLOUDS SENSOR.json [TABLE ...]
Tables: alone, baselines, thinned, vtp, fit, fit-thinned, fit-tracked, fit-growth, kernels, growth; without names, all of
them. The machine should be idle otherwise.
"""
import csv
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[2]
PAGE = PROJECT / "BENCHMARK.md"
BASELINES = ["--baseline", "nanoflann,portable"]
FIT = ["--method", "fit", "--baseline", "lbea,nanoflann"]
THINNED_POINTS = "16000"


def output_of(*command):
    return subprocess.run([str(part) for part in command], check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def kernels_table(program):
    runs = json.loads(output_of(program, "--benchmark_format=json"))["benchmarks"]
    sets = list(dict.fromkeys(run["name"].split("/")[1] for run in runs))
    times = {}
    for run in runs:
        stage, kernels, *size = run["name"].split("/")
        times.setdefault(" ".join([stage.replace("_", " "), *size]), {})[kernels] = run["cpu_time"]
    lines = ["| us | " + " | ".join(name.removeprefix("kernels_") for name in sets) + " |", "|---" + "|--:" * len(sets) + "|"]
    for stage, row in times.items():
        lines.append(f"| {stage} | " + " | ".join(f"{row[name]:.1f}" for name in sets) + " |")
    return "\n".join(lines)


def growth_table(bench):
    with tempfile.TemporaryDirectory() as folder:
        output_of(*bench, *BASELINES, "--growth", folder)
        output_of("/usr/bin/python3", PROJECT / "tools/bench/growth.py", folder, PROJECT / "docs/growth.png")
        return "\n\n".join(growth_part(size, Path(folder) / f"growth_{size}.csv") for size in ("points", "samples"))


def fit_growth_table(bench):
    with tempfile.TemporaryDirectory() as folder:
        output_of(*bench, *FIT, "--growth", folder)
        sizes = ("points", "samples", "cells", "candidates")
        return "\n\n".join(growth_part(size, Path(folder) / f"growth_{size}.csv") for size in sizes)


def growth_part(size, file):
    rows = list(csv.DictReader(open(file)))
    names = list(dict.fromkeys(row["pipeline"] for row in rows))
    lines = [f"| {size} | " + " | ".join(f"{name}, ms" for name in names) + " |", "|--:" + "|--:" * len(names) + "|"]
    for count in dict.fromkeys(row[size] for row in rows):
        p50 = {row["pipeline"]: float(row["p50_us"]) / 1e3 for row in rows if row[size] == count}
        lines.append(f"| {int(count):,} | " + " | ".join(f"{p50[name]:.3g}" for name in names) + " |")
    return "\n".join(lines)


def put(name, table):
    page, found = re.subn(rf"(<!-- {name} -->\n).*?(<!-- end -->)", lambda m: f"{m[1]}{table}\n{m[2]}", PAGE.read_text(), flags=re.S)
    if found != 1:
        sys.exit(f"{PAGE}: no marks for the table '{name}'")
    PAGE.write_text(page)
    print(f"{name}: done", flush=True)


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    build, model, clouds, pose = sys.argv[1:5]
    folder = Path(build) / "tools/bench"
    bench = [folder / "lbea-bench", model, clouds, "--pose", pose]
    tables = {
        "alone": lambda: output_of(*bench, "--markdown"),
        "baselines": lambda: output_of(*bench, *BASELINES, "--markdown"),
        "thinned": lambda: output_of(*bench, *BASELINES, "--points", THINNED_POINTS, "--markdown"),
        "vtp": lambda: output_of(*bench, "--method", "vtp", "--frames", "300", "--markdown"),
        "fit": lambda: output_of(*bench, *FIT, "--markdown"),
        "fit-thinned": lambda: output_of(*bench, *FIT, "--points", THINNED_POINTS, "--markdown"),
        "fit-tracked": lambda: output_of(*bench, "--method", "fit", "--track", "--infer", "plastic_strain", "--markdown"),
        "fit-growth": lambda: fit_growth_table(bench),
        "kernels": lambda: kernels_table(folder / "lbea-kernels-benchmark"),
        "growth": lambda: growth_table(bench),
    }
    for name in sys.argv[5:] or tables:
        put(name, tables[name]())


if __name__ == "__main__":
    main()
