#!/usr/bin/env python3
"""Writes field files with programs that nobody here wrote, each beside a text of what has to be read from it.

usage: fields.py FOLDER
`formats/tests/foreign.rs` reads them. Beside FILE stands FILE.expected with lines `geometry KIND`, `axis NAME NUMBERS`
(of a grid, x first) or `radii NUMBERS`, and `values NAME NUMBERS` (x fastest), numbers in repr."""
import os
import sys

import h5py
import meshio
import netCDF4
import numpy as np
import pyvista
import tifffile
import vtk
import xarray
from PIL import Image
from vtk.util.numpy_support import numpy_to_vtk

OUT = sys.argv[1]
X, Y, Z = np.array([0.0, 1.0, 3.0, 4.0]), np.array([-1.0, 0.5, 2.0]), np.array([10.0, 20.0])
# Index order z, y, x: x runs fastest in memory. Exact in f32.
RHO = 1 + X[None, None, :] + 16 * Y[None, :, None] ** 2 + 4 * Z[:, None, None]


def path(name):
    return os.path.join(OUT, name)


def expect(name, geometry, values, axes=(), radii=None, variable="density"):
    numbers = lambda v: " ".join(repr(float(x)) for x in np.asarray(v).ravel())
    with open(path(name) + ".expected", "w") as f:
        f.write(f"geometry {geometry}\n")
        for axis, nodes in axes:
            f.write(f"axis {axis} {numbers(nodes)}\n")
        if radii is not None:
            f.write(f"radii {numbers(radii)}\n")
        f.write(f"values {variable} {numbers(values)}\n")


def xml_ways(writer):
    """Every encoding that VTK's XML writers have: (label, function that sets it up)."""
    modes = [("ascii", None)]
    modes += [(m, c) for m in ("binary", "base64", "raw") for c in ("None", "ZLib", "LZ4", "LZMA")]
    for mode, compressor in modes:
        for header in (32, 64):
            for order in ("Little", "Big"):
                w = writer()
                getattr(w, f"SetByteOrderTo{order}Endian")()
                getattr(w, f"SetHeaderTypeToUInt{header}")()
                # Several blocks even for small arrays.
                w.SetBlockSize(64)
                if mode == "ascii":
                    w.SetDataModeToAscii()
                elif mode == "binary":
                    w.SetDataModeToBinary()
                else:
                    w.SetDataModeToAppended()
                    w.SetEncodeAppendedData(mode == "base64")
                if compressor:
                    getattr(w, f"SetCompressorTypeTo{compressor}")()
                yield f"{mode}-{compressor}-{header}-{order}", w


def add(dataset, values, where="point"):
    array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
    array.SetName("density")
    (dataset.GetPointData() if where == "point" else dataset.GetCellData()).AddArray(array)


def vtk_files():
    image = vtk.vtkImageData()
    image.SetDimensions(4, 3, 2)
    image.SetOrigin(0.5, -1, 2)
    image.SetSpacing(0.25, 1, 2)
    image_axes = [("x", 0.5 + 0.25 * np.arange(4)), ("y", -1 + np.arange(3.0)), ("z", 2 + 2 * np.arange(2.0))]
    add(image, RHO)
    rectilinear = vtk.vtkRectilinearGrid()
    rectilinear.SetDimensions(4, 3, 2)
    for axis, nodes in zip("XYZ", (X, Y, Z)):
        getattr(rectilinear, f"Set{axis}Coordinates")(numpy_to_vtk(nodes, deep=True))
    add(rectilinear, RHO.astype("f4"))
    axes = [("x", X), ("y", Y), ("z", Z)]
    grid = pyvista.StructuredGrid(*np.meshgrid(X, Y, Z, indexing="ij"))
    grid.point_data["density"] = RHO.ravel()
    cells = grid.cast_to_unstructured_grid()
    cells.point_data["density"] = RHO.ravel()
    for data, extension, writer, geometry, ax in (
        (image, "vti", vtk.vtkXMLImageDataWriter, "grid", image_axes),
        (rectilinear, "vtr", vtk.vtkXMLRectilinearGridWriter, "grid", axes),
        (grid, "vts", vtk.vtkXMLStructuredGridWriter, "mesh", ()),
        (cells, "vtu", vtk.vtkXMLUnstructuredGridWriter, "mesh", ()),
    ):
        for label, w in xml_ways(writer):
            name = f"vtk-{label}.{extension}"
            w.SetFileName(path(name))
            w.SetInputData(data)
            assert w.Write() == 1
            expect(name, geometry, RHO, ax)
        for version in (42, 51):
            for binary in (False, True):
                name = f"legacy-{version}-{binary}-{extension}.vtk"
                w = vtk.vtkDataSetWriter()
                w.SetFileName(path(name))
                w.SetInputData(data)
                w.SetFileVersion(version)
                w.SetFileTypeToBinary() if binary else w.SetFileTypeToASCII()
                assert w.Write() == 1
                expect(name, geometry, RHO, ax)
    for binary in (False, True):
        for data, extension, geometry, ax in ((grid, "vts", "mesh", ()), (cells, "vtu", "mesh", ())):
            name = f"pyvista-{binary}.{extension}"
            data.save(path(name), binary=binary)
            expect(name, geometry, RHO, ax)
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    mesh = meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])], point_data={"density": np.array([1.0, 2, 3, 4])})
    for name, options in (
        ("meshio-zlib.vtu", {"compression": "zlib"}),
        ("meshio-lzma.vtu", {"compression": "lzma"}),
        ("meshio-none.vtu", {"compression": None}),
        ("meshio-ascii.vtu", {"binary": False}),
        ("meshio-binary.vtk", {"binary": True}),
        ("meshio-ascii.vtk", {"binary": False}),
    ):
        mesh.write(path(name), **options)
        expect(name, "mesh", [1, 2, 3, 4])


def netcdf_files():
    axes = [("x", X), ("y", Y), ("z", Z)]
    for kind in ("NETCDF3_CLASSIC", "NETCDF3_64BIT_OFFSET", "NETCDF3_64BIT_DATA", "NETCDF4", "NETCDF4_CLASSIC"):
        for label, options in (("plain", {}), ("packed", {"zlib": True, "shuffle": True, "fletcher32": True, "chunksizes": (1, 2, 3)}),
                               ("big", {"endian": "big"}), ("scaled", {})):
            if kind.startswith("NETCDF3") and label in ("packed", "big"):
                continue
            name = f"netcdf4-{kind}-{label}.nc"
            with netCDF4.Dataset(path(name), "w", format=kind) as f:
                for axis, nodes in (("z", Z), ("y", Y), ("x", X)):
                    f.createDimension(axis, len(nodes))
                    f.createVariable(axis, "f8", (axis,))[:] = nodes
                v = f.createVariable("density", "i2" if label == "scaled" else "f4", ("z", "y", "x"), **options)
                if label == "scaled":
                    v.scale_factor, v.add_offset = 0.25, 1.0
                v[:] = RHO
            expect(name, "grid", RHO, axes)
    # Descending y, order x, z, y, and an unlimited time of one record.
    data = xarray.DataArray(RHO, dims=("z", "y", "x"), coords={"x": X, "y": Y, "z": Z}, name="density")
    turned = data.isel(y=slice(None, None, -1)).transpose("x", "z", "y").expand_dims(time=[0.5])
    for engine, kind in (("netcdf4", "NETCDF4"), ("h5netcdf", "NETCDF4"), ("scipy", "NETCDF3_64BIT")):
        name = f"xarray-{engine}.nc"
        turned.to_netcdf(path(name), engine=engine, format=kind, unlimited_dims=["time"])
        expect(name, "grid", RHO, axes)


def hdf5_files():
    for libver in ("earliest", "v110"):
        name = f"athena-{libver}.athdf"
        with h5py.File(path(name), "w", libver=libver) as f:
            f.attrs.update({"Coordinates": np.bytes_("cartesian"), "RootGridSize": np.array([4, 2, 1], "i4"),
                            "MeshBlockSize": np.array([2, 2, 1], "i4"), "NumMeshBlocks": np.int32(2), "MaxLevel": np.int32(0),
                            "DatasetNames": np.array(["prim"], "S21"), "NumVariables": np.array([2], "i4"),
                            "VariableNames": np.array(["press", "rho"], "S21"), "Time": np.float32(1)})
            f["LogicalLocations"] = np.array([[1, 0, 0], [0, 0, 0]], "i8")
            f["x1f"] = np.array([[2, 3, 4], [0, 1, 2]], "f4")
            f["x2f"] = np.array([[0, 1, 2]] * 2, "f4")
            f["x3f"] = np.array([[0, 1]] * 2, "f4")
            whole = np.arange(1.0, 9.0).reshape(1, 2, 4)
            rho = np.array([whole[:, :, 2:], whole[:, :, :2]], "f4")
            f["prim"] = np.array([0 * rho, rho])
        expect(name, "grid", whole, [("x", [0.5, 1.5, 2.5, 3.5]), ("y", [0.5, 1.5])], variable="rho")
        name = f"pluto-{libver}.flt.h5"
        with h5py.File(path(name), "w", libver=libver) as f:
            f.create_group("Timestep_3").attrs["Time"] = 0.5
            f["Timestep_3/vars/rho"] = RHO.astype("f4")
            edges = [np.arange(n + 1.0) for n in (4, 3, 2)]
            nodes = np.meshgrid(*edges, indexing="ij")
            for axis, node in zip("XYZ", nodes):
                f[f"node_coords/{axis}"] = node.transpose(2, 1, 0).astype("f4")
                f[f"cell_coords/{axis}"] = node.transpose(2, 1, 0)[:-1, :-1, :-1].astype("f4") + 0.5
        middles = [(a, e[:-1] + 0.5) for a, e in zip("xyz", edges)]
        expect(name, "grid", RHO, middles, variable="rho")
        name = f"star-{libver}.gsm"
        with h5py.File(path(name), "w", libver=libver) as f:
            f.attrs.update({"n": np.int32(3), "version": np.int32(110), "M_star": 2e33, "R_star": 2e10, "L_star": 4e33})
            f["r"], f["rho"], f["M_r"] = [0, 1e10, 2e10], [100.0, 10.0, 1.0], [0, 1.5e33, 2e33]
        expect(name, "radial", [100, 10, 1], radii=[0, 1e10, 2e10])


def numpy_files():
    cells = [("x", (np.arange(4) + 0.5) / 4), ("y", (np.arange(3) + 0.5) / 3), ("z", (np.arange(2) + 0.5) / 2)]
    # The first index is x.
    rho = RHO.transpose(2, 1, 0)
    for label, array in (("f4", rho.astype("f4")), ("f8", rho.copy()), ("big", rho.astype(">f8")), ("i2", (rho).astype("i2")),
                         ("fortran", np.asfortranarray(rho))):
        name = f"numpy-{label}.npy"
        np.save(path(name), array)
        expect(name, "grid", array.transpose(2, 1, 0), cells)
    for name, save in (("numpy.npz", np.savez), ("numpy-deflated.npz", np.savez_compressed)):
        save(path(name), density=rho, temperature=2 * rho)
        expect(name, "grid", RHO, cells)
        save(path("axes-" + name), density=rho, x=X, y=Y, z=Z)
        expect("axes-" + name, "grid", RHO, [("x", X), ("y", Y), ("z", Z)])


def images():
    gray = (np.arange(20) * 12).reshape(4, 5).astype("u1")
    axes = [("x", (np.arange(5) + 0.5) / 5), ("y", (np.arange(4) + 0.5) / 5)]
    up = gray[::-1].astype("f8") / 255
    Image.fromarray(gray).save(path("pillow-8.png"))
    Image.fromarray((gray.astype("u2") * 257)).save(path("pillow-16.png"))
    for compression in (None, "tiff_lzw", "tiff_adobe_deflate", "packbits"):
        name = f"pillow-{compression}.tif"
        Image.fromarray(gray).save(path(name), compression=compression)
        expect(name, "grid", up, axes)
    expect("pillow-8.png", "grid", up, axes)
    expect("pillow-16.png", "grid", up, axes)
    for kind in ("f4", "f8", "u2"):
        for order in ("<", ">"):
            name = f"tifffile-{kind}-{'big' if order == '>' else 'little'}.tif"
            values = gray.astype("u2") * 257 if kind == "u2" else gray / 4.0
            tifffile.imwrite(path(name), values.astype(kind), byteorder=order)
            expect(name, "grid", values[::-1] / (65535 if kind == "u2" else 1), axes)


os.makedirs(OUT, exist_ok=True)
vtk_files()
netcdf_files()
hdf5_files()
numpy_files()
images()
print(f"{len([n for n in os.listdir(OUT) if n.endswith('.expected')])} field files written by foreign programs")
