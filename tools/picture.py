#!/usr/bin/env python3
"""Draws the cloud of the rig above the matched mesh, which is colored by plastic strain.

usage: picture.py EVALUATION_FOLDER PICTURE.png
The folder is the output of `lbea-eval live --out`: results.csv, matched_<frame>.vtu, frame_<frame>.ply.
"""
import csv
import re
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

COLUMNS = 3
FIELD = "plastic_strain"
VIEW = dict(elev=32, azim=62)
MOST_POINTS = 6_000


def read_vtu(path):
    """Arrays by name from a VTU with raw appended data, each block preceded by its length (u64)."""
    raw = path.read_bytes()
    mark = raw.index(b'<AppendedData encoding="raw">')
    begin = raw.index(b"_", mark) + 1
    types = {"Float32": "<f4", "UInt32": "<u4", "Int64": "<i8", "UInt8": "u1"}
    arrays = {}
    for kind, name, components, offset in re.findall(
            r'type="(\w+)" Name="([^"]*)" NumberOfComponents="(\d+)" format="appended" offset="(\d+)"',
            raw[:mark].decode()):
        at = begin + int(offset)
        length = int.from_bytes(raw[at:at + 8], "little")
        values = np.frombuffer(raw, types[kind], length // np.dtype(types[kind]).itemsize, at + 8)
        arrays[name] = values.reshape(-1, int(components)) if int(components) > 1 else values
    return arrays


def read_ply(path):
    raw = path.read_bytes()
    mark = b"end_header\n"
    return np.frombuffer(raw, "<f4", offset=raw.index(mark) + len(mark)).reshape(-1, 3)


def polygons(mesh):
    corners = mesh["Points"][mesh["connectivity"]]
    return np.split(corners, mesh["offsets"][:-1])


def prepare(axes, low, high):
    axes.view_init(**VIEW)
    axes.set_box_aspect(high - low, zoom=1.3)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_axis_off()


def main(folder, picture):
    with open(folder / "results.csv", newline="") as table:
        rows = [row for row in csv.DictReader(table) if row["simulation"]]
    if not rows:
        sys.exit(f"{folder}: no matched frame to draw")
    chosen = [rows[i] for i in np.linspace(0, len(rows) - 1, min(COLUMNS, len(rows))).round().astype(int)]
    meshes = [read_vtu(folder / f"matched_{int(row['frame']):05d}.vtu") for row in chosen]
    low = np.min([m["Points"].min(0) for m in meshes], axis=0)
    high = np.max([m["Points"].max(0) for m in meshes], axis=0)
    # A percentile, because a few elements in sharp folds have far larger values than all others.
    most = max((float(np.percentile(m[FIELD], 99.5)) for m in meshes if FIELD in m), default=1.0)
    scale = plt.cm.ScalarMappable(plt.Normalize(0, most or 1.0), "viridis")

    figure = plt.figure(figsize=(5 * len(chosen), 6), facecolor="white")
    for column, (row, mesh) in enumerate(zip(chosen, meshes)):
        upper = figure.add_subplot(2, len(chosen), column + 1, projection="3d")
        cloud_file = folder / f"frame_{int(row['frame']):05d}.ply"
        if cloud_file.exists():
            cloud = read_ply(cloud_file)
            cloud = cloud[:: max(1, len(cloud) // MOST_POINTS)]
            cloud = cloud[((cloud > low - 20) & (cloud < high + 20)).all(1)]
            upper.scatter(*cloud.T, s=0.8, c="#24507a", linewidths=0, clip_on=False)
        upper.set_title(f"frame {row['frame']}: cloud of the rig", y=0.95)
        prepare(upper, low, high)
        lower = figure.add_subplot(2, len(chosen), len(chosen) + column + 1, projection="3d")
        colors = scale.to_rgba(mesh[FIELD]) if FIELD in mesh else None
        lower.add_collection3d(Poly3DCollection(polygons(mesh), facecolors=colors, edgecolors=(1, 1, 1, 0.25), linewidths=0.15, clip_on=False))
        error = f" (EE {float(row['EE']):.1f} mm)" if row["EE"] else ""
        lower.set_title(f"{row['simulation']}, step {row['time_step']}{error}", y=0.95)
        prepare(lower, low, high)
    figure.subplots_adjust(left=0, right=0.93, bottom=0, top=0.98, wspace=0, hspace=0)
    bar = figure.colorbar(scale, cax=figure.add_axes((0.945, 0.08, 0.012, 0.36)))
    bar.set_label("plastic strain, whole component")
    figure.savefig(picture, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
