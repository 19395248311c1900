"""What a user of the module does, against closed forms."""

import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import sph_prep


def wave(x, *others):
    return 2.0 + np.sin(2 * np.pi * x)


def box(d):
    return [[0.0] * d, [1.0] * d]


@pytest.mark.parametrize("d", [1, 2, 3])
@pytest.mark.parametrize("kind", ["expression", "array", "function"])
def test_a_density_of_any_kind_gives_particles_of_its_mass(d, kind):
    cells = {1: 1000, 2: 200, 3: 60}[d]
    middles = (np.arange(cells) + 0.5) / cells
    densities = {
        "expression": "2 + sin(2*pi*x)",
        "array": wave(np.broadcast_to(middles.reshape(-1, *[1] * (d - 1)), (cells,) * d)),
        "function": wave,
    }
    p = sph_prep.place(densities[kind], n=600, box=box(d), periodic=True)
    assert len(p) == 600 and p.positions.reshape(600, -1).shape == (600, d)
    assert p.masses.sum(dtype=float) == pytest.approx(2.0, rel=1e-5)
    assert p.report["density_error"]["all"]["mean"] < 0.03
    x = p.positions.reshape(600, -1)[:, 0]
    # Sum of the particles on the denser half over the whole: 1/2 + 1/(2 pi).
    assert np.mean(x < 0.5) == pytest.approx(0.5 + 0.5 / np.pi, abs=0.02)


def test_a_profile_keeps_its_mass_and_its_energy():
    r = np.linspace(0.0, 1.0, 400)
    rho = np.sinc(r)
    p = sph_prep.place({"radius": r, "density": rho, "pressure": rho**2}, n=2000, output={"units": "code"})
    # The polytrope of index 1: M = 4 pi int sin(pi r)/(pi r) r^2 dr = 4/pi, less an atmosphere that is not resolved.
    assert 0.99 * 4 / np.pi < p.masses.sum(dtype=float) < 4 / np.pi
    rho_at = p["Density"].astype(float)
    inner = np.linalg.norm(p.positions - p.positions.mean(axis=0), axis=1) < 0.6
    energy = p["InternalEnergy"].astype(float)
    assert np.median(energy[inner] / (1.5 * rho_at[inner])) == pytest.approx(1.0, abs=0.02)


def test_units_are_those_of_the_file_and_of_unyt_and_astropy():
    unyt = pytest.importorskip("unyt")
    r = unyt.unyt_array(np.linspace(0.0, 1.0, 200), "Rsun")
    rho = unyt.unyt_array(1.5 - r.value, "g/cm**3")
    p = sph_prep.place({"radius": r, "density": rho}, n=500)
    mass = p.unyt("Masses").sum()
    sun = float(unyt.unyt_quantity(1, "Rsun").to("cm").value)
    assert float(mass.to("g").value) == pytest.approx(4 * np.pi * (1.5 / 3 - 1 / 4) * sun**3, rel=2e-3)
    astropy = pytest.importorskip("astropy.units")
    assert p.astropy("Masses").sum().to_value(astropy.g) == pytest.approx(float(mass.to("g").value), rel=1e-6)


def test_what_is_written_is_what_is_read_back_with_what_was_changed(tmp_path):
    p = sph_prep.place("1 + x", n=300, box=box(2), thermal={"internal_energy": 1.0})
    p["Velocities"] = np.column_stack([p.positions[:, 1], -p.positions[:, 0]])
    p["Tag"] = np.arange(300)
    for name in ("ic.hdf5", "ic.npz", "ic.vtu", "ic.csv"):
        file = tmp_path / name
        p.write(file, double=True)
        q = sph_prep.read(file)
        assert q.dimension == 2 and len(q) == 300
        assert np.array_equal(q.positions, p.positions)
        assert np.allclose(q.velocities, p["Velocities"], rtol=0, atol=1e-15)
        assert np.array_equal(q["Tag"], np.arange(300))
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "ic.hdf5") as f:
        assert f["PartType0/Coordinates"].shape == (300, 3)


def test_scenes_are_the_programs_own(tmp_path):
    yaml = "input: {expression: '1 + x'}\ndomain: {box: [[0], [1]]}\nparticles: 100\n"
    file = tmp_path / "scene.yaml"
    file.write_text(yaml)
    scene = sph_prep.Scene(file)
    assert scene == sph_prep.Scene(yaml) == sph_prep.Scene({"input": {"expression": "1 + x"}}, domain={"box": [[0], [1]]}, n=100)
    changed = sph_prep.Scene(file, n=50, output={"units": "cgs"})
    assert len(changed.place()) == 50 and "1 + x" in changed.yaml and "cgs" in changed.yaml
    one, two = scene.place(), scene.place()
    assert np.array_equal(one.positions, two.positions), "the same scene gives the same particles"


@pytest.mark.parametrize(
    ("make", "error", "words"),
    [
        (lambda: sph_prep.place("1 + ", n=10, box=box(1)), sph_prep.SceneError, "expression"),
        (lambda: sph_prep.place("1", n=10, box=box(1), kernle="x"), sph_prep.SceneError, "kernle"),
        (lambda: sph_prep.place(np.ones((4, 0)), n=10), sph_prep.SceneError, "shape (4, 0)"),
        (lambda: sph_prep.place(np.full((4, 4), np.nan), n=10), Exception, "finite"),
        (lambda: sph_prep.place(-np.ones((4, 4)), n=10), Exception, "negative"),
        (lambda: sph_prep.place(wave, n=10), sph_prep.SceneError, "set box or ball"),
        (lambda: sph_prep.place(lambda x: x[:3], n=10, box=box(1)), sph_prep.SceneError, "shape (3,)"),
        (lambda: sph_prep.place({"radius": [1, 2]}, n=10), sph_prep.SceneError, "without 'density'"),
        (lambda: sph_prep.place("1", n=10, box=[[0], [float("nan")]]), sph_prep.SceneError, "finite"),
        (lambda: sph_prep.read("there/is/none.hdf5"), OSError, "none.hdf5"),
        (lambda: sph_prep.place("1", n=10, box=box(1)).check("swfit"), sph_prep.SceneError, "swfit"),
        (lambda: sph_prep.place("1", n=10, box=box(1))["Mases"], KeyError, "Masses"),
    ],
)
def test_mistakes_are_named(make, error, words):
    with pytest.raises(error) as raised:
        make()
    assert words in str(raised.value)


def test_an_array_that_is_refused_is_called_density():
    with pytest.raises(Exception) as raised:
        sph_prep.place(-np.ones((4, 4)), n=10)
    assert "file 'density'" in str(raised.value) and "sph-prep-" not in str(raised.value)


def test_a_jump_is_judged_by_what_the_kernel_can_follow():
    p = sph_prep.place("if(x < 0.5, 1e6, 1)", n=500, box=box(2))
    error = p.report["density_error"]["smoothed"]["mean"]
    assert f"mean density error {100 * error:.2g} %" in repr(p)


def test_bodies_are_put_together():
    star = {"profile": {"polytrope": {"n": 1.5, "mass": "1 Msun", "radius": "1 Rsun"}}}
    scene = {
        "bodies": [{"name": "one", "input": star}, {"name": "two", "input": star}],
        "orbit": {"semi_major_axis": "4 Rsun", "eccentricity": 0.0},
    }
    p = sph_prep.Scene(scene, n=600).place()
    assert sorted(set(p["BodyID"])) == [1, 2] and len(p) == 600
    momentum = (p.masses[:, None] * p.velocities).sum(axis=0, dtype=float)
    assert np.abs(momentum).max() < 1e-5 * (p.masses[:, None] * np.abs(p.velocities)).sum(dtype=float)


def test_a_function_says_how_well_it_is_sampled():
    p = sph_prep.place(lambda x, y: 1 + 0.1 * x, n=100, box=box(2))
    assert p.report["sampling"]["mean_error"] < 1e-12
    with pytest.warns(UserWarning, match="sampled on .* cells") as warned:
        p = sph_prep.place(lambda x: 1.01 + np.sin(300 * x), n=100, box=box(1), samples=32)
    assert p.report["sampling"]["cells"] == [32]
    assert warned[0].filename == __file__, "the warning is about the user's line"


def test_a_code_says_what_it_makes_of_particles():
    findings = sph_prep.place("1", n=500, box=box(3), periodic=True, target_code="swift").check("swift")
    assert all(f["level"] != "error" for f in findings), findings
    bad = sph_prep.place("1", n=500, box=box(3), periodic=True, target_code="swift")
    bad["Masses"] = -bad.masses
    assert any(f["level"] == "error" and f["what"] == "Masses" for f in bad.check("swift"))


def test_other_threads_go_on_and_progress_is_told():
    ticks, lines, done = [], [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.01)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        sph_prep.place("1 + x", n=20_000, box=box(3), progress=lines.append)
    finally:
        done.set()
        thread.join()
    assert len(ticks) > 10 and any("solver" in line or "wvt" in line for line in lines)


def test_an_exception_of_progress_ends_the_run():
    def enough(_):
        raise ZeroDivisionError("enough")

    with pytest.raises(ZeroDivisionError, match="enough"):
        sph_prep.place("1 + x", n=100_000, box=box(3), progress=enough)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are others there")
def test_ctrl_c_ends_a_run():
    code = (
        "import sph_prep\n"
        "print('begun', flush=True)\n"
        "sph_prep.place('1 + x', n=3_000_000, box=[[0]*3, [1]*3])\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "begun\n"
    time.sleep(1.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode != 0 and "KeyboardInterrupt" in errors


def test_a_page_of_the_run_is_written(tmp_path):
    page = tmp_path / "ic.html"
    p = sph_prep.place("1 + x", n=200, box=box(2), page=page)
    text = page.read_text()
    assert text.startswith("<!DOCTYPE html>") and "Verdict" in text and "<svg" in text
    assert {line["topic"] for line in p.verdict} >= {"density", "pairs"}
    star = {"profile": {"polytrope": {"n": 1.5, "mass": 1, "radius": 1}}}
    scene = {"bodies": [{"name": "one", "input": star}], "output": {"report": str(tmp_path / "bodies.html")}}
    p = sph_prep.Scene(scene, n=300).place()
    assert "one" in (tmp_path / "bodies.html").read_text() and {line["body"] for line in p.verdict} == {"one"}
    with pytest.raises(OSError, match="nowhere"):
        sph_prep.place("1 + x", n=200, box=box(2), page=tmp_path / "nowhere" / "ic.html")


def test_a_notebook_shows_verdict_units_and_notes():
    r = np.linspace(0.0, 1.0, 100)
    units = {"length_unit": "Rsun", "density_unit": "g/cm^3"}
    p = sph_prep.place({"radius": r, "density": 1.5 - r}, n=400, input=units)
    text = p._repr_html_()
    assert "g/cm^3]" in text and " cm]" in text and "<td" in text and "density" in text
    assert all(f"{line['text'][:20]}" in text.replace("&#x27;", "'") for line in p.verdict)


def test_pictures_are_drawn_in_every_dimension():
    for d in (1, 2, 3):
        text = sph_prep.place("1 + x", n=200, box=box(d))._repr_html_()
        assert text.count("<circle") > 20 and "nan" not in text


def test_the_program_comes_with_the_wheel(tmp_path):
    out = tmp_path / "ic.hdf5"
    scene = tmp_path / "scene.yaml"
    scene.write_text("input: {expression: '1 + x'}\ndomain: {box: [[0], [1]]}\nparticles: 100\n")
    run = subprocess.run(
        [sys.executable, "-m", "sph_prep", "--scene", str(scene), "--out", str(out), "--quiet"], capture_output=True, text=True
    )
    assert run.returncode == 0, run.stderr
    assert len(sph_prep.read(out)) == 100
    wrong = subprocess.run([sys.executable, "-m", "sph_prep", "--scene", str(out)], capture_output=True, text=True)
    assert wrong.returncode in (1, 2) and wrong.stderr.startswith("error: ")


def test_files_are_in_the_flavor_of_the_scenes_code(tmp_path):
    h5py = pytest.importorskip("h5py")
    p = sph_prep.place("1", n=300, box=box(3), periodic=True, polish="none", target_code="gizmo", fields={"pressure": 1})
    p.write(tmp_path / "ic.hdf5")
    with h5py.File(tmp_path / "ic.hdf5") as file:
        h = file["PartType0/SmoothingLength"][:]
        assert np.allclose(h, p.support_radius, rtol=1e-6)  # GIZMO's is where the kernel ends
    p.write(tmp_path / "swift.hdf5", "swift", double=True)
    with h5py.File(tmp_path / "swift.hdf5") as file:
        assert file["PartType0/Masses"].dtype == np.float64
    with pytest.raises(ValueError, match="Phantom starts from"):
        sph_prep.place("1", n=300, box=box(3), periodic=True, polish="none", target_code="phantom").write(tmp_path / "a.hdf5")


def test_a_box_begins_where_its_file_has_it(tmp_path):
    p = sph_prep.place("1", n=200, box=[[-3, 2], [-1, 4]], periodic=True, polish="none", fields={"pressure": 1})
    there = p.positions + np.array([-3.0, 2.0])
    p.header["box_corner"] = [-3.0, 2.0, 0.0]
    p["Coordinates"] = there
    with pytest.warns(UserWarning, match="corner of the box was moved"):
        p.write(tmp_path / "ic.hdf5", "swift")
    found = sph_prep.read(tmp_path / "ic.hdf5").positions
    assert np.allclose(found, there - np.array([-3.0, 2.0]))


def test_types_without_gas_and_heavy_ones_have_their_units(tmp_path):
    unyt = pytest.importorskip("unyt")
    halo = {"profile": {"plummer": {"mass": "1e12 Msun", "scale_radius": "10 kpc", "outer_radius": "100 kpc"}}}
    p = sph_prep.Scene({"input": halo, "collisionless": True, "particles": 300, "output": {"units": "galactic"}}).place()
    assert 0 not in p.species
    total = p.unyt("Masses").sum().to("Msun")
    assert 1e11 < float(total.value) <= 1.001e12
    p.write(tmp_path / "halo.hdf5")
    again = sph_prep.read(tmp_path / "halo.hdf5")
    assert np.isfinite(again.unyt("Masses")).all() and np.isfinite(again.astropy("Masses").value).all()
    assert float(again.unyt("Masses").sum().to("Msun").value) == pytest.approx(float(total.value), rel=1e-5)
    assert isinstance(total, unyt.unyt_quantity)


def test_a_scene_of_a_file_finds_what_is_beside_it(tmp_path, monkeypatch):
    folder = tmp_path / "scenes"
    folder.mkdir()
    np.savez(folder / "g.npz", density=np.full((8, 8), 3.0))
    (folder / "s.yaml").write_text("input: {file: g.npz}\ndomain: {boundary: [periodic]}\nparticles: 100\npolish: none\n")
    monkeypatch.chdir(tmp_path)
    p = sph_prep.Scene("scenes/s.yaml", particles=150).place()
    assert len(p) == 150 and p.masses.sum(dtype=float) == pytest.approx(3.0, rel=1e-5)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"density": np.ma.masked_array(np.ones((4, 4)), mask=np.eye(4))}, sph_prep.SceneError, "4 values of the array are masked"),
        ({"density": "stra.nc", "box": [[0], [1]]}, FileNotFoundError, "stra.nc"),
        ({"density": "1", "box": [[0], [1]], "periodic": "reflecting"}, sph_prep.SceneError, "expected True or False"),
        ({"density": lambda x: x, "ball": {"radius": 1}}, sph_prep.SceneError, "has no center"),
        ({"density": lambda x: x, "box": [["0 pc"], ["1 pc"]]}, sph_prep.SceneError, "plain numbers"),
        ({"density": lambda x: x, "box": [[1], [0]]}, sph_prep.SceneError, "lowest corner first"),
    ],
)
def test_what_cannot_be_placed_is_told(arguments, error, words):
    with pytest.raises(error, match=words):
        sph_prep.place(n=100, **arguments)


def test_an_array_fills_its_ball():
    p = sph_prep.place(np.ones((16, 16)), ball={"center": [0, 0], "radius": 1}, n=200, polish="none")
    assert p.masses.sum(dtype=float) == pytest.approx(np.pi, rel=1e-3)


def test_units_of_a_profile_have_to_be_those_of_its_columns():
    unyt = pytest.importorskip("unyt")
    r = unyt.unyt_array(np.linspace(0.0, 1.0, 50), "g")
    with pytest.raises(sph_prep.SceneError, match="'radius' is no cm"):
        sph_prep.place({"radius": r, "density": np.ones(50)}, n=100)
