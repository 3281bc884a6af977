"""
Buckling in shear
=================

A fiber turns in a shear flow. While it points against the extension the flow compresses it, and
a flexible one buckles. The run of Fig. 4 of Tornberg & Shelley (2004), with the default engine.
"""

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf

fiber = sf.Fiber(length=1.0, slenderness=1e-3, rigidity=1.0)
problem = sf.Problem(fiber, mu_bar=4e5, flow=sf.Shear(rate=1.0))

# %%
# The fiber starts almost along the flow, bent by 4e-7 of its length. It is upright at t = 49.664.
start = sf.shapes.nearly_straight(fiber, amplitude=-1e-4)
result = sf.simulate(problem, start, until=61.44, record=sf.every(0.256, observables=0.0256))
print(result.status)

# %%
# Shapes before, during and after buckling, each moved to the right of the one before, and the
# stresses of the fiber: without buckling the first normal stress difference would be odd about
# the upright position.
fig, (above, below) = plt.subplots(2, 1, figsize=(7, 5.5), layout="constrained")
times = [46.08, 48.128, 49.152, 50.176, 51.2, 53.248, 56.32]
sf.plot.shapes(result.data, times=times, ax=above, offset=0.45)
sf.plot.stress(result.data, ax=below)
below.set_xlim(40, 61.44)

n1 = result.data["observables"]["first_normal_stress_difference"].sel(time=slice(37.88, 61.45))
print(f"integral of N1 from t = 37.888 on: {np.trapezoid(n1, n1['time']):.2f}")
plt.show()
