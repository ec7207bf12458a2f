#!/usr/bin/env python3
"""Writes the files of vtkhdf/ by h5py, from VTK's description of the format, and reads what VTK 9.1 can read of them, the
grids of one state, by VTK's own reader. Needs python3-h5py and python3-vtk9.

sample_*: the grid of write_samples.py as grid or polygons, in one part or in two that share a row of nodes.
moving_*: a strip of three quads in three steps at 0, 0.5 and 2, whose nodes move. Arrays are stored in all ways that the
format has: per step, or once for all."""
import sys
from pathlib import Path

import h5py
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

folder = Path(sys.argv[1])
points = np.array([[i % 4, i // 4, 0.1 * i] for i in range(12)], np.float32)
node_ids = np.array([100 - i for i in range(12)], np.int32)
cells = []
for row in range(2):
    for column in range(3):
        a = row * 4 + column
        cells.append([a, a + 1, a + 5] + ([a + 4] if column < 2 else []))


def create(name, kind, version=(2, 0), **text):
    file = h5py.File(folder / name, "w", libver="earliest" if "parts" in name else "latest")
    root = file.create_group("VTKHDF")
    root.attrs["Version"] = np.array(version, np.int64)
    # VTK writes a text of fixed length; other writers one of variable length
    root.attrs["Type"] = kind if text.get("variable") else np.bytes_(kind)
    return file, root


def put(root, name, values, **options):
    root.create_dataset(name, data=np.asarray(values), **options)


def connectivity(parts, local):
    """Offsets and connectivity of parts, which are lists of cells; `local`: node -> index in its part."""
    offsets, ids, counts = [], [], []
    for part, nodes in zip(parts, local):
        at = [0]
        for cell in part:
            ids += [nodes[node] for node in cell]
            at.append(at[-1] + len(cell))
        offsets += at
        counts.append(at[-1])
    return np.array(offsets, np.int64), np.array(ids, np.int64), np.array(counts, np.int64)


def write_sample(name, kind, rows, **options):
    """rows: the rows of cells in each part."""
    file, root = create(name, kind, (1, 0) if kind == "UnstructuredGrid" else (2, 0), **options)
    used = [range(4 * part[0], 4 * part[-1] + 8) for part in rows]
    order = np.concatenate([np.array(nodes) for nodes in used])
    parts = [[cells[3 * row + column] for row in part for column in range(3)] for part in rows]
    offsets, ids, counts = connectivity(parts, [{node: i for i, node in enumerate(nodes)} for nodes in used])
    put(root, "NumberOfPoints", [len(nodes) for nodes in used])
    put(root, "Points", points[order], chunks=(5, 3), compression="gzip", shuffle=True)
    topology = root if kind == "UnstructuredGrid" else root.create_group("Polygons")
    put(topology, "NumberOfCells", [len(part) for part in parts])
    put(topology, "NumberOfConnectivityIds", counts)
    put(topology, "Offsets", offsets)
    put(topology, "Connectivity", ids)
    if kind == "UnstructuredGrid":
        put(root, "Types", np.array([9 if len(cell) == 4 else 5 for part in parts for cell in part], np.uint8))
    else:
        for other in ("Vertices", "Lines", "Strips"):
            for array, values in (("NumberOfCells", [0] * len(rows)), ("NumberOfConnectivityIds", [0] * len(rows)),
                                  ("Offsets", [0] * len(rows)), ("Connectivity", np.zeros(0, np.int64))):
                put(root, f"{other}/{array}", np.array(values, np.int64))
    put(root, "PointData/NODE_ID", node_ids[order])
    numbers = [3 * row + column for part in rows for row in part for column in range(3)]
    put(root, "CellData/ELEMENT_ID", np.array([7 + i for i in numbers], np.int64))
    put(root, "CellData/PART_ID", np.array([1 + i // 3 for i in numbers], np.uint8))
    put(root, "CellData/Plastic Strain", np.array([0.125 * i for i in numbers]), fletcher32=True, chunks=(4,))
    put(root, "FieldData/TimeValue", [2.5])
    file.close()


def check_by_vtk(name):
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(folder / name))
    reader.Update()
    grid = reader.GetOutput()
    assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), points), name
    assert [[grid.GetCell(c).GetPointId(i) for i in range(grid.GetCell(c).GetNumberOfPoints())]
            for c in range(grid.GetNumberOfCells())] == cells, name
    assert np.array_equal(vtk_to_numpy(grid.GetCellData().GetArray("Plastic Strain")), np.arange(6) / 8), name


def moved(step):
    strip = np.array([[i // 2, i % 2, 0] for i in range(8)], np.float64)
    strip[:, 2] = step * strip[:, 0] ** 2
    return strip


strip = [[2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1] for i in range(3)]
times = [0, 0.5, 2]


def write_moving(name, is_repeated, has_lines):
    """is_repeated: each step has its own cells; else all have those of the first."""
    file, root = create(name, "PolyData" if has_lines else "UnstructuredGrid", variable=True)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = 3
    put(steps, "Values", times)
    put(steps, "PointOffsets", [0, 8, 16])
    put(root, "Points", np.concatenate([moved(step) for step in range(3)]), chunks=(7, 3), maxshape=(None, 3))
    copies = 3 if is_repeated else 1
    put(steps, "PartOffsets", [0, 1, 2] if is_repeated else [0, 0, 0])
    put(steps, "NumberOfParts", [1, 1, 1])
    put(root, "NumberOfPoints", [8] * copies)
    offsets, ids, counts = connectivity([strip] * copies, [range(8)] * copies)
    topology = root if not has_lines else root.create_group("Polygons")
    put(topology, "NumberOfCells", [3] * copies)
    put(topology, "NumberOfConnectivityIds", counts)
    put(topology, "Offsets", offsets)
    put(topology, "Connectivity", ids)
    cells_at, ids_at = ([0, 3, 6], [0, 12, 24]) if is_repeated else ([0] * 3, [0] * 3)
    lines = 1 if has_lines else 0
    if has_lines:  # a line in each step, before the polygons in the cells' arrays; the other topologies are not there
        put(root, "Lines/NumberOfCells", [1] * copies)
        put(root, "Lines/NumberOfConnectivityIds", [2] * copies)
        put(root, "Lines/Offsets", [0, 2] * copies)
        put(root, "Lines/Connectivity", [0, 7] * copies)
        zeros = [0] * 3
        lines_at, line_ids_at = ([0, 1, 2], [0, 2, 4]) if is_repeated else (zeros, zeros)
        put(steps, "CellOffsets", np.array([zeros, lines_at, cells_at, zeros]).T)
        put(steps, "ConnectivityIdOffsets", np.array([zeros, line_ids_at, ids_at, zeros]).T)
    else:
        put(root, "Types", np.array([9] * 3 * copies, np.uint8))
        put(steps, "CellOffsets", np.array(cells_at)[:, None])
        put(steps, "ConnectivityIdOffsets", np.array(ids_at)[:, None])
    # values that change: one block per step; element i has step + i / 4 (lines: -1)
    values = [[-1.0] * lines + [step + i / 4 for i in range(3)] for step in range(3)]
    put(root, "CellData/stress", np.concatenate(values).astype(np.float32), chunks=(5,), compression="gzip")
    put(steps, "CellDataOffsets/stress", [(3 + lines) * step for step in range(3)])
    # ids that do not: stored once
    put(root, "PointData/NODE_ID", np.array([11, 12, 13, 14, 15, 16, 17, 18], np.uint16))
    put(steps, "PointDataOffsets/NODE_ID", [0, 0, 0])
    file.close()


folder.mkdir(exist_ok=True)
write_sample("sample_grid.vtkhdf", "UnstructuredGrid", [[0, 1]])
write_sample("sample_grid_parts.vtkhdf", "UnstructuredGrid", [[0], [1]])
write_sample("sample_polygons.vtkhdf", "PolyData", [[0, 1]], variable=True)
write_sample("sample_polygons_parts.vtkhdf", "PolyData", [[0], [1]])
check_by_vtk("sample_grid.vtkhdf")
write_moving("moving_grid.vtkhdf", False, False)
write_moving("moving_grid_repeated.vtkhdf", True, False)
write_moving("moving_polygons.vtkhdf", False, True)
write_moving("moving_polygons_repeated.vtkhdf", True, True)

# What is refused: a file each, a change of the sample.
refused = folder / "refused"
refused.mkdir(exist_ok=True)


def refuse(name, change):
    file, root = create(f"refused/{name}.vtkhdf", "UnstructuredGrid")
    for array, values in (("NumberOfPoints", [3]), ("NumberOfCells", [1]), ("NumberOfConnectivityIds", [3]),
                          ("Offsets", [0, 3]), ("Connectivity", [0, 1, 2]), ("Types", np.array([5], np.uint8)),
                          ("Points", np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32))):
        put(root, array, values)
    change(root)
    file.close()


def replace(root, name, values, **options):
    del root[name]
    put(root, name, values, **options)


def declare(root):
    del root["Points"]
    root.create_dataset("Points", (2**40, 3), np.float32, chunks=(64, 3))


refuse("other", lambda root: root.parent.move("VTKHDF", "other"))
refuse("image", lambda root: root.attrs.modify("Type", np.bytes_("ImageData")))
refuse("version", lambda root: root.attrs.modify("Version", np.array([3, 0])))
refuse("missing", lambda root: root.pop("Types"))
refuse("short", lambda root: replace(root, "NumberOfPoints", [4]))
refuse("flat", lambda root: replace(root, "Points", np.zeros((3, 2))))
refuse("negative", lambda root: replace(root, "NumberOfCells", [-1]))
refuse("decreasing", lambda root: replace(root, "Offsets", [3, 2]))
refuse("beyond", lambda root: replace(root, "Connectivity", [0, 1, 3]))
refuse("declared", declare)
refuse("texts", lambda root: replace(root, "Points", np.array([b"a", b"b", b"c"])))
refuse("tensors", lambda root: put(root, "CellData/tensor", np.zeros((1, 3, 3))))
refuse("packed", lambda root: replace(root, "Points", np.zeros((3, 3)), compression="lzf"))
refuse("elsewhere", lambda root: root.__setitem__("PointData", h5py.ExternalLink("other.vtkhdf", "/other")))
refuse("outside", lambda root: root.create_dataset("CellData/a", (1,), "f4", external=[("a.raw", 0, 4)]))
