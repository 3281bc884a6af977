"""
A flow of one's own: a fiber among vortices
===========================================

Any velocity field can be the background flow. Here it is an array of counter-rotating vortices;
a flexible fiber is stretched at the corners between them and coiled inside.
"""

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf


def vortices(points, _time):
    """Return the velocity at points (n, 3), (n, 3); it could depend on time."""
    x, y, _ = points.T
    return np.stack([np.sin(x) * np.cos(y), -np.cos(x) * np.sin(y), 0.0 * x], axis=-1)


# %%
# The gradient may be given too; else it is found by differences over `length_scale`.
fiber = sf.Fiber(length=2.0, slenderness=5e-3, rigidity=1.0)
flow = sf.UserFlow(vortices, length_scale=1.0)
engine = sf.SpectralEngine(rtol=1e-3)
problem = sf.Problem(fiber, viscosity=12000.0, flow=flow, engine=engine)
start = sf.shapes.straight(fiber, angle=0.2, centre=(3.0, 2.6, 0.0))
result = sf.simulate(problem, start, until=12.0, record=sf.every(0.5))
print(result.status)

# %%
fig, ax = plt.subplots(figsize=(6.5, 5.6), layout="constrained")
sf.plot.shapes(result.data, times=np.arange(0.0, 12.1, 1.5), ax=ax)
(left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
x, y = np.meshgrid(np.linspace(left, right, 80), np.linspace(low, high, 80))
grid = np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=-1)
u, v, _ = vortices(grid, 0.0).T.reshape(3, *x.shape)
ax.streamplot(x, y, u, v, color="0.8", linewidth=0.6, arrowsize=0.6, zorder=0)
plt.show()
