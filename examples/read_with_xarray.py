"""
Read a run with xarray
======================

A run is a Zarr store that plain xarray opens, at any moment, with names, axes and units. Nothing
of this package is needed to read it.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import xarray as xr

import stokesfibers as sf

folder = TemporaryDirectory()
store = Path(folder.name) / "run.zarr"
fiber = sf.Fiber(length=1.0, slenderness=1e-2, rigidity=1.0)
shear = sf.OscillatoryShear(amplitude=1.0, frequency=0.05)
problem = sf.Problem(fiber, mu_bar=1e5, flow=shear)
start = sf.shapes.nearly_straight(fiber, angle=0.9 * 3.141592653589793, amplitude=-0.2)
sf.simulate(problem, start, until=40.0, record=sf.every(0.5), out=store)

# %%
# A tree of datasets: shapes and tension, observables, and what the engine did.
run = xr.open_datatree(store, engine="zarr", consolidated=True)
print(run["observables"].to_dataset())
print(run.attrs["status"])

# %%
# Select, average, resample by name. The energy of the two periods of the flow, over one another:
energy = run["observables"]["elastic_energy"].isel(fiber=0)
stress = run["observables"]["shear_stress"]
fig, (left, right) = plt.subplots(1, 2, figsize=(8.5, 3.4), layout="constrained")
for k in range(2):
    part = energy.sel(time=slice(20.0 * k, 20.0 * (k + 1)))
    left.semilogy(part["time"] - 20.0 * k, part.clip(min=1e-8), label=f"period {k + 1}")
left.set(xlabel="time in the period", ylabel=f"{energy.long_name}")
left.legend()
stress.rolling(time=20, center=True).mean().plot(ax=right)
right.set(title="mean over one unit of time", ylabel=f"{stress.long_name}")
folder.cleanup()
plt.show()
