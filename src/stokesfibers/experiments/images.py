"""What Figs. 15-18 share: Appendix C, the sum over periodic images of one filament and its errors.

The filament lies at its middle node; image p is at -p d (errata, item 9). V^p is (17) by the
trapezoidal rule, without the doublet. The reference is the sum over |p| <= P for three P, doubled
each time: the rest falls as (P + 1/2)^-2, with a remainder of two orders more, so that one
Richardson step leaves next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from stokesfibers.core.arrays import Array
from stokesfibers.experiments import runs
from stokesfibers.experiments.base import Row, Settings
from stokesfibers.experiments.tiers import BucklingRun, tier
from stokesfibers.kernels import pairs
from stokesfibers.stepping.paper import PaperStepper

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MU_BAR = 4e5
LINES = (0.3, 0.6, 0.9)
"""x of the lines of test points, from the filament's middle."""
HEIGHTS = np.linspace(-0.8, 0.8, 161)
PERIODS = (2.0, 3.0, 4.0)
"""The paper's d_1, then longer ones."""
REACH = 20
"""Q of (42)."""
LONG_REACH = 200
QUARTER = 0.25
"""Share of the largest elastic energy that the straighter shape has."""
SUMS = ("cut", "one_more", "other_one_more", "cut_at_two", "midpoint", "centre", "long_midpoint")
"""|p| <= 1; with p = -2 (at 2 d, nearer to the lines) or p = 2 (at -2 d) more; |p| <= 2;
(42) about the mid-point; about the centre of mass; about the mid-point with Q = 200."""
LABELS = {
    "cut": r"$|p| \leq 1$",
    "one_more": r"and the nearer of $|p| = 2$",
    "cut_at_two": r"$|p| \leq 2$",
    "midpoint": "(42), mid-point",
    "centre": "(42), centre of mass",
}
_SIZES = (20, 40, 80)


@dataclass(frozen=True)
class Source:
    """A filament and the force in it, from the stored record of a run.

    Attributes
    ----------
    x
        Positions from the middle node, (3, node).
    xs
        Tangents, (3, node).
    force
        F = -T x_s + x_sss of (17), (3, node).
    weights
        Trapezoidal weights, (node,).
    """

    x: Array
    xs: Array
    force: Array
    weights: Array

    @property
    def moments(self) -> Array:
        """S = int x_s F ds of (41), (3, 3)."""
        return np.einsum("an,bn,n->ab", self.xs, self.force, self.weights)

    @property
    def centre_of_mass(self) -> Array:
        """The mean position, (3,)."""
        return self.x @ self.weights / self.weights.sum()

    def images(
        self,
        line: float,
        exact: Array,
        far: Sequence[float] | Array = (),
        *,
        centre: Array | None = None,
    ) -> Array:
        """Return the sum of V over images seen from the test points, (point, 3).

        Parameters
        ----------
        line
            x of the test points; their y are `HEIGHTS`.
        exact
            Values of p d whose V^p is summed as it is.
        far
            Values of p d that are approximated by the moments.
        centre
            The point that stands for a far image; the mid-point by default.
        """
        points = np.zeros((HEIGHTS.size, 3))
        points[:, 0], points[:, 1] = line, HEIGHTS
        near_shifts, far_shifts = np.zeros((len(exact), 3)), np.zeros((3, len(far)))
        near_shifts[:, 0], far_shifts[0] = exact, far
        nothing = np.zeros(1)
        return pairs.others_velocity(
            points,
            np.zeros(3),
            -1,
            self.x[None],
            self.xs[None],
            self.force[None],
            self.weights[1:2],
            nothing,
            # without periods the images are taken as they are listed
            (np.zeros(3), near_shifts, far_shifts),
            (0.0, 1.0, nothing, False),
            np.zeros_like(self.x)[None],
            self.moments[None],
            np.zeros((1, 3)) if centre is None else centre[None],
        )

    def reference(
        self, line: float, period: float, sizes: Sequence[int] = _SIZES
    ) -> tuple[Array, float]:
        """Return the sum over all images, (point, 3), and a bound of its error.

        The bound is the change by the last extrapolation, most of it the error of the one before.
        """
        sums = [self.images(line, _to(size) * period) for size in sizes]
        weights = [(size + 0.5) ** 2 for size in sizes]
        before, best = (
            (fine * w_fine - coarse * w_coarse) / (w_fine - w_coarse)
            for coarse, fine, w_coarse, w_fine in zip(
                sums, sums[1:], weights, weights[1:], strict=False
            )
        )
        return best, float(np.linalg.norm(best - before, axis=1).max())

    def approximations(self, line: float, period: float) -> dict[str, Array]:
        """Return the sums named in `SUMS`, each (point, 3)."""
        one, far, further = _to(1) * period, _far(REACH) * period, _far(LONG_REACH) * period
        return {
            "cut": self.images(line, one),
            "one_more": self.images(line, np.append(one, -2.0 * period)),
            "other_one_more": self.images(line, np.append(one, 2.0 * period)),
            "cut_at_two": self.images(line, _to(2) * period),
            "midpoint": self.images(line, one, far),
            "centre": self.images(line, one, far, centre=self.centre_of_mass),
            "long_midpoint": self.images(line, one, further),
        }


def _to(last: int) -> Array:
    return np.arange(-last, last + 1, dtype=float)


def _far(last: int) -> Array:
    p = _to(last)
    return p[np.abs(p) > 1.0]


def run(settings: Settings) -> xr.Dataset:
    """Return both shapes, the reference and the errors of all sums, for all lines and periods.

    Errors are relative to the largest reference on the line; nan where a line meets the filament.
    """
    chosen = tier(settings.quick)
    case = BucklingRun(chosen, MU_BAR, chosen.drawn)
    tree = runs.finished([case], settings)[0]
    found, energy = _records(tree)
    sources = _sources(found, case)
    data = [_measure(source) for source in sources]
    merged = {name: np.stack([one[name] for one in data]) for name in data[0]}
    lines = ("filament", "period", "x")
    return xr.Dataset(
        {
            "position": (("filament", "space", "node"), np.stack([s.x for s in sources])),
            "force": (("filament", "space", "node"), np.stack([s.force for s in sources])),
            "time": (("filament",), found["time"].to_numpy()),
            "elastic_energy": (("filament",), energy[:2]),
            "largest_energy": ((), energy[2]),
            "magnitude": ((*lines, "y"), merged["magnitude"]),
            "reference_error": (lines, merged["reference_error"]),
            "error": ((*lines, "sum", "y"), merged["error"]),
        },
        coords={
            "filament": ["bent", "straighter"],
            "period": list(PERIODS),
            "x": list(LINES),
            "y": HEIGHTS,
            "sum": list(SUMS),
        },
        attrs={"mu_bar": MU_BAR, "intervals": case.intervals, "quick": int(settings.quick)},
    )


def _records(tree: xr.DataTree) -> tuple[xr.Dataset, Array]:
    """Return the records of the two shapes, their elastic energies and the largest of all."""
    observed, energies = runs.series(tree, "elastic_energy")
    stored = tree["trajectory"]["time"].to_numpy()
    peak = int(np.argmax(energies))
    bent = int(np.argmin(np.abs(stored - observed[peak])))
    at_stored = np.interp(stored, observed, energies)
    straighter = int(np.argmin(np.abs(at_stored[:bent] - QUARTER * energies[peak])))
    picked = [bent, straighter]
    return runs.frames(tree, stored[picked]), np.array([*at_stored[picked], energies[peak]])


def _sources(found: xr.Dataset, case: BucklingRun) -> list[Source]:
    fiber = PaperStepper(case.problem).fibers[0]
    sources = []
    for position, tension in zip(
        found["position"].to_numpy()[:, 0], found["tension"].to_numpy()[:, 0], strict=True
    ):
        shape = fiber.shape((position - position[len(position) // 2]).T)
        force = fiber.rigidity * shape.xsss - tension * shape.xs
        sources.append(Source(shape.x, shape.xs, force, fiber.grid.weights))
    return sources


def _measure(source: Source) -> dict[str, Array]:
    """Return reference and errors of one filament for all periods and lines."""
    size = (len(PERIODS), len(LINES))
    magnitude = np.full((*size, HEIGHTS.size), np.nan)
    reference_error = np.full(size, np.nan)
    error = np.full((*size, len(SUMS), HEIGHTS.size), np.nan)
    for i, period in enumerate(PERIODS):
        for j, line in enumerate(LINES):
            if line <= source.x[0].max():
                continue
            best, bound = source.reference(line, period)
            magnitude[i, j] = np.linalg.norm(best, axis=1)
            largest = magnitude[i, j].max()
            reference_error[i, j] = bound / largest
            sums = source.approximations(line, period)
            for k, name in enumerate(SUMS):
                error[i, j, k] = np.linalg.norm(sums[name] - best, axis=1) / largest
    return {"magnitude": magnitude, "reference_error": reference_error, "error": error}


def worst(
    data: xr.Dataset,
    name: str,
    line: float,
    *,
    period: float = PERIODS[0],
    filament: str = "bent",
) -> float:
    """Return the largest relative error of a sum on a line, in percent."""
    picked = data["error"].sel(sum=name, x=line, period=period, filament=filament)
    return 100.0 * float(picked.max("y"))


def error_row(data: xr.Dataset, name: str, line: float, **more: Any) -> Row:
    """Return the largest error of a sum on a line as a row."""
    what = {
        "cut": "|p| <= 1",
        "one_more": "|p| <= 1 and the nearer of |p| = 2",
        "other_one_more": "|p| <= 1 and the farther of |p| = 2",
        "cut_at_two": "|p| <= 2",
        "midpoint": f"(42), Q = {REACH}, mid-point",
        "centre": f"(42), Q = {REACH}, centre of mass",
        "long_midpoint": f"(42), Q = {LONG_REACH}, mid-point",
    }[name]
    return Row(f"error of {what}, x = {line}, %", worst(data, name, line), **more)


def draw_errors(data: xr.Dataset, names: Sequence[str]) -> Figure:
    """Draw the errors of the named sums against y, one panel per line of test points."""
    from stokesfibers.plot.style import PAGE, PALETTE, new_panels, style

    axes = new_panels(1, len(LINES), width=PAGE, height=2.3)[0]
    bent = data.sel(filament="bent", period=PERIODS[0])
    dashes = ("-", (0, (4, 2)), (0, (1, 1.2)))
    with style():
        for ax, line in zip(axes, LINES, strict=True):
            for name, colour, dash in zip(names, PALETTE, dashes, strict=False):
                values = 100.0 * bent["error"].sel(x=line, sum=name).to_numpy()
                ax.plot(HEIGHTS, values, color=colour, linestyle=dash, label=LABELS[name])
            finish_panel(ax, line)
        axes[0].set_ylabel("relative error, %")
        drawn = axes[0].figure
        drawn.legend(handles=axes[0].get_lines(), loc="outside upper center", ncols=len(names))
    return drawn


def finish_panel(ax: Any, line: float) -> None:
    """Label the panel of one line of test points."""
    ax.set_title(rf"$\bar{{x}} = {line}$")
    ax.set(xlim=(-0.8, 0.8), xticks=[-0.8, -0.4, 0.0, 0.4, 0.8], xlabel="$y$")
    ax.set_ylim(bottom=0.0)
