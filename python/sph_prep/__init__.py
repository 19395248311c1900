"""Low-noise initial conditions for smoothed particle hydrodynamics (SPH).

>>> import sph_prep
>>> particles = sph_prep.place("1 + 0.5*sin(2*pi*x)", n=400, box=[[0, 0], [1, 1]], periodic=True)
>>> particles.positions.shape
(400, 2)
>>> particles.report["density_error"]["all"]["mean"] < 0.02
True
>>> particles.write("ic.npz")
"""

from ._core import SceneError, SphPrepError, __version__
from ._compare import Comparison, compare
from ._particles import Particles, read
from ._scene import Scene, place

__all__ = ["Comparison", "Particles", "Scene", "SceneError", "SphPrepError", "__version__", "compare", "place", "read"]
