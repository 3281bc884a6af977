"""
Two falling fibers
==================

Two flexible fibers of different length settle. Each falls faster in the wake of the other than
alone. The short one starts above, overtakes and leaves the long one behind.
"""

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf

fibers = (
    sf.Fiber(length=1.0, slenderness=1e-2, rigidity=1.0),
    sf.Fiber(length=0.7, slenderness=1e-2, rigidity=1.0),
)
weight = 200.0
problem = sf.Problem(fibers, viscosity=1.0, load=sf.Gravity(force=(0.0, -weight, 0.0)))
start = (
    sf.shapes.straight(fibers[0], centre=(0.0, 0.0, 0.0)),
    sf.shapes.straight(fibers[1], centre=(0.4, 0.3, 0.05)),
)
result = sf.simulate(problem, start, until=0.16, record=sf.every(0.04, observables=0.001))
print(result.status)

# %%
# A straight fiber alone falls across its axis with ``8 pi mu V = (2 - c) g``, c = log(eps^2 e).
alone = weight * (2.0 - np.log(1e-4 * np.e)) / (8.0 * np.pi)
fig, (above, below) = plt.subplots(
    2, 1, figsize=(8, 4.8), height_ratios=(1, 2), layout="constrained"
)
position = result.data["trajectory"]["position"]
middle = position.mean(("fiber", "node"))
for k, shapes in enumerate(position - middle):
    for fiber, colour in enumerate(("C0", "C1")):
        x, y, _ = shapes.isel(fiber=fiber).T
        above.plot(x + 1.4 * k, y, color=colour)
above.set_xticks(1.4 * np.arange(len(position)), [f"{t:.2f}" for t in position["time"].values])
above.set(aspect="equal", xlabel="time", ylabel="y - mean")

centre = result.data["observables"]["centre"].sel(space="y")
for k, name in enumerate(("long", "short")):
    speed = -centre.isel(fiber=k).differentiate("time")
    below.plot(speed["time"], speed / alone, label=name)
below.axhline(1.0, color="k", linestyle=":", label="straight and alone")
below.set(xlabel="time", ylabel="speed of fall over that of\na straight fiber alone")
below.legend()
plt.show()
