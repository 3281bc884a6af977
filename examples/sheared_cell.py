"""
A suspension in a sheared cell
==============================

Flexible fibers in a triply periodic cell that follows a steady shear, and their contribution to
the viscosity with an error bar. Small and short, to run in seconds; `cases/sheared_cell.toml`
is the larger one.
"""

import matplotlib.pyplot as plt

import stokesfibers as sf

fibers = sf.Fiber(length=1.0, slenderness=1e-2, rigidity=1.0, count=10)
problem = sf.Problem(
    fibers,
    mu_bar=5e3,
    flow=sf.Shear(rate=1.0),
    domain=sf.Sheared((2.0, 2.0, 2.0)),
    load=sf.StericRepulsion(strength=5e3, range=0.03),
    engine=sf.SpectralEngine(rtol=1e-2),
)
placed = sf.Suspension(seed=1, least_gap=0.05)
start = placed.curves(problem.fibers, problem.domain.lengths)
result = sf.simulate(problem, start, until=4.0, record=sf.every(0.5, observables=0.05))
print(result.status)

# %%
# The first strain units are a start-up; a true average needs tens of them.
mean = sf.average_of(result.data, "specific_viscosity", after=1.0)
print(f"specific viscosity {mean.mean:.3f} +- {mean.error:.3f}, settled: {mean.settled}")

fig, ax = plt.subplots(figsize=(6.5, 3.4), layout="constrained")
sf.plot.series(result.data, "specific_viscosity", ax=ax)
ax.axhspan(mean.mean - mean.error, mean.mean + mean.error, alpha=0.3, color="C1")
ax.axhline(mean.mean, color="C1", label="mean over t > 1, one standard error")
ax.legend()

# %%
# The cell at the end. Its images one period up have slid along x.
cell = plt.figure(figsize=(6, 4))
sf.plot.perspective(result.data, time=4.0, ax=cell.add_subplot(projection="3d"))
plt.show()
