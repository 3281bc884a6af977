"""
The orbit of a stiff fiber
==========================

A stiff thin fiber turns as Jeffery's ellipsoid of infinite aspect ratio does: its direction p
follows ``p_t = (I - p p) . grad U . p``, whose answer in shear is known.
"""

import matplotlib.pyplot as plt
import numpy as np

import stokesfibers as sf

fiber = sf.Fiber(length=1.0, slenderness=1e-3, rigidity=1.0)
problem = sf.Problem(fiber, mu_bar=100.0, flow=sf.Shear(rate=1.0))

p0 = np.array([-4.0, 1.0, 2.0]) / np.sqrt(21.0)
ends = np.linspace(-0.5, 0.5, 41)[:, None] * p0
result = sf.simulate(problem, ends, until=10.0, record=sf.every(0.25))

# %%
# In shear at rate 1 the flow carries the line through p along: p(t) is along ``p0 + t p0_y e_x``.
vector = result.data["observables"]["end_to_end"].isel(fiber=0)
t = vector["time"].to_numpy()
exact = p0 + t[:, None] * p0[1] * np.array([1.0, 0.0, 0.0])
exact /= np.linalg.norm(exact, axis=1, keepdims=True)
print(f"largest difference: {np.abs(vector - exact).max().item():.1e}")

# %%
fig = plt.figure(figsize=(8, 3.8), layout="constrained")
ax = fig.add_subplot(1, 2, 1, projection="3d")
ax.plot(*exact.T[[0, 2, 1]], color="0.6")
shown = vector[::20]
ax.quiver(*np.zeros((3, len(shown))), *shown.T.to_numpy()[[0, 2, 1]], arrow_length_ratio=0.1)
ax.set(xlabel="x", ylabel="z", zlabel="y", title="direction of the fiber")
ax.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
right = fig.add_subplot(1, 2, 2)
for k, name in enumerate("xyz"):
    right.plot(t, vector[:, k], color=f"C{k}", label=f"$p_{name}$")
    right.plot(t[::8], exact[::8, k], "o", color=f"C{k}", markerfacecolor="none")
right.set(xlabel="time", title="line: run, circles: exact")
right.legend()
plt.show()
