"""
Local drag against non-local slender body theory
================================================

Local drag leaves out what parts of a fiber do to one another through the fluid. It is cheap and
often close; how close depends on the slenderness and on what is asked for.
"""

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf

MODELS = {"non-local": sf.NonLocal(), "local drag": sf.LocalDrag()}
# %%
# What decides about buckling is ``eta = mu_bar / |c|`` with c = log(eps^2 e). Both columns have
# eta = 2e4, so that local drag gives the same shapes in both.
fig, axes = plt.subplots(2, 2, figsize=(8, 6), layout="constrained")
for column, eps in zip(axes.T, (1e-2, 1e-3), strict=True):
    fiber = sf.Fiber(length=1.0, slenderness=eps, rigidity=1.0)
    mu_bar = 2e4 * abs(np.log(eps**2 * np.e))
    start = sf.shapes.nearly_straight(fiber, angle=0.95 * np.pi, amplitude=-0.02)
    for (name, mobility), style in zip(MODELS.items(), ("-", "--"), strict=True):
        problem = sf.Problem(fiber, mu_bar=mu_bar, flow=sf.Shear(rate=1.0), mobility=mobility)
        run = sf.simulate(problem, start, until=12.0, record=sf.every(0.5, observables=0.05))
        x, y, _ = run.data["trajectory"]["position"].sel(time=6.0).isel(fiber=0).T
        column[0].plot(x, y, style, label=name)
        n1 = run.data["observables"]["first_normal_stress_difference"]
        column[1].plot(n1["time"], n1 / mu_bar, style, label=name)
    column[0].set(title=f"slenderness {eps:g}", xlabel="x", ylabel="y, at t = 6")
    column[0].set_aspect("equal", adjustable="datalim")
    column[1].set(xlabel="time", ylabel=r"$N_1\, /\, 8\pi\mu\dot\gamma L^3$")
    column[0].legend()
plt.show()
