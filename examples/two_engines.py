"""
Two engines, one answer
=======================

The paper's scheme (finite differences, tension first, BDF2) and the high-order engine solve the
same equations. Their answers approach each other as the paper's grid is refined.
"""

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf

fiber = sf.Fiber(length=1.0, slenderness=1e-2, rigidity=1.0)
start = sf.shapes.nearly_straight(fiber, angle=0.9 * np.pi, amplitude=-0.1)
same = sf.NonLocal(sf.SpheroidalRegularization())  # each engine has its own default


def shapes(engine, points):
    """Return the shapes at t = 0, 0.5, ... 5, (time, points, 3)."""
    flow = sf.Shear(rate=1.0)
    problem = sf.Problem(fiber, mu_bar=1e5, flow=flow, mobility=same, engine=engine)
    run = sf.simulate(problem, start, until=5.0, record=sf.every(0.5, points=points))
    return run.data["trajectory"]["position"].isel(fiber=0).to_numpy()


# %%
# The high-order engine has one knob, its tolerance. The answer to 1e-6 stands for the exact one.
exact = shapes(sf.SpectralEngine(rtol=1e-6), 101)
tolerances = np.array([1e-2, 1e-3, 1e-4])
spectral = [np.abs(shapes(sf.SpectralEngine(rtol=r), 101) - exact).max() for r in tolerances]

# %%
# The paper's engine needs a number of intervals, and a step that falls with them.
intervals = np.array([25, 50, 100])
paper = []
for n in intervals:
    found = shapes(sf.PaperEngine(intervals=int(n), dt=0.5 / n), int(n) + 1)
    paper.append(np.abs(found - exact[:, :: 100 // n]).max())

fig, (left, right) = plt.subplots(1, 2, figsize=(8, 3.4), sharey=True, layout="constrained")
left.loglog(intervals, paper, "o-")
left.loglog(intervals, paper[-1] * (intervals / intervals[-1]) ** -2.0, "k:", label="order 2")
left.set(xlabel="intervals", ylabel="largest error of shapes", title="engine = 'paper'")
left.set_xticks(intervals, [str(n) for n in intervals], minor=False)
left.minorticks_off()
left.legend()
right.loglog(tolerances, spectral, "s-", color="C1")
right.loglog(tolerances, tolerances, "k:", label="error = rtol")
right.set(xlabel="rtol", title="engine = 'spectral'")
right.legend()
plt.show()
