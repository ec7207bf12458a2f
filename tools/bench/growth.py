#!/usr/bin/env python3
"""Draws times by number of points and of samples, from the tables that `lbea-bench --growth FOLDER` writes.

usage: growth.py FOLDER PICTURE.png
"""
import csv
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

PANELS = [("points", "a frame, by number of points"), ("samples", "the search (eq. 3) alone, by number of samples")]


def read(path, size_name):
    """{pipeline: [(size, p50 in ms, p90 in ms), ...]}"""
    curves = {}
    for row in csv.DictReader(open(path)):
        curves.setdefault(row["pipeline"], []).append(
            (int(row[size_name]), float(row["p50_us"]) / 1e3, float(row["p90_us"]) / 1e3))
    return curves


def draw(axes, curves, size_name, title):
    for pipeline, rows in curves.items():
        sizes, p50, p90 = zip(*rows)
        line, = axes.loglog(sizes, p50, marker="o", markersize=3, label=pipeline)
        axes.fill_between(sizes, p50, p90, color=line.get_color(), alpha=0.2, linewidth=0)
    axes.set(title=title, xlabel=size_name, ylabel="ms (line: p50, shade: to p90)")
    axes.grid(True, which="major", alpha=0.4)
    axes.legend(frameon=False)


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder, picture = Path(sys.argv[1]), sys.argv[2]
    figure, panels = plt.subplots(1, len(PANELS), figsize=(11, 4.2), layout="constrained")
    for axes, (size_name, title) in zip(panels, PANELS):
        draw(axes, read(folder / f"growth_{size_name}.csv", size_name), size_name, title)
    figure.savefig(picture, dpi=120)


if __name__ == "__main__":
    main()
