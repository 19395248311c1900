"""Particles: arrays by name, with their units, the report of how they were placed, and ways to other packages."""

from __future__ import annotations

import html
import json
import os
import tempfile
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np

from . import _core
from ._picture import picture

#: Folders that are removed when Python ends.
_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []

#: Dimensions as exponents of length, mass, time and temperature.
_NONE = (0, 0, 0, 0)


class Particles:
    """Particles of one or several types, the gas first.

    ``particles["Masses"]`` is the gas's column of that name; what is changed in it is what is written. Columns of further types are
    in ``particles.species``.
    """

    def __init__(self, header: dict[str, Any], species: list[Any], report: dict[str, Any] | None, scene: str | None) -> None:
        self.header = header
        """Box, units in cgs, kernel, and how the file was made."""
        self.report: dict[str, Any] = report or {}
        """What the program reports, as its ``--json`` does; empty for particles that were read."""
        self.scene = scene
        """The scene as YAML."""
        self.species = {kind: {name: array for name, array, _ in columns} for kind, columns in species}
        """Columns of each type: 0 is gas, 1 dark matter, 2 to 5 others."""
        self._exponents = {(kind, name): tuple(e) for kind, columns in species for name, _, e in columns}

    # -- columns

    @property
    def gas(self) -> dict[str, np.ndarray]:
        """Columns of the gas, or of the first type where there is none."""
        return self.species.setdefault(self._kind, {})

    @property
    def _kind(self) -> int:
        """The type that is meant where none is named: gas, or the first where there is none."""
        return 0 if 0 in self.species or not self.species else next(iter(self.species))

    def __getitem__(self, name: str) -> np.ndarray:
        try:
            return self.gas[name]
        except KeyError:
            raise KeyError(f"there is no column '{name}', but {', '.join(self.gas)}") from None

    def __setitem__(self, name: str, values: Any) -> None:
        array = np.asarray(values)
        if array.dtype not in (np.float32, np.int64):
            array = array.astype(np.int64 if array.dtype.kind in "iu" else np.float64)
        if array.ndim == 0 or len(array) != len(self):
            raise ValueError(f"'{name}' has the shape {array.shape}, expected {len(self)} rows")
        self.gas[name] = array

    def __contains__(self, name: object) -> bool:
        return name in self.gas

    def __iter__(self) -> Iterator[str]:
        return iter(self.gas)

    def keys(self) -> list[str]:
        """Names of the gas's columns."""
        return list(self.gas)

    def __len__(self) -> int:
        return len(next(iter(self.gas.values()), ()))

    @property
    def positions(self) -> np.ndarray:
        """(N, D), within the box whose lowest corner is the origin."""
        return self["Coordinates"]

    @property
    def masses(self) -> np.ndarray:
        return self["Masses"]

    @property
    def density(self) -> np.ndarray:
        """The sum over neighbors, as the kernel sees it."""
        return self["Density"]

    @property
    def support_radius(self) -> np.ndarray:
        """The radius beyond which the kernel is zero."""
        return self["SupportRadius"]

    @property
    def velocities(self) -> np.ndarray:
        """(N, D); zero where nothing moves."""
        return self.gas["Velocities"] if "Velocities" in self else np.zeros_like(self.positions)

    @property
    def dimension(self) -> int:
        return int(self.header["dimension"])

    @property
    def box_size(self) -> np.ndarray:
        return np.array(self.header["box_size"][: self.dimension])

    # -- units

    def exponents(self, name: str, kind: int | None = None) -> tuple[int, int, int, int]:
        """Exponents of length, mass, time and temperature in a column's unit; of what was added, none. ``kind`` is the type of particle, as in
        ``species``: by default the gas, or the first type where there is none."""
        return self._exponents.get((self._kind if kind is None else kind, name), _NONE)  # type: ignore[return-value]

    def to_cgs(self, name: str, kind: int | None = None) -> float:
        """What one of the column's numbers is in cgs."""
        units = self.header["units"]
        scales = (units["length"], units["mass"], units["time"], units["temperature"])
        return float(np.prod([scale**e for scale, e in zip(scales, self.exponents(name, kind))]))

    def _in_cgs(self, name: str, kind: int | None) -> np.ndarray:
        """In double precision: masses of galaxies in grams are beyond single."""
        column = self[name] if kind is None else self.species[kind][name]
        return column.astype(float) * self.to_cgs(name, kind)

    def unyt(self, name: str, kind: int | None = None) -> Any:
        """A column of a type as an array of ``unyt``, in cgs."""
        import unyt

        length, mass, time, temperature = self.exponents(name, kind)
        unit = unyt.cm**length * unyt.g**mass * unyt.s**time * unyt.K**temperature
        return unyt.unyt_array(self._in_cgs(name, kind), unit)

    def astropy(self, name: str, kind: int | None = None) -> Any:
        """A column of a type as a quantity of ``astropy``, in cgs."""
        from astropy import units

        length, mass, time, temperature = self.exponents(name, kind)
        unit = units.cm**length * units.g**mass * units.s**time * units.K**temperature
        return units.Quantity(self._in_cgs(name, kind), unit)

    # -- files and codes

    def _data(self) -> list[tuple[int, list[tuple[str, np.ndarray, tuple[int, ...]]]]]:
        return [
            (kind, [(name, array, self._exponents.get((kind, name), _NONE)) for name, array in columns.items()])
            for kind, columns in self.species.items()
        ]

    def write(
        self, path: str | os.PathLike[str], format: str | None = None, *, double: bool | None = None, compression: int = 4
    ) -> None:
        """Writes a file in the format named (``sph-prep formats`` lists them), else in that of the scene, of its target code, or of the file's extension.
        ``double`` is by default what the scene says. A warning says where coordinates had to be moved: codes have the corner of the box at the origin."""
        path = os.fspath(path)
        for note in _core.write(path, self.header, self._data(), self.scene, format, (double, compression)):
            warnings.warn(note, stacklevel=2)

    def check(self, code: str) -> list[dict[str, str]]:
        """What a simulation code will make of the particles: a list of ``level``, ``what`` and ``text``."""
        data = self._data()
        for kind, columns in data:
            # As the writers do it.
            if kind == 0 and "Velocities" not in self:
                columns.append(("Velocities", np.zeros_like(self.positions, dtype=float), (1, 0, -1, 0)))
        return json.loads(_core.check(self.header, data, code))

    # -- other packages

    def to_yt(self) -> Any:
        """The gas as a data set of ``yt``."""
        import yt

        columns = {"Coordinates": None, "Velocities": None}
        data: dict[Any, Any] = {}
        places = np.zeros((len(self), 3))
        places[:, : self.dimension] = self.positions
        speeds = np.zeros((len(self), 3))
        speeds[:, : self.dimension] = self.velocities
        for k, axis in enumerate("xyz"):
            data["io", f"particle_position_{axis}"] = places[:, k]
            data["io", f"particle_velocity_{axis}"] = speeds[:, k]
        names = {"Masses": "particle_mass", "Density": "density", "SupportRadius": "smoothing_length"}
        for name, array in self.gas.items():
            if name not in columns and array.ndim == 1:
                data["io", names.get(name, name)] = array.astype(float)
        units = self.header["units"]
        corner = self.header.get("box_corner") or (0.0, 0.0, 0.0)
        sizes = [size if size > 0.0 else 1.0 for size in self.header["box_size"]]
        edges = [[start, start + size] for start, size in zip(corner, sizes, strict=True)]
        return yt.load_particles(
            data,
            length_unit=units["length"],
            mass_unit=units["mass"],
            time_unit=units["time"],
            bbox=np.array(edges),
            periodicity=tuple(self.header["periodic"]),
        )

    def to_swiftsimio(self, path: str | os.PathLike[str] | None = None) -> Any:
        """The particles as a data set of ``swiftsimio``, which reads files: a SWIFT file is written to ``path``, or to a folder that is removed
        when Python ends. SWIFT's gas has internal energies: carry a pressure or the like, or set ``thermal``."""
        import swiftsimio

        if path is None:
            # Columns are read when they are asked for, be the data set there or not.
            _FOLDERS.append(tempfile.TemporaryDirectory(prefix="sph-prep-"))
            path = os.path.join(_FOLDERS[-1].name, "particles.hdf5")
        self.write(path, "swift")
        return swiftsimio.load(os.fspath(path))

    def to_pynbody(self) -> Any:
        """The gas as a snapshot of ``pynbody``, or the first type as its dark matter where there is no gas."""
        import pynbody

        units = self.header["units"]
        family = "gas" if self._kind == 0 else "dm"
        snapshot = pynbody.new(**{family: len(self)})
        snapshot["pos"][:, : self.dimension] = self.positions
        snapshot["vel"][:, : self.dimension] = self.velocities
        snapshot["mass"] = self.masses
        snapshot["pos"].units = pynbody.units.Unit(f"{units['length']:.15e} cm")
        snapshot["vel"].units = pynbody.units.Unit(f"{units['length'] / units['time']:.15e} cm s^-1")
        snapshot["mass"].units = pynbody.units.Unit(f"{units['mass']:.15e} g")
        if "Density" in self and family == "gas":
            snapshot.gas["rho"] = self.density
            unit = f"{units['mass'] / units['length'] ** self.dimension:.15e} g cm^-{self.dimension}"
            snapshot.gas["rho"].units = pynbody.units.Unit(unit)
        return snapshot

    def to_sarracen(self) -> Any:
        """The gas as a data frame of ``sarracen``."""
        import sarracen

        data = {axis: self.positions[:, k] for k, axis in enumerate("xyz"[: self.dimension])}
        data.update({f"v{axis}": self.velocities[:, k] for k, axis in enumerate("xyz"[: self.dimension])})
        data.update({"m": self.masses, "rho": self.density, "h": 0.5 * self.support_radius})
        own = ("Masses", "Density", "SupportRadius")
        data.update({name: a for name, a in self.gas.items() if a.ndim == 1 and name not in own})
        return sarracen.SarracenDataFrame(data)

    # -- in words and pictures

    def __repr__(self) -> str:
        words = [f"{len(self)} particles in {self.dimension}-D"]
        if "Masses" in self:
            words.append(f"mass {self.masses.sum(dtype=float):.6g}")
        errors = self.report.get("density_error", {})
        error = errors.get("smoothed") or errors.get("all")
        if error:
            # Against the target as the kernel can follow it: at a jump, the other is as large as the jump.
            words.append(f"mean density error {100 * error['mean']:.2g} %")
        return f"<sph_prep.Particles: {', '.join(words)}; {', '.join(self.keys())}>"

    @property
    def verdict(self) -> list[dict[str, str]]:
        """What is good and what to look at, as the report says it: ``grade`` (good, look or bad), ``topic`` and ``text``, for bodies with their
        ``body``; empty for particles that were read."""
        if "bodies" not in self.report:
            return list(self.report.get("verdict", []))
        bodies = [body for body in self.report["bodies"] if body.get("report")]
        return [{**line, "body": body["name"]} for body in bodies for line in body["report"].get("verdict", [])]

    def _repr_html_(self) -> str:
        def cell(text: Any) -> str:
            return f"<td style='text-align:left'>{html.escape(str(text))}</td>"

        rows = "".join(
            f"<tr>{cell(_MARKS.get(line['grade'], line['grade']))}"
            f"{cell(' '.join(filter(None, (line.get('body'), line['topic']))))}{cell(line['text'])}</tr>"
            for line in self.verdict
        )
        verdict = f"<table>{rows}</table>" if rows else ""
        notes = "".join(f"<li>{html.escape(note)}</li>" for note in self.report.get("notes", []))
        notes = f"<details><summary>notes</summary><ul>{notes}</ul></details>" if notes else ""
        return f"<p>{html.escape(repr(self)[1:-1])}</p>{picture(self)}{verdict}{notes}"


#: In front of a line of the verdict; told apart without colors.
_MARKS = {"good": "good", "look": "LOOK", "bad": "BAD"}


def read(path: str | os.PathLike[str], format: str | None = None) -> Particles:
    """Particles of a file in any format that the program reads."""
    header, species = _core.read(os.fspath(path), format)
    return Particles(header, species, None, None)
