"""
An observable of one's own
==========================

The shortest way is to compute it from the recorded shapes. Here: how much of a fiber is inside
its bent part. To have one recorded during the run, and stop on it, see the how-to.
"""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import stokesfibers as sf

fiber = sf.Fiber(length=1.0, slenderness=1e-3, rigidity=1.0)
problem = sf.Problem(fiber, mu_bar=3e5, flow=sf.Shear(rate=1.0))
start = sf.shapes.nearly_straight(fiber, angle=0.95 * np.pi, amplitude=-0.01)
result = sf.simulate(problem, start, until=12.0, record=sf.every(0.05, points=201))


# %%
def curvature(position: xr.DataArray) -> xr.DataArray:
    """Return |x_ss| of shapes at equal arclengths, by central differences."""
    spacing = 1.0 / (position.sizes["node"] - 1)
    bend = position.diff("node", label="lower").diff("node") / spacing**2
    return np.sqrt((bend**2).sum("space"))


bend = curvature(result.data["trajectory"]["position"].isel(fiber=0))
fraction = (bend > 1.0).mean("node")

# %%
fig, (above, below) = plt.subplots(2, 1, figsize=(7, 5), sharex=True, layout="constrained")
s = np.linspace(0.0, 1.0, bend.sizes["node"])
drawn = above.pcolormesh(bend["time"], s, bend.T, cmap="magma_r", shading="nearest")
fig.colorbar(drawn, ax=above, label="curvature [1 / length]")
above.set(ylabel="arclength $s$")
below.plot(fraction["time"], fraction)
below.set(xlabel="time", ylabel="fraction with curvature > 1", ylim=(0, 1))
plt.show()
