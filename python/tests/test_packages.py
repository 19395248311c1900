"""Particles in other packages, where these are installed."""

import numpy as np
import pytest
import sph_prep


@pytest.fixture(scope="module")
def star():
    r = np.linspace(0.0, 7e10, 200)
    rho = 1.5 * np.maximum(1.0 - r / 7e10, 0.0)
    return sph_prep.place(
        {"radius": r, "density": rho}, n=500, thermal={"internal_energy": "1e15 erg/g"}, input={"length_unit": "cm", "density_unit": "g/cm^3"}
    )


def total(star):
    return float(star.masses.sum(dtype=float)) * star.to_cgs("Masses")


def test_sarracen(star):
    pytest.importorskip("sarracen")
    frame = star.to_sarracen()
    assert len(frame) == 500 and frame["m"].sum() == pytest.approx(star.masses.sum(dtype=float), rel=1e-6)


def test_yt(star):
    pytest.importorskip("yt")
    data = star.to_yt().all_data()
    assert float(data["all", "particle_mass"].sum().in_cgs().value) == pytest.approx(total(star), rel=1e-5)


def test_pynbody(star):
    pynbody = pytest.importorskip("pynbody")
    snapshot = star.to_pynbody()
    assert float(snapshot["mass"].sum().in_units("g")) == pytest.approx(total(star), rel=1e-5)
    assert snapshot["pos"].units.ratio(pynbody.units.Unit("cm")) == pytest.approx(star.to_cgs("Coordinates"))


def test_swiftsimio(star, tmp_path):
    pytest.importorskip("swiftsimio")
    # It takes the units of a file for the nearest that have names, with four digits.
    kept = star.to_swiftsimio(tmp_path / "star.hdf5")
    assert (tmp_path / "star.hdf5").exists()
    for data in (kept, star.to_swiftsimio()):
        assert len(data.gas.masses) == 500
        assert float(data.gas.masses.sum().to("g").value) == pytest.approx(total(star), rel=1e-3)
        width = np.ptp(star.positions[:, 0]) * star.to_cgs("Coordinates")
        assert float(np.ptp(data.gas.coordinates[:, 0].to("cm").value)) == pytest.approx(width, rel=1e-3)
