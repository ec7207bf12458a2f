#!/usr/bin/env python3
"""Writes one small grid in every encoding that VTK has: python3-vtk9 made what lies in encodings/."""
import sys
from pathlib import Path

import vtk

folder = Path(sys.argv[1])


def array(kind, name, values):
    result = kind()
    result.SetName(name)
    for value in values:
        result.InsertNextValue(value)
    return result


points = vtk.vtkPoints()
for i in range(12):
    points.InsertNextPoint(i % 4, i // 4, 0.1 * i)
cells = vtk.vtkCellArray()
kinds = []
for row in range(2):
    for column in range(3):
        a = row * 4 + column
        corners = [a, a + 1, a + 5] + ([a + 4] if column < 2 else [])
        cells.InsertNextCell(len(corners), corners)
        kinds.append(9 if column < 2 else 5)
grid = vtk.vtkUnstructuredGrid()
polygons = vtk.vtkPolyData()
for data in (grid, polygons):
    data.SetPoints(points)
    data.GetPointData().AddArray(array(vtk.vtkIntArray, "NODE_ID", [100 - i for i in range(12)]))
    data.GetCellData().AddArray(array(vtk.vtkIdTypeArray, "ELEMENT_ID", [7 + i for i in range(6)]))
    data.GetCellData().AddArray(array(vtk.vtkUnsignedCharArray, "PART_ID", [1 + i // 3 for i in range(6)]))
    data.GetCellData().AddArray(array(vtk.vtkDoubleArray, "Plastic Strain", [0.125 * i for i in range(6)]))
    data.GetFieldData().AddArray(array(vtk.vtkDoubleArray, "TimeValue", [2.5]))
grid.SetCells(kinds, cells)
polygons.SetPolys(cells)

for data, kind in ((grid, "grid"), (polygons, "polygons")):
    for version in (42, 51):
        for binary in (False, True):
            writer = vtk.vtkUnstructuredGridWriter() if data is grid else vtk.vtkPolyDataWriter()
            writer.SetInputData(data)
            writer.SetFileVersion(version)
            writer.SetFileTypeToBinary() if binary else writer.SetFileTypeToASCII()
            writer.SetFileName(str(folder / f"legacy{version}_{'binary' if binary else 'ascii'}_{kind}.vtk"))
            writer.Write()
for mode in ("Ascii", "Binary", "Appended"):
    for compressor in ("None", "ZLib", "LZ4"):
        for variant in ("base64", "raw", "big_endian", "uint64"):
            if mode == "Ascii" and (compressor, variant) != ("None", "base64"):
                continue
            if variant == "raw" and mode != "Appended":
                continue
            if variant in ("big_endian", "uint64") and mode == "Binary" and compressor == "LZ4":
                continue
            polygonal = variant == "base64"
            writer = vtk.vtkXMLPolyDataWriter() if polygonal else vtk.vtkXMLUnstructuredGridWriter()
            writer.SetInputData(polygons if polygonal else grid)
            getattr(writer, f"SetDataModeTo{mode}")()
            getattr(writer, f"SetCompressorTypeTo{compressor}")()
            writer.SetEncodeAppendedData(variant != "raw")
            if variant == "big_endian":
                writer.SetByteOrderToBigEndian()
            if variant == "uint64":
                writer.SetHeaderTypeToUInt64()
            else:
                writer.SetHeaderTypeToUInt32()
            writer.SetBlockSize(64)
            ending = "vtp" if polygonal else "vtu"
            writer.SetFileName(str(folder / f"{mode}_{compressor}_{variant}.{ending}".lower()))
            writer.Write()

# The same grids in two pieces each, which repeat the cells and nodes along their border: parts/.
parts = folder.parent / "parts"
parts.mkdir(exist_ok=True)
for data, piece_filter, writer, ending in (
        (grid, vtk.vtkExtractUnstructuredGridPiece(), vtk.vtkXMLPUnstructuredGridWriter(), "pvtu"),
        (polygons, vtk.vtkExtractPolyDataPiece(), vtk.vtkXMLPPolyDataWriter(), "pvtp")):
    piece_filter.SetInputData(data)
    writer.SetInputConnection(piece_filter.GetOutputPort())
    writer.SetNumberOfPieces(2)
    writer.SetStartPiece(0)
    writer.SetEndPiece(1)
    writer.SetGhostLevel(1)
    writer.SetDataModeToAscii()
    writer.SetFileName(str(parts / f"sample.{ending}"))
    writer.Write()
