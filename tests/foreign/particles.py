#!/usr/bin/env python3
"""Reads one set of particles, written in every format, with programs that nobody here wrote, and compares all numbers.

usage: particles.py FOLDER
FOLDER has star.hdf5 (SWIFT) and what `sph-prep convert` made of it: {gadget,gizmo,arepo}.hdf5 and star.{npz,nc,vtu,vtp,
vtk,csv,gdt,gadget1,phantom}. The star moves and turns, so that velocities say something. h5py's reading of star.hdf5 is the reference; the others hold f32 or f64 of the same numbers."""
import logging
import os
import sys
import warnings

import h5py
import meshio
import netCDF4
import numpy as np
import pynbody
import pyvista
import sarracen
import swiftsimio
import xarray
import yt

warnings.simplefilter("ignore")
logging.getLogger("yt").setLevel(50)
OUT = sys.argv[1]
NAMES = ("Coordinates", "Velocities", "Masses", "Density", "InternalEnergy", "ParticleIDs")
# Two roundings to f32.
TOLERANCE = 2.5e-7
# swiftsimio takes the units of a file for the nearest ones that have names, with four digits (109.2 Rearth for a solar radius),
# and an energy has the square of a velocity.
FOUR_DIGITS = 4e-4


def path(name):
    return os.path.join(OUT, name)


def hdf5(name):
    with h5py.File(path(name)) as f:
        return {n: f["PartType0"][n][:] for n in NAMES if n in f["PartType0"]}


def by_npz():
    z = np.load(path("star.npz"))
    return {n: z[n] for n in NAMES}


def by_pyvista(name):
    mesh = pyvista.read(path(name))
    return {"Coordinates": mesh.points} | {n: mesh.point_data[n] for n in NAMES[1:]}


def by_meshio():
    mesh = meshio.read(path("star.vtu"))
    # meshio keeps a second axis for scalars that state one component.
    return {"Coordinates": mesh.points} | {n: np.squeeze(mesh.point_data[n]) for n in NAMES[1:]}


def by_table():
    with open(path("star.csv")) as f:
        header = next(line for line in f if not line.startswith("#"))
    columns = [c.split("[")[0].strip().strip('"') for c in header.split(",")]
    # The first row that is no comment has the names.
    data = dict(zip(columns, np.genfromtxt(path("star.csv"), delimiter=",", comments="#", dtype="f8")[1:].T))
    join = lambda names: np.stack([data[n] for n in names], 1)
    found = {n: data[n] for n in NAMES[2:]}
    for name, ways in (("Coordinates", (("x", "y", "z"), tuple(f"Coordinates_{k}" for k in range(3)))),
                       ("Velocities", (("vx", "vy", "vz"), tuple(f"Velocities_{k}" for k in range(3))))):
        found[name] = next(join(w) for w in ways if w[0] in data)
    return found


def by_netcdf4():
    with netCDF4.Dataset(path("star.nc")) as f:
        f.set_auto_mask(False)
        column = lambda n: f[n][:]
        assert f.featureType == "point" and f["Masses"].units and f["x"].axis == "X"
        return joined(column)


def by_xarray():
    with xarray.open_dataset(path("star.nc"), decode_times=False) as data:
        return joined(lambda n: data[n].values)


def joined(column):
    """Positions and velocities stand by component."""
    vectors = {"Coordinates": ("x", "y", "z"), "Velocities": ("vx", "vy", "vz")}
    return {n: np.stack([column(c) for c in parts], 1) for n, parts in vectors.items()} | {n: column(n) for n in NAMES[2:]}


def by_swiftsimio():
    gas = swiftsimio.load(path("star.hdf5")).gas
    return {"Coordinates": gas.coordinates.value, "Masses": gas.masses.value, "Velocities": gas.velocities.value}


def by_yt(name):
    data = yt.load(path(name)).all_data()
    fields = {"Coordinates": "code_length", "Masses": "code_mass"}
    found = {n: data["PartType0", n].in_units(u).value for n, u in fields.items()}
    # yt sorts by its own index.
    order = np.argsort(data["PartType0", "ParticleIDs"].value)
    return {n: v[order] for n, v in found.items()}


def by_pynbody(name):
    gas = pynbody.load(path(name)).g
    return {"Coordinates": gas["pos"], "Velocities": gas["vel"], "Masses": gas["mass"], "ParticleIDs": gas["iord"]}


def in_cgs():
    """Mass, extent and velocity, energy per mass in cgs, by the units that SWIFT's file states."""
    with h5py.File(path("star.hdf5")) as f:
        length, mass, time = (float(f["Units"].attrs[f"Unit {n} in cgs (U_{k})"][0]) for n, k in (("length", "L"), ("mass", "M"), ("time", "t")))
        gas = f["PartType0"]
        speed = length / time
        return {"Coordinates": gas["Coordinates"][:] * length, "Masses": gas["Masses"][:] * mass,
                "Velocities": gas["Velocities"][:].astype("f8") * speed,
                "InternalEnergy": gas["InternalEnergy"][:].astype("f8") * speed**2}


def cgs_by_pynbody(name):
    gas = pynbody.load(path(name)).g
    return {"Coordinates": gas["pos"].in_units("cm"), "Masses": gas["mass"].in_units("g"),
            "Velocities": gas["vel"].in_units("cm s**-1"), "InternalEnergy": gas["u"].in_units("cm**2 s**-2")}


def cgs_by_yt(name):
    with h5py.File(path(name)) as f:
        base = {k: float(v) for k, v in f["Parameters"].attrs.items()}
    data = yt.load(path(name), unit_base=base).all_data()
    order = np.argsort(data["PartType0", "ParticleIDs"].value)
    units = {"Coordinates": "cm", "Masses": "g", "Velocities": "cm/s", "InternalEnergy": "cm**2/s**2"}
    return {n: data["PartType0", n].in_units(u).value[order] for n, u in units.items()}


def cgs_by_swiftsimio():
    gas = swiftsimio.load(path("star.hdf5")).gas
    return {"Coordinates": gas.coordinates.to("cm").value, "Masses": gas.masses.to("g").value,
            "Velocities": gas.velocities.to("cm/s").value, "InternalEnergy": gas.internal_energy.to("cm**2/s**2").value}


def centered(x):
    """Phantom's origin is the center of mass; all masses are the same."""
    return x - x.mean(axis=0)


def cgs_by_sarracen():
    gas = sarracen.read_phantom(path("star.phantom"))
    gas = gas[0] if isinstance(gas, (list, tuple)) else gas
    facts = gas.params
    length, speed = facts["udist"], facts["udist"] / facts["utime"]
    vector = lambda *names: np.stack([np.asarray(gas[n], "f8") for n in names], 1)
    order = np.argsort(np.asarray(gas["iorig"]))
    found = {"Coordinates": centered(vector("x", "y", "z")) * length, "Velocities": vector("vx", "vy", "vz") * speed,
             "Masses": np.full(len(gas), facts["mass"] * facts["umass"]), "InternalEnergy": np.asarray(gas["u"], "f8") * speed**2}
    return {n: v[order] for n, v in found.items()}


truth = hdf5("star.hdf5")
assert set(truth) == set(NAMES), truth.keys()
readings = {f"h5py {f}": lambda f=f: hdf5(f) for f in ("gadget.hdf5", "gizmo.hdf5", "arepo.hdf5")}
readings |= {f"pyvista {f}": lambda f=f: by_pyvista(f) for f in ("star.vtu", "star.vtp", "star.vtk")}
readings |= {"numpy star.npz": by_npz, "meshio star.vtu": by_meshio, "numpy star.csv": by_table}
readings |= {"swiftsimio star.hdf5": by_swiftsimio}
readings |= {f"yt {f}": lambda f=f: by_yt(f) for f in ("star.hdf5", "gadget.hdf5")}
readings |= {f"pynbody {f}": lambda f=f: by_pynbody(f) for f in ("gadget.hdf5", "gizmo.hdf5", "star.gdt", "star.gadget1")}
readings |= {"netCDF4 star.nc": by_netcdf4, "xarray star.nc": by_xarray}
readings |= {f"pynbody {f} in cgs": lambda f=f: cgs_by_pynbody(f) for f in ("gadget.hdf5", "gizmo.hdf5", "arepo.hdf5")}
readings |= {f"yt {f} in cgs": lambda f=f: cgs_by_yt(f) for f in ("gadget.hdf5", "gizmo.hdf5", "arepo.hdf5")}
readings |= {"swiftsimio star.hdf5 in cgs": cgs_by_swiftsimio, "sarracen star.phantom in cgs": cgs_by_sarracen}
physical = in_cgs()
assert np.abs(physical["Velocities"]).max() > 1e6
wrong = 0
for label, reading in readings.items():
    try:
        found = reading()
        for name, values in found.items():
            values, expected = np.asarray(values, "f8"), (physical if label.endswith("cgs") else truth)[name].astype("f8")
            assert values.shape == expected.shape, f"{name} has shape {values.shape}, not {expected.shape}"
            if label.startswith("sarracen") and name == "Coordinates":
                expected = centered(expected)
            scale = np.abs(expected).max() or 1.0
            difference = np.abs(values - expected).max() / scale
            tolerance = FOUR_DIGITS if label.startswith("swiftsimio") and label.endswith("cgs") else TOLERANCE
            assert difference <= tolerance, f"{name} differs by {difference:.2g} of its largest"
        print(f"{label:29s} ok: {', '.join(found)}")
    except Exception as e:
        wrong += 1
        print(f"{label:29s} FAILED: {type(e).__name__}: {e}")
profile = xarray.open_dataset("profiles/star.nc")
assert bool(np.isfinite(profile["density" if "density" in profile else "rho"]).all())
print("xarray profiles/star.nc  ok")
sys.exit(1 if wrong else 0)
