"""Makes cube.nc4, the NetCDF-4 form of the scene in tests/parity.rs (netCDF4 1.7). Run it in this folder."""

import netCDF4
import numpy as np

n = 5
nodes = np.arange(n) / (n - 1)
z, y, x = np.meshgrid(nodes, nodes, nodes, indexing="ij")
with netCDF4.Dataset("cube.nc4", "w", format="NETCDF4") as f:
    for axis in "zyx":
        f.createDimension(axis, n)
        v = f.createVariable(axis, "f8", (axis,))
        v[:] = nodes
    rho = f.createVariable("density", "f8", ("z", "y", "x"), compression="zlib", fletcher32=True)
    rho[:] = 1 + (x + 2 * y + 4 * z * z) / 2
