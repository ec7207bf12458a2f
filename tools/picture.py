#!/usr/bin/env python3
"""Draws the cloud of the rig above the matched mesh, which is colored by plastic strain.

usage: picture.py EVALUATION_FOLDER PICTURE.png
The folder is the output of `lbea-eval live --out`: results.csv, matched_<frame>.vtu, frame_<frame>.ply.
"""
import csv
import re
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

COLUMNS = 3
FIELD = "plastic_strain"
ELEVATION, AZIMUTH = np.radians(32), np.radians(62)
MOST_POINTS = 6_000
WIDTH, HEIGHT = 550, 330  # of the area of a cloud or mesh, in pixels
BAR = 110                 # width of the area of the color bar
FINE = 3                  # fine pixels per pixel and axis, against jagged edges
# The color map viridis at 0, 0.1, ..., 1.
VIRIDIS = np.array([
    (68, 1, 84), (72, 36, 117), (65, 68, 135), (53, 95, 141), (42, 120, 142), (33, 145, 140), (34, 168, 132),
    (68, 191, 112), (122, 209, 81), (189, 223, 38), (253, 231, 37)])


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


def viridis(shares):
    """RGB of shares in 0 to 1."""
    at = np.linspace(0, 1, len(VIRIDIS))
    return np.stack([np.interp(shares, at, VIRIDIS[:, k]) for k in range(3)], -1).round().astype(int)


def view_axes():
    """Rows: directions to the right, downwards and towards the viewer."""
    e, a = ELEVATION, AZIMUTH
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0])
    return np.stack([right, np.cross(right, towards), towards])


class View:
    """Places points of the box low to high in an area of the picture, in fine pixels."""

    def __init__(self, low, high):
        corners = np.array(np.meshgrid(*zip(low, high))).reshape(3, -1).T @ view_axes().T
        self.first, size = corners.min(0), np.ptp(corners, axis=0)
        self.scale = FINE * min(0.92 * WIDTH / size[0], 0.80 * HEIGHT / size[1])
        self.margin = (FINE * np.array([WIDTH, HEIGHT * 1.08]) - self.scale * size[:2]) / 2

    def __call__(self, points, column, row):
        """Rows: position in fine pixels, and how near to the viewer."""
        seen = self.scale * (points @ view_axes().T - self.first)
        seen[:, :2] += self.margin + FINE * np.array([column * WIDTH, row * HEIGHT])
        return seen


def draw_cloud(draw, seen):
    for x, y, _ in seen:
        draw.ellipse((x - 1.6, y - 1.6, x + 1.6, y + 1.6), fill="#24507a")


def draw_mesh(draw, seen, mesh, most):
    colors = viridis(np.clip(mesh[FIELD] / most, 0, 1)) if FIELD in mesh else np.full((len(mesh["offsets"]), 3), 160)
    elements = np.split(mesh["connectivity"], mesh["offsets"][:-1])
    for k in np.argsort([seen[nodes, 2].mean() for nodes in elements], kind="stable"):  # the farthest first
        corners = [tuple(p) for p in seen[elements[k], :2]]
        draw.polygon(corners, fill=tuple(colors[k]))
        draw.line(corners + corners[:1], fill=tuple((colors[k] * 3 + 255) // 4), width=1)


def draw_bar(picture, draw, left, most):
    top, height = 1.22 * HEIGHT, 0.68 * HEIGHT
    strip = viridis(np.linspace(1, 0, round(height)))[:, None].repeat(20, axis=1).astype(np.uint8)
    picture.paste(Image.fromarray(strip), (round(left), round(top)))
    draw.rectangle((left, top, left + 20, top + height), outline="black")
    step = next(s for s in (10.0**p * f for p in range(-9, 9) for f in (1, 2, 5)) if most / s <= 6)
    for value in np.arange(0, most, step):
        y = top + height * (1 - value / most)
        draw.line((left + 20, y, left + 25, y), fill="black")
        draw.text((left + 29, y), f"{value:.6g}", "black", font(13), anchor="lm")
    label = Image.new("RGB", (round(height), 20), "white")
    ImageDraw.Draw(label).text((height / 2, 10), "plastic strain, whole component", "black", font(13), anchor="mm")
    picture.paste(label.rotate(90, expand=True), (round(left + 62), round(top)))


def font(size):
    return ImageFont.truetype("DejaVuSans.ttf", size)


def main(folder, target):
    with open(folder / "results.csv", newline="") as table:
        rows = [row for row in csv.DictReader(table) if row["simulation"]]
    if not rows:
        sys.exit(f"{folder}: no matched frame to draw")
    chosen = [rows[i] for i in np.linspace(0, len(rows) - 1, min(COLUMNS, len(rows))).round().astype(int)]
    meshes = [read_vtu(folder / f"matched_{int(row['frame']):05d}.vtu") for row in chosen]
    low = np.min([m["Points"].min(0) for m in meshes], axis=0)
    high = np.max([m["Points"].max(0) for m in meshes], axis=0)
    # A percentile, because a few elements in sharp folds have far larger values than all others.
    most = max((float(np.percentile(m[FIELD], 99.5)) for m in meshes if FIELD in m), default=1.0) or 1.0
    view = View(low, high)

    size = np.array([WIDTH * len(chosen) + BAR, 2 * HEIGHT])
    fine = Image.new("RGB", tuple(FINE * size), "white")
    draw = ImageDraw.Draw(fine)
    for column, (row, mesh) in enumerate(zip(chosen, meshes)):
        cloud_file = folder / f"frame_{int(row['frame']):05d}.ply"
        if cloud_file.exists():
            cloud = read_ply(cloud_file)
            cloud = cloud[:: max(1, len(cloud) // MOST_POINTS)]
            draw_cloud(draw, view(cloud[((cloud > low - 20) & (cloud < high + 20)).all(1)], column, 0))
        draw_mesh(draw, view(mesh["Points"], column, 1), mesh, most)
    picture = fine.resize(tuple(size), Image.LANCZOS)
    draw = ImageDraw.Draw(picture)
    for column, row in enumerate(chosen):
        error = f" (EE {float(row['EE']):.1f} mm)" if row["EE"] else ""
        titles = f"frame {row['frame']}: cloud of the rig", f"{row['simulation']}, step {row['time_step']}{error}"
        for line, title in enumerate(titles):
            draw.text(((column + 0.5) * WIDTH, line * HEIGHT + 26), title, "black", font(17), anchor="mm")
    draw_bar(picture, draw, WIDTH * len(chosen), most)
    picture.save(target)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]))
