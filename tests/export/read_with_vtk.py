"""Reads what write_sample_grid wrote with VTK's own reader and compares with what that program put in."""
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ElementTree

try:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
except ImportError:
    print("skipped: python3-vtk9 is not installed")
    sys.exit(77)


def read(path):
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(path)
    reader.Update()
    assert reader.GetErrorCode() == 0, path
    return reader.GetOutput()


def values(array):
    return [array.GetTuple(i) for i in range(array.GetNumberOfTuples())]


def corners(cell):
    return [cell.GetPointId(i) for i in range(cell.GetNumberOfPoints())]


def check_state(grid, state):
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2 - state, 0.5, 0.25)]
    assert [grid.GetPoint(i) for i in range(grid.GetNumberOfPoints())] == points
    assert [grid.GetCellType(i) for i in range(grid.GetNumberOfCells())] == [9, 5]
    assert corners(grid.GetCell(0)) == [0, 1, 2, 3]
    assert corners(grid.GetCell(1)) == [1, 4, 2]
    point_data, cell_data = grid.GetPointData(), grid.GetCellData()
    assert (point_data.GetNumberOfArrays(), cell_data.GetNumberOfArrays()) == (2, 2)
    assert values(point_data.GetArray("node_id")) == [(11,), (12,), (13,), (14,), (4000000000,)]
    assert values(point_data.GetArray("where <mm>")) == points
    assert values(cell_data.GetArray("plastic_strain")) == [(0.125,), (0.5,)]
    assert values(cell_data.GetArray("part")) == [(7,), (8,)]
    assert values(grid.GetFieldData().GetArray("TimeValue")) == [(0.0005 * state,)]


with tempfile.TemporaryDirectory() as folder:
    os.mkdir(os.path.join(folder, "states"))
    subprocess.run([sys.argv[1], folder], check=True)
    entries = ElementTree.parse(os.path.join(folder, "series.pvd")).getroot().findall("Collection/DataSet")
    assert [float(entry.get("timestep")) for entry in entries] == [0, 0.0005]
    for state, entry in enumerate(entries):
        check_state(read(os.path.join(folder, entry.get("file"))), state)
    empty = read(os.path.join(folder, "empty.vtu"))
    assert (empty.GetNumberOfPoints(), empty.GetNumberOfCells()) == (0, 0)
print("VTK reads what was written")
