"""Scenes: what to place particles in, as Python objects."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import tempfile
import warnings
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from . import _core
from ._particles import Particles
from ._sampling import sampled

#: Mean error of a function's samples above which a warning says so.
ROUGH = 0.01

#: Calls between the user and the warning: this module's and those of :mod:`contextlib`.
_OUTSIDE = 5

#: Names of arguments that are keys of a scene under another name.
_KEYS = {"n": "particles"}


class Scene:
    """A scene: the keys of the program's YAML files, checked as they are set.

    Arguments:
        source: a dictionary of keys, YAML as a text, or the path of a YAML file, from whose folder its relative paths count.
        keys: further keys, which win over those of ``source``; of sections, key by key.

    >>> scene = Scene({"input": {"expression": "1 + x"}}, domain={"box": [[0], [1]]}, particles=50)
    >>> len(scene.place())
    50
    """

    def __init__(self, source: Mapping[str, Any] | str | os.PathLike[str] | None = None, **keys: Any) -> None:
        keys = {_KEYS.get(key, key): value for key, value in keys.items()}
        if source is None or isinstance(source, Mapping):
            text = _to_json(source or {})
        else:
            is_path = isinstance(source, os.PathLike) or str(source).endswith((".yaml", ".yml"))
            text = _core.scene_of_file(os.fspath(source)) if is_path else str(source)
        if keys:
            # Keys that follow win; the core knows them all.
            text = _core.scene_with(text, _to_json(keys))
        self._text = text
        self.yaml = _core.scene_yaml(text)
        """The scene with all that it sets."""

    def place(self, progress: Callable[[str], Any] | None = None) -> Particles:
        """Places the particles. ``progress`` is called with a line of text several times a second. The page that ``output.report`` names is
        written; ``output.file`` and ``output.parameters`` are not, and a note of the report says so: :meth:`Particles.write` writes files.

        Raises:
            SceneError: the scene asks for something impossible or contradictory.
            OSError: an input cannot be read.
            SphPrepError: anything else that keeps particles from being placed.
        """
        header, species, report, scene = _core.place(self._text, progress)
        return Particles(header, species, json.loads(report), scene)

    def __repr__(self) -> str:
        return self.yaml

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Scene) and self.yaml == other.yaml

    __hash__ = None  # type: ignore[assignment]


def place(
    density: Any = None,
    *,
    n: int | None = None,
    box: Any = None,
    ball: Mapping[str, Any] | None = None,
    periodic: bool | list[bool] | None = None,
    kernel: str | None = None,
    neighbors: float | None = None,
    target_code: str | None = None,
    samples: int | None = None,
    page: str | os.PathLike[str] | None = None,
    progress: Callable[[str], Any] | None = None,
    **keys: Any,
) -> Particles:
    """Places particles in a density.

    Arguments:
        density: one of

            - an expression of x, y, z and r (``"1 + 0.5*sin(2*pi*x)"``), or the path of a file that the program reads;
            - an array of one to three axes: averages of equal cells of ``box`` (by default from 0 to 1);
            - a function of as many arrays as the box has axes, which returns the density there: it is sampled on a grid that is
              refined until linear interpolation meets it to 0.1 % on average; ``report["sampling"]`` has what was reached,
              and a warning says so above 1 %;
            - a dictionary with ``radius``, ``density`` and further columns (``pressure``, ``temperature``...): a radial profile.
        n: number of particles.
        box: lowest and highest corner, ``[[0, 0], [1, 1]]``.
        ball: ``{"center": [...], "radius": ...}`` in place of a box.
        periodic: of all axes, or one by one.
        kernel, neighbors: name of the kernel and V n H^d, its number of neighbors.
        target_code: the code that the particles are for, as ``"swift"``.
        samples: points along an axis of a function's grid, in place of refinement.
        page: HTML file for the page of the run: verdict, pictures, figures, plan and scene.
        progress: called with a line of text several times a second.
        keys: further keys of a scene, as ``balance={}`` or ``output={"units": "cgs"}``.

    Arrays with units (unyt, astropy) are taken as cgs.

    >>> import numpy as np
    >>> particles = place(lambda x, y: 1 + 0.5 * np.cos(2 * np.pi * x), n=500, box=[[0, 0], [1, 1]], periodic=True)
    >>> bool(abs(particles.masses.sum() - 1) < 1e-5)
    True
    """
    named = {"n": n, "box": box, "ball": ball, "periodic": periodic, "samples": samples, "page": page}
    named |= {"kernel": kernel, "neighbors": neighbors, "target_code": target_code}
    with scene_of(density, named, keys) as (scene, sampling):
        particles = scene.place(progress)
    if sampling is not None:
        particles.report["sampling"] = sampling
    return particles


#: What is taken for the name of a file: no expression ends so.
_FILE = re.compile(r"[\w./\\~ -]*\.[A-Za-z][A-Za-z0-9]{0,5}")

#: Arguments that are keys at the top of a scene.
_TOP = {"n": "particles", "kernel": "kernel", "neighbors": "neighbors", "target_code": "target_code"}


@contextlib.contextmanager
def scene_of(
    density: Any, named: Mapping[str, Any], keys: Mapping[str, Any]
) -> Iterator[tuple[Scene, dict[str, Any] | None]]:
    """The scene for arguments of :func:`place`, and how well a function was sampled. What is no file becomes one, which is removed at the
    end; errors say ``density`` in its place."""
    with contextlib.ExitStack() as stack:
        scene = dict(keys)
        domain = dict(scene.pop("domain", {}))
        if named.get("box") is not None:
            domain["box"] = _plain(named["box"])
        if named.get("ball") is not None:
            domain["ball"] = _plain(named["ball"])
        periodic = _plain(named.get("periodic"))
        if periodic is not None:
            flags = periodic if isinstance(periodic, (list, tuple)) else [periodic]
            if not all(isinstance(flag, bool) for flag in flags):
                raise _core.SceneError(
                    f"periodic: is {periodic!r}; expected True or False, or one of these for each axis. Other walls go into "
                    "domain={'boundary': ...}"
                )
            domain["boundary"] = ["periodic" if flag else "open" for flag in flags]
        given = dict(scene.pop("input", {}))
        made, sampling = _input(density, domain, named.get("samples"), stack)
        given.update(made)
        if given:
            scene["input"] = given
        if domain:
            scene["domain"] = domain
        if named.get("page") is not None:
            scene["output"] = {**scene.get("output", {}), "report": os.fspath(named["page"])}
        scene.update({key: named[name] for name, key in _TOP.items() if named.get(name) is not None})
        try:
            yield Scene(scene), sampling
        except (_core.SceneError, _core.SphPrepError, OSError) as error:
            if isinstance(density, (str, os.PathLike)) or "file" not in made:
                raise
            raise type(error)(str(error).replace(made["file"], "density")) from None


def _input(
    density: Any, domain: dict[str, Any], samples: int | None, stack: contextlib.ExitStack
) -> tuple[dict[str, Any], dict[str, Any] | None]:
    """The scene's ``input`` for a density, and how well a function was sampled. What is no file becomes one in a folder that
    ``stack`` removes."""
    if density is None:
        return {}, None
    if isinstance(density, str):
        if os.path.exists(density):
            return {"file": density}, None
        if _FILE.fullmatch(density):
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), density)
        return {"expression": density}, None
    if isinstance(density, os.PathLike):
        return {"file": os.fspath(density)}, None
    folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="sph-prep-")))
    if isinstance(density, Mapping):
        return {"file": str(_write_profile(density, folder / "profile.csv"))}, None
    sampling = None
    if callable(density):
        grid, edges, sampling = sampled(density, _corners(domain), samples, _periodic(domain))
        if sampling["mean_error"] > ROUGH:
            warnings.warn(
                f"the function is sampled on {sampling['cells']} cells, from which linear interpolation misses it by "
                f"{100 * sampling['mean_error']:.1f} % on average; more samples, or an expression, follow it better",
                stacklevel=_OUTSIDE,
            )
    else:
        if np.ma.is_masked(density):
            raise _core.SceneError(
                f"density: {np.ma.count_masked(density)} values of the array are masked; fill them first, as by density.filled(0)"
            )
        grid = np.asarray(_plain_array(density), dtype=float)
        if grid.ndim not in (1, 2, 3) or 0 in grid.shape:
            raise _core.SceneError(f"density: an array of shape {grid.shape}; expected one to three axes, none of them empty")
        is_stated = "box" in domain or "ball" in domain
        low, high = _corners(domain, grid.ndim) if is_stated else ([0.0] * grid.ndim, [1.0] * grid.ndim)
        if len(low) != grid.ndim:
            raise _core.SceneError(f"density: an array of {grid.ndim} axes in a box of {len(low)}; expected as many")
        edges = [np.linspace(a, b, cells + 1) for a, b, cells in zip(low, high, grid.shape)]
    file = folder / "density.npz"
    np.savez(file, density=grid, **dict(zip("xyz", edges)))
    return {"file": str(file)}, sampling


def _corners(domain: Mapping[str, Any], dimension: int | None = None) -> tuple[list[float], list[float]]:
    """The lowest and the highest corner of what the domain is in."""
    if "box" not in domain and "ball" not in domain:
        raise _core.SceneError("density: a function needs to know where it is defined; set box or ball")
    try:
        if "ball" in domain:
            radius = float(domain["ball"]["radius"])
            center = domain["ball"].get("center", None if dimension is None else [0.0] * dimension)
            if center is None:
                raise _core.SceneError("ball: has no center, which tells how many axes the function has; set it")
            return [float(c) - radius for c in center], [float(c) + radius for c in center]
        low, high = ([float(x) for x in corner] for corner in domain["box"])
    except (KeyError, TypeError, ValueError) as error:
        raise _core.SceneError(
            f"domain: what is sampled needs plain numbers for the corners of its box, or center and radius of its ball ({error})"
        ) from None
    if len(low) != len(high) or not all(a < b for a, b in zip(low, high)):
        raise _core.SceneError(f"domain.box: is {[low, high]}; expected the lowest corner first")
    return low, high


def _periodic(domain: Mapping[str, Any]) -> bool:
    boundary = domain.get("boundary", [])
    return bool(boundary) and all(wall == "periodic" for wall in boundary)


def _write_profile(columns: Mapping[str, Any], file: Path) -> Path:
    """A radial profile as a table; every digit is kept."""
    arrays = {name: np.asarray(_in_unit(name, values), dtype=float) for name, values in columns.items()}
    for name in ("radius", "density"):
        if name not in arrays:
            raise _core.SceneError(f"density: a profile without '{name}'; its columns are {', '.join(arrays)}")
    shapes = {array.shape for array in arrays.values()}
    if len(shapes) != 1 or len(next(iter(shapes))) != 1:
        raise _core.SceneError(f"density: columns of shapes {sorted(shapes)}; expected one length for all")
    rows = np.column_stack(list(arrays.values()))
    header = ",".join(_with_unit(name, columns[name]) for name in arrays)
    with file.open("w") as out:
        out.write(header + "\n")
        out.writelines(",".join(repr(float(v)) for v in row) + "\n" for row in rows)
    return file


#: Units in which arrays with units are written.
_CGS = {"radius": "cm", "density": "g/cm^3", "pressure": "dyn/cm^2", "temperature": "K", "internal_energy": "erg/g"}


def _with_unit(name: str, values: Any) -> str:
    return f"{name} [{_CGS[name]}]" if _has_unit(values) and name in _CGS else name


def _in_unit(name: str, values: Any) -> Any:
    """Numbers of a profile's column in the unit that is written beside it."""
    if not (_has_unit(values) and name in _CGS):
        return _plain_array(values)
    try:
        return values.to(_CGS[name].replace("^", "**")).value
    except Exception as error:  # of whichever package it is
        raise _core.SceneError(f"density: '{name}' is no {_CGS[name]}: {error}") from None


def _has_unit(values: Any) -> bool:
    return hasattr(values, "in_cgs") or hasattr(values, "cgs")


def _plain_array(values: Any) -> Any:
    """Numbers without their unit, in cgs."""
    if hasattr(values, "in_cgs"):
        return values.in_cgs().value
    if hasattr(values, "cgs"):
        return values.cgs.value
    return values


def _plain(value: Any) -> Any:
    """Numbers and lists in place of NumPy's."""
    value = _plain_array(value)
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return value


def _to_json(scene: Mapping[str, Any]) -> str:
    try:
        return json.dumps(_plain(scene), allow_nan=False)
    except ValueError as error:
        raise _core.SceneError(f"scene: {error}; expected finite numbers, texts, lists and dictionaries") from None
