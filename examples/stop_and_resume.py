"""
Stop on a condition, and go on
==============================

A run can end when an observable passes a bound, and go on from there with the same bits it would
have had without the stop. Here a fiber buckles; the run stops when it is bent most sharply.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf

fiber = sf.Fiber(length=1.0, slenderness=1e-3, rigidity=1.0)
problem = sf.Problem(fiber, mu_bar=2e5, flow=sf.Shear(rate=1.0))
start = sf.shapes.nearly_straight(fiber, angle=0.95 * np.pi, amplitude=-0.01)
bent = sf.StopWhen("largest_curvature", above=8.0)

with TemporaryDirectory() as folder:
    store = Path(folder) / "run.zarr"
    first = sf.simulate(problem, start, until=15.0, record=sf.every(0.1), out=store, stop=(bent,))
    print(first.status)
    stopped = first.status.time
    then = sf.resume(store)  # the condition has been met: on to the end
    print(then.status)
    in_two = then.data["observables"]["largest_curvature"].isel(fiber=0).load()

# %%
# A run without the stop, for comparison: bit by bit the same.
whole = sf.simulate(problem, start, until=15.0, record=sf.every(0.1))
at_once = whole.data["observables"]["largest_curvature"].isel(fiber=0)
print("same bits:", np.array_equal(in_two, at_once))

fig, ax = plt.subplots(figsize=(6.5, 3.4), layout="constrained")
before = in_two["time"] <= stopped
ax.plot(in_two["time"][before], in_two[before], label="to the stop")
ax.plot(in_two["time"][~before], in_two[~before], "C1", label="resumed")
ax.plot(at_once["time"][::40], at_once[::40], "k.", label="without a stop")
ax.axhline(8.0, color="0.6", linestyle=":")
ax.set(xlabel="time", ylabel="largest curvature [1 / length]")
ax.legend()
plt.show()
