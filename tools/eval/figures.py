#!/usr/bin/env python3
"""Draws the results of `lbea-eval ensemble`.

usage: figures.py EVALUATION_FOLDER [PARAMETER]
Writes methods.png (mean error per method beside the oracle), branches.png (error over time per deformation branch),
robustness.png when there are disturbed frames, worst.png (depth images of the frame, fit's sample and the oracle's in
the worst frame of the tests with the worst fit), and view.png (the simulations as curves in time in the joint
low-dimensional representation, colored by PARAMETER, by default the one most correlated with it; experiments in black on top).
"""
import csv
import sys
from collections import defaultdict
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

METHODS = ["oracle", "vtp", "lbea", "icp", "look_alike", "fit", "estimate", "tracked", "path"]
COLORS = dict(zip(METHODS, ["#000000", "#9a9a9a", "#1f77b4", "#8c564b", "#17becf", "#2ca02c", "#d62728", "#ff7f0e", "#bcbd22"]))


def number(text):
    return float(text) if text else float("nan")


def read(path):
    with open(path, newline="") as table:
        return list(csv.DictReader(table))


def mean_per_test(rows, method):
    """Mean over time, then over experiments."""
    tests = defaultdict(list)
    for row in rows:
        if row[method]:
            tests[row["experiment"]].append(float(row[method]))
    means = [np.mean(values) for values in tests.values()]
    return float(np.mean(means)) if means else float("nan")


def plain(rows, experiments):
    first = next((row["mode"] for row in rows), "")
    return [r for r in rows if r["experiments"] == experiments and r["frames_are"] == "as sensed" and r["mode"] == first]


def draw_methods(rows, file):
    chosen = plain(rows, "unseen")
    means = {m: mean_per_test(chosen, m) for m in METHODS}
    shown = [m for m in METHODS if not np.isnan(means[m])]
    figure, axes = plt.subplots(figsize=(7, 3.6))
    bars = axes.bar(shown, [means[m] for m in shown], color=[COLORS[m] for m in shown])
    axes.bar_label(bars, [f"{means[m]:.2f}\n({means[m] / means['oracle']:.2f})" for m in shown], fontsize=8)
    axes.axhline(means["oracle"], color="black", linewidth=0.8, linestyle=":")
    axes.set(ylabel="mean EE (ratio to the oracle)", title="unseen experiments", ylim=(0, 1.2 * max(means[m] for m in shown)))
    figure.tight_layout()
    figure.savefig(file, dpi=130)


def draw_branches(rows, file):
    chosen = plain(rows, "unseen")
    branches = sorted({int(r["branch"]) for r in chosen})
    figure, panels = plt.subplots(1, len(branches), figsize=(5 * len(branches), 3.8), sharey=True, squeeze=False)
    for axes, branch in zip(panels[0], branches):
        here = [r for r in chosen if int(r["branch"]) == branch]
        for method in METHODS:
            over_time = defaultdict(list)  # by step, because stored times differ in their last digits
            for row in here:
                if row[method]:
                    over_time[int(row["step"])].append((1e3 * float(row["time_s"]), float(row[method])))
            if over_time:
                axes.plot(*np.array([np.mean(over_time[step], axis=0) for step in sorted(over_time)]).T, label=method,
                          color=COLORS[method], linestyle="--" if method == "oracle" else "-")
        axes.set(xlabel="time [ms]", title=f"branch {branch}: {len({r['experiment'] for r in here})} experiments")
    panels[0][0].set_ylabel("mean EE")
    panels[0][-1].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(file, dpi=130)


def draw_robustness(rows, file):
    names = list(dict.fromkeys(r["frames_are"] for r in rows if r["experiments"] == "unseen"))
    if len(names) < 2:
        return
    methods = ["oracle", "lbea", "fit", "estimate", "tracked", "path"]
    figure, axes = plt.subplots(figsize=(9, 4))
    for i, method in enumerate(methods):
        heights = [mean_per_test([r for r in rows if r["experiments"] == "unseen" and r["frames_are"] == n
                                  and r["mode"] == rows[0]["mode"]], method) for n in names]
        axes.bar(np.arange(len(names)) + (i - 2) * 0.16, heights, 0.16, label=method, color=COLORS[method])
    axes.set_xticks(range(len(names)), names, rotation=15, ha="right", fontsize=8)
    axes.set_ylabel("mean EE")
    axes.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(file, dpi=130)


def draw_worst(tests, folder, file):
    if not tests:
        return
    figure, panels = plt.subplots(len(tests), 3, figsize=(11, 1.8 * len(tests)), squeeze=False, layout="constrained")
    for rank, (test, row) in enumerate(zip(tests, panels), 1):
        cells = read(folder / f"{rank}.csv")
        size = int(cells[-1]["row"]) + 1, int(cells[-1]["column"]) + 1
        images = {name: np.array([number(c[name]) for c in cells]).reshape(size) for name in ("frame", "fit", "oracle")}
        everything = np.array(list(images.values()))
        titles = {"frame": f"{rank}: {test['experiment']}, step {test['step']}"}
        titles.update((m, f"{m}: EE {number(test['step_' + m]):.1f}") for m in ("fit", "oracle"))
        for axes, (name, image) in zip(row, images.items()):
            shown = axes.imshow(image, vmin=np.nanmin(everything), vmax=np.nanmax(everything), cmap="viridis")
            axes.set_title(titles[name], fontsize=8)
            axes.set(xticks=[], yticks=[], facecolor="lightgray")
        figure.colorbar(shown, ax=row, label="depth")
    figure.savefig(file, dpi=130)


def most_correlated_parameter(simulations, names):
    """The parameter with the strongest correlation with the last coordinates."""
    last = {}
    for row in simulations:
        last[row["name"]] = row
    ends = np.array([[float(r[x]) for x in ("x1", "x2", "x3")] for r in last.values()])
    best, strongest = None, -1.0
    for name in names:
        values = np.array([number(r[name]) for r in last.values()])
        if np.isnan(values).any() or values.std() == 0 or len(values) < 3:
            continue
        strength = max(abs(np.corrcoef(values, ends[:, k])[0, 1]) for k in range(3) if ends[:, k].std() > 0)
        if strength > strongest:
            best, strongest = name, strength
    return best


def draw_view(rows, file, parameter):
    simulations = [r for r in rows if r["kind"] == "simulation"]
    experiments = [r for r in rows if r["kind"] == "experiment"]
    names = [n for n in rows[0] if n not in ("kind", "name", "branch", "step", "time_s", "x1", "x2", "x3")]
    parameter = parameter or most_correlated_parameter(simulations, names)
    values = [number(r[parameter]) if parameter else float(r["branch"]) for r in simulations]
    scale = plt.cm.ScalarMappable(plt.Normalize(np.nanmin(values), np.nanmax(values)), "viridis")
    figure = plt.figure(figsize=(9, 6.5))
    axes = figure.add_subplot(projection="3d")
    axes.view_init(elev=18, azim=-20)
    axes.tick_params(labelsize=7)
    for group, color in ((simulations, None), (experiments, "black")):
        curves = defaultdict(list)
        for row in group:
            curves[row["name"]].append(row)
        for curve in curves.values():
            points = np.array([[float(r[x]) for x in ("x1", "x2", "x3")] for r in curve]).T
            own = color or scale.to_rgba(number(curve[0][parameter]) if parameter else float(curve[0]["branch"]))
            axes.plot(*points, color=own, linewidth=1.0 if color else 0.7)
    for label, name in ((axes.set_xlabel, "1st"), (axes.set_ylabel, "2nd"), (axes.set_zlabel, "3rd")):
        label(name, labelpad=12)
    axes.set_box_aspect((1, 1, 1), zoom=0.9)
    axes.set(title="coefficients that vary most; experiments in black")
    figure.colorbar(scale, ax=axes, shrink=0.6, pad=0.12, label=parameter or "branch")
    figure.savefig(file, dpi=130)


def main(folder, parameter):
    frames, view = read(folder / "frames.csv"), read(folder / "view.csv")
    if not plain(frames, "unseen"):
        sys.exit(f"{folder}: frames.csv holds no undisturbed frames of unseen experiments to draw")
    draw_methods(frames, folder / "methods.png")
    draw_branches(frames, folder / "branches.png")
    draw_robustness(frames, folder / "robustness.png")
    if (folder / "worst.csv").exists():  # not in evaluations of lbea 0.1
        draw_worst(read(folder / "worst.csv"), folder / "worst", folder / "worst.png")
    draw_view(view, folder / "view.png", parameter)


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) == 3 else None)
