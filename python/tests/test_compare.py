"""Methods side by side."""

import json
import subprocess
import sys
import threading
import time

import pytest
import sph_prep

WAVE = "1 + 0.5*sin(2*pi*x)"
BOX = {"box": [[0, 0], [1, 1]], "periodic": True}


@pytest.fixture(scope="module")
def found():
    return sph_prep.compare(WAVE, methods=["seed", "wvt", "solver:random"], n=[400, 200], **BOX)


def test_every_method_has_a_row_for_every_number(found):
    names = [(row["method"], row["particles"]) for row in found.rows]
    assert names == [(m, n) for n in (200, 400) for m in ("seed", "wvt", "solver:random")]
    errors = {name: row["mean_error"] for name, row in zip(names, found.rows)}
    assert errors["solver:random", 400] < errors["wvt", 400] < errors["seed", 400]
    assert all(row["seconds"] >= 0 and row["noise"] >= 0 for row in found.rows)
    assert "solver:random" in found.advice and "solver:random" in repr(found)


def test_it_says_what_the_program_says(found, tmp_path):
    scene = tmp_path / "scene.yaml"
    scene.write_text(f"input: {{expression: '{WAVE}'}}\ndomain: {{box: [[0, 0], [1, 1]], boundary: [periodic]}}\n")
    arguments = ["--scene", str(scene), "-n", "200,400", "--methods", "seed,wvt,solver:random", "--out", str(tmp_path / "out")]
    subprocess.run([sys.executable, "-m", "sph_prep", "compare", *arguments, "--quiet"], check=True)
    program = json.loads((tmp_path / "out" / "compare.json").read_text())
    for ours, its in zip(found.report["runs"], program["runs"], strict=True):
        assert ours["method"] == its["method"]
        assert [s["density_error"] for s in ours["states"]] == [s["density_error"] for s in its["states"]]


def test_files_are_those_of_the_program(found, tmp_path):
    paths = found.write(tmp_path / "new" / "folder")
    assert {p.name for p in paths} >= {"compare.csv", "compare.json", "report.html", "error-against-time.svg"}
    assert all(p.stat().st_size > 100 for p in paths)
    assert json.loads((tmp_path / "new" / "folder" / "compare.json").read_text()) == found.report


def test_a_notebook_shows_a_table_and_a_figure(found):
    text = found._repr_html_()
    assert text.count("<tr>") == 7 and "image/svg+xml;base64," in text and "solver:random" in text and "[%]" in text


def test_scenes_and_functions_are_compared_as_well():
    scene = sph_prep.Scene({"input": {"expression": WAVE}, "domain": {"box": [[0], [1]]}}, n=100)
    assert {row["particles"] for row in sph_prep.compare(scene, methods="seed").rows} == {100}
    changed = sph_prep.compare(scene, methods="seed", seed=5)
    assert changed.report["seed"] == 5 and changed.advice is None
    assert sph_prep.compare(scene, methods="seed", n=1e2).rows[0]["particles"] == 100
    own = sph_prep.compare(lambda x: 1 + x, methods="seed,wvt", n=50, box=[[0], [1]], kernel="cubic-spline")
    assert "ubic spline" in own.report["kernel"]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: sph_prep.compare(WAVE, methods="wtv", n=10, **BOX), "wtv"),
        (lambda: sph_prep.compare(WAVE, methods=["wvt", "wvt"], n=10, **BOX), "named twice"),
        (lambda: sph_prep.compare(WAVE, methods=[], n=10, **BOX), "expected"),
        (lambda: sph_prep.compare(WAVE, n=[10, 10], **BOX), "10 twice"),
        (lambda: sph_prep.compare(WAVE, n=0, **BOX), "at least 1"),
        (lambda: sph_prep.compare(WAVE, n=-5, **BOX), "is -5"),
        (lambda: sph_prep.compare(WAVE, n=[1.5], **BOX), "is 1.5"),
        (lambda: sph_prep.compare(WAVE, n=float("nan"), **BOX), "is nan"),
        (lambda: sph_prep.compare(WAVE, n="many", **BOX), "is 'many'"),
        (lambda: sph_prep.compare(WAVE, n=10, kernle="x", **BOX), "kernle"),
        (lambda: sph_prep.compare(sph_prep.Scene({"bodies": [{"name": "a", "input": {"expression": "1"}}]})), "bodies"),
    ],
)
def test_mistakes_are_named(make, words):
    with pytest.raises(sph_prep.SceneError) as raised:
        make()
    assert words in str(raised.value)


def test_an_exception_of_progress_ends_it_while_other_threads_go_on():
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.01)

    def enough(_):
        if len(ticks) > 20:
            raise ZeroDivisionError("enough")

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        with pytest.raises(ZeroDivisionError, match="enough"):
            sph_prep.compare("1 + x", methods="solver", n=100_000, box=[[0] * 3, [1] * 3], progress=enough)
    finally:
        done.set()
        thread.join()
