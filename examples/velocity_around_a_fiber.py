"""
The fluid around a fiber
========================

The velocity of the fluid at any points, after the run: the background flow and what the fiber
adds. A fiber that does not stretch disturbs the flow around it.
"""

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf

fiber = sf.Fiber(length=1.0, slenderness=1e-2, rigidity=1.0)
problem = sf.Problem(fiber, mu_bar=1e5, flow=sf.Shear(rate=1.0))
start = sf.shapes.nearly_straight(fiber, angle=0.9 * np.pi, amplitude=-0.5)
result = sf.simulate(problem, start, until=4.0, record=sf.every(0.5))

# %%
# A grid in the plane of the fiber, and the velocity on it. Points inside the fiber give NaN.
plane = sf.plot.plane_of(result.data, axes="xy", at=0.0, time=3.5, points=120)
velocity = sf.velocity_from_run(result.data, plane.points, time=plane.time)
disturbance = velocity - problem.flow.velocity(plane.points, plane.time)

fig, axes = plt.subplots(1, 2, figsize=(9, 4), layout="constrained")
for ax, field, title in zip(axes, (velocity, disturbance), ("whole", "disturbance"), strict=True):
    shown = plane.components(field)
    sf.plot.velocity_slice(plane.x, plane.y, shown, fibers=plane.fibers, ax=ax)
    ax.set_title(f"{title} velocity, t = {plane.time:g}")
plt.show()
