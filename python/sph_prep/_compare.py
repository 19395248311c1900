"""Methods side by side on one scene, as the program's ``compare``."""

from __future__ import annotations

import base64
import html
import json
import os
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from . import _core
from ._scene import Scene, scene_of

#: What is a figure on its own, among the files of a comparison.
_FIGURE = "error-against-time.svg"

#: Headings of the table, and what they are in a row.
_COLUMNS = {
    "method": "method",
    "particles": "particles",
    "mean density error [%]": "mean_error",
    "largest [%]": "max_error",
    "force noise [% of random]": "noise",
    "time [s]": "seconds",
}


class Comparison:
    """What :func:`compare` found. A notebook shows it as a table with a figure."""

    def __init__(self, text: str, advice: str | None, files: dict[str, bytes]) -> None:
        self.report: dict[str, Any] = json.loads(files["compare.json"])
        """All that the program's ``compare.json`` has: methods, runs with their steps and states, and what was left out."""
        self.advice = advice
        """Which method to take and why, where several ran."""
        self.text = text
        """The table as the program prints it."""
        self._files = files

    @property
    def rows(self) -> list[dict[str, Any]]:
        """What came out of each method for each number of particles: ``method``, ``particles``, ``mean_error`` and ``max_error`` of the
        density with the mass re-fitted, over the interior where there is one, ``noise`` as a share of a random set's, ``seconds`` and
        ``stop``."""
        rows = []
        for run in self.report["runs"]:
            if not run["states"]:
                continue
            last = run["states"][-1]
            error = last["density_error"]["interior_refitted"] or last["density_error"]["all_refitted"]
            noise = last["noise"]["interior"]
            rows.append(
                {
                    "method": run["method"],
                    "particles": run["particles"],
                    "mean_error": error["mean"],
                    "max_error": error["max"],
                    "noise": last["noise"]["all"] if noise is None else noise,
                    "seconds": run["seconds"],
                    "stop": run["stop"],
                }
            )
        return rows

    def write(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Writes the files of the program's ``compare`` into a folder, which is made if need be: the table (``compare.csv``), everything
        (``compare.json``), a page (``report.html``) and figures. Returns their paths."""
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in self._files.items():
            (folder / name).write_bytes(content)
        return [folder / name for name in self._files]

    def __repr__(self) -> str:
        return self.text.rstrip()

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{html.escape(name)}</th>" for name in _COLUMNS)
        body = "".join(
            "<tr>" + "".join(f"<td>{_cell(key, row[key])}</td>" for key in _COLUMNS.values()) + "</tr>" for row in self.rows
        )
        advice = f"<p>{html.escape(self.advice)}</p>" if self.advice else ""
        drawn = base64.b64encode(self._files.get(_FIGURE, b"")).decode()
        # As a picture of its own: its styles are no business of the notebook.
        figure = f'<img width="560" alt="error against time" src="data:image/svg+xml;base64,{drawn}"/>' if drawn else ""
        return f"<table><tr>{head}</tr>{body}</table>{advice}{figure}"


def _cell(key: str, value: Any) -> str:
    if key in ("mean_error", "max_error", "noise"):
        return f"{100 * value:.3g}"
    return html.escape(f"{value:.2f}" if isinstance(value, float) else str(value))


def compare(
    density: Any = None,
    *,
    methods: str | Iterable[str] | None = None,
    n: int | Iterable[int] | None = None,
    progress: Callable[[str], Any] | None = None,
    **keys: Any,
) -> Comparison:
    """Runs one scene through several methods, one after the other.

    Arguments:
        density: a :class:`Scene`, or what :func:`place` takes.
        methods: names as in ``sph-prep methods``, each with another seeding as ``"solver:shells"``; by default ``seed``, ``wvt``,
            ``wvt-inverse-square``, ``alaric`` and ``solver``.
        n: one or several numbers of particles; by default the scene's, or 1000 and 10000.
        progress: called with a line of text several times a second; an exception ends the comparison.
        keys: arguments of :func:`place` (``box``, ``periodic``, ``kernel``...) and further keys of a scene.

    Raises:
        SceneError: no such method, or a scene that is not of one body of gas.

    >>> found = compare("1 + 0.5*sin(2*pi*x)", n=300, box=[[0], [1]], periodic=True, methods=["seed", "solver"])
    >>> [row["method"] for row in found.rows]
    ['seed', 'solver']
    >>> found.rows[1]["mean_error"] < found.rows[0]["mean_error"]
    True
    """
    listed = methods if methods is None or isinstance(methods, str) else ",".join(methods)
    counts = _counts(n)
    if isinstance(density, Scene):
        return _run(Scene(density._text, **keys) if keys else density, listed, counts, progress)
    given = {name: keys.pop(name) for name in _ARGUMENTS if name in keys}
    with scene_of(density, given, keys) as (scene, _):
        return _run(scene, listed, counts, progress)


def _counts(n: Any) -> list[int]:
    """Whole numbers of one or several, also of ``1e4``."""
    if n is None:
        return []
    listed = list(n) if isinstance(n, Iterable) and not isinstance(n, str) else [n]
    for count in listed:
        if isinstance(count, str) or not (0 <= count < 2**32 and count == int(count)):
            raise _core.SceneError(f"n: is {count!r}; expected whole numbers from 1 to {2**32 - 1}")
    return [int(count) for count in listed]


#: Arguments of ``place`` that are no keys of a scene, or are called otherwise there.
_ARGUMENTS = ("box", "ball", "periodic", "kernel", "neighbors", "target_code", "samples")


def _run(scene: Scene, methods: str | None, counts: list[int], progress: Callable[[str], Any] | None) -> Comparison:
    with tempfile.TemporaryDirectory(prefix="sph-prep-") as folder:
        text, advice = _core.compare(scene._text, methods, counts, folder, progress)
        files = {path.name: path.read_bytes() for path in sorted(Path(folder).iterdir())}
    return Comparison(text, advice, files)
