#!/usr/bin/env python3
"""Measures the time of lbea-bake and of numpy and SciPy, and writes the tables into BENCHMARK.md.

usage: refresh_bake.py BUILD_FOLDER ENSEMBLE.toml EXPECTED.json [TABLE ...]
Tables: bake, eigenbasis; without names, both. EXPECTED.json holds the times of the numpy/scipy implementation in seconds.
"""
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import scipy.sparse as sparse
import scipy.sparse.linalg

from refresh import output_of, put

REPETITIONS = 9
MODES = 100
SIDE = 316  # vertices along each side of the sheet: 99,856 in all


def bake_once(build, description):
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        report = json.loads(output_of(Path(build) / "tools/bake/lbea-bake", description, "-o", Path(folder) / "m.lbea", "--json"))
        return time.perf_counter() - begin, report


def bake_table(build, description, expected):
    runs = sorted((bake_once(build, description) for _ in range(REPETITIONS)), key=lambda run: run[0])
    whole, report = runs[len(runs) // 2]
    ours = report["seconds"]
    theirs = json.loads(Path(expected).read_text())["seconds"]
    numpy_bases, numpy_samples = theirs["basis"], theirs["correspondence_and_projection_of_S"]
    method, numpy = ours["bases"] + ours["samples"], numpy_bases + numpy_samples
    return "\n".join([
        f"{report['samples']} samples of {report['simulations']} runs, {report['vertices']} vertices, {report['modes']} modes; median of {REPETITIONS}, "
        f"fastest {runs[0][0]:.2f} s.", "",
        "| seconds | lbea-bake | numpy/scipy | ratio |", "|---|--:|--:|--:|",
        f"| eigenbasis | {ours['bases']:.3f} | {numpy_bases:.3f} | {numpy_bases / ours['bases']:.1f} |",
        f"| samples: correspondence, projection; for lbea-bake also reading and the envelope | {ours['samples']:.3f} | {numpy_samples:.3f} | {numpy_samples / ours['samples']:.1f} |",
        f"| both | {method:.3f} | {numpy:.3f} | {numpy / method:.1f} |",
        f"| the whole program, with the survey of all runs and writing the model to disk | {whole:.3f} | | {numpy / whole:.1f} |"])


def sheet():
    x, y = np.meshgrid(np.arange(SIDE, dtype=float), np.arange(SIDE, dtype=float), indexing="ij")
    points = np.round(np.stack([x.ravel(), y.ravel(), (6 * np.sin(x / 17) * np.cos(y / 23)).ravel()], 1), 6)
    i, j = np.meshgrid(np.arange(SIDE - 1), np.arange(SIDE - 1), indexing="ij")
    at = lambda a, b: (a * SIDE + b).ravel()
    return points, np.stack([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], 1)


def write_run(folder, points, quads):
    folder.mkdir()
    for step, scale in enumerate((1.0, 1.1)):
        with open(folder / f"state_{step:03}.obj", "w") as file:
            np.savetxt(file, points * [1, 1, scale], fmt="v %.6f %.6f %.6f")
            np.savetxt(file, quads + 1, fmt="f %d %d %d %d")


def laplacian(points, quads):
    """Cotangent weights and barycentric masses of the quads' triangles 0-1-2 and 0-2-3."""
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    n, stiffness = len(points), 0
    corner = [points[triangles[:, k]] for k in range(3)]
    for a, b, c in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        u, v = corner[b] - corner[a], corner[c] - corner[a]
        weight = 0.5 * (u * v).sum(1) / np.linalg.norm(np.cross(u, v), axis=1)
        i, j = triangles[:, b], triangles[:, c]
        stiffness = stiffness + sparse.csc_matrix((np.concatenate([-weight, -weight, weight, weight]), (np.concatenate([i, j, i, j]), np.concatenate([j, i, i, j]))), shape=(n, n))
    areas = 0.5 * np.linalg.norm(np.cross(corner[1] - corner[0], corner[2] - corner[0]), axis=1)
    return stiffness, sparse.diags(np.bincount(triangles.ravel(), np.tile(areas / 3, (3, 1)).T.ravel(), n)).tocsc()


def eigenbasis_table(build):
    points, quads = sheet()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_run(folder / "run", points, quads)
        (folder / "sheet.toml").write_text(
            f'runs = ["{folder / "run"}"]\nreference_run = "run"\nimpact_step = 0\nmode = "impact"\nfields = []\nmodes = {MODES}\nlength_unit = "mm"\ntime_unit = "s"\n')
        _, report = bake_once(build, folder / "sheet.toml")
    stiffness, mass = laplacian(points, quads)
    begin = time.perf_counter()
    values = scipy.sparse.linalg.eigsh(stiffness, k=MODES, M=mass, sigma=-1e-6, which="LM", return_eigenvectors=True)[0]
    scipy_seconds = time.perf_counter() - begin
    ours = report["seconds"]["bases"]
    difference = abs(values.max() / report["highest_eigenvalue"] - 1)
    return "\n".join([
        f"A wavy sheet of {len(points):,} vertices, {MODES} modes. Largest residual {report['basis_residual']:.0e}; the highest eigenvalue differs from SciPy's by {difference:.0e} of it.", "",
        "| | s |", "|---|--:|",
        f"| lbea-bake (Lanczos with thick restarts, shift-invert over Eigen's LDL^T), number of eigenvalues verified by a second factorization | {ours:.1f} |",
        f"| SciPy {scipy.__version__} (ARPACK, shift-invert over SuperLU), in the same run | {scipy_seconds:.1f} |",
        f"| ratio | {scipy_seconds / ours:.2f} |"])


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    build, description, expected = sys.argv[1:4]
    tables = {"bake": lambda: bake_table(build, description, expected), "eigenbasis": lambda: eigenbasis_table(build)}
    for name in sys.argv[4:] or tables:
        put(name, tables[name]())


if __name__ == "__main__":
    main()
