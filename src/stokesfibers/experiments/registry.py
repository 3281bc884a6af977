"""All experiments by name. Listing them imports no solver and no plotting library."""

from __future__ import annotations

from stokesfibers.experiments.base import Experiment

_PAPER = "Tornberg & Shelley 2004"
_TABLE = (
    ("fig01", "A straight rod rotating in shear, without and with line tension", "Fig. 1"),
    ("fig02", "A filament buckles in shear: shapes at mu_bar = 2e5", "Fig. 2"),
    ("fig03", "A filament buckles in shear: shapes at mu_bar = 3e5", "Fig. 3"),
    ("fig04", "A filament buckles in shear: shapes at mu_bar = 4e5", "Fig. 4"),
    ("fig05", "Line tension of the buckling filament and of the straight one", "Fig. 5"),
    ("fig06", "First normal stress difference of the buckling filament", "Fig. 6"),
    ("fig07", "Shear stress of the buckling filament", "Fig. 7"),
    ("fig08", "Shapes at three resolutions and orders of convergence", "Fig. 8, Section 4.1.1"),
    ("fig09", "Length errors, and the influence of the penalisation", "Fig. 9, Section 4.1.1"),
    ("fig10", "25 filaments in oscillating shear: at the start, after one period", "Fig. 10"),
    ("fig11", "25 filaments in oscillating shear: straightened, and buckled", "Fig. 11"),
    ("fig12", "25 filaments in oscillating shear: elastic energy", "Fig. 12"),
    ("fig13", "25 filaments in oscillating shear: energy of four of them", "Fig. 13"),
    ("fig14", "Eigenvalues of the unregularised operator, straight filament", "Fig. 14, B.1"),
    ("fig15", "A bent filament and its two nearest periodic images", "Fig. 15, Appendix C"),
    ("fig16", "The sum over all periodic images along three lines", "Fig. 16, Appendix C"),
    ("fig17", "Error of the sum over images, cut off at |p| = 1", "Fig. 17, Appendix C"),
    ("fig18", "Error of the approximate sum over images (42)", "Fig. 18, Appendix C"),
    ("close_pair", "Filaments close together: velocity, iterations", "Section 3.3 (no figure)"),
    ("stable_dt", "The largest stable time step of the paper's scheme", "Section 3 (no figure)"),
)

_OTHERS = (
    (
        "thresholds",
        "Buckling thresholds, with local drag and against slenderness",
        "Becker & Shelley 2001; du Roure et al. 2019",
    ),
    (
        "sedimentation",
        "Terminal shapes of a falling fiber against the elasto-gravitational number",
        "ours, with exact limits",
    ),
    (
        "transition",
        "The buckling transition in shear: N_1 of a half turn, local drag or not",
        "Becker & Shelley 2001; an open question of the paper",
    ),
    (
        "concentration",
        "N_1 and extra viscosity against concentration, stiff and flexible fibers",
        "ours; an open question of the paper",
    ),
    (
        "length_distribution",
        "Stresses of suspensions of fibers of one length and of several",
        "ours, with an exact dilute limit",
    ),
    (
        "oscillatory",
        "G' and G'' of dilute fibers against amplitude and frequency",
        "ours, with an exact linear limit",
    ),
    ("accuracy", "Error against cost, both engines; the integral of N_1", "Engine study"),
    ("ewald", "Errors of the Ewald sum against slow sums", "Ewald sums, theory page"),
    (
        "images",
        "Cutting off periodic images and (42), against the exact sum",
        f"{_PAPER}, Appendix C",
    ),
    (
        "cloud",
        "A cloud of falling filaments: its velocity against theory, its evolution",
        "Nitsche & Batchelor 1997, and ours",
    ),
    (
        "contact",
        "Filaments down to contact of their surfaces: errors of V + (eps^2/2) W",
        "Close filaments, theory page",
    ),
    ("tolerance", "The error asked for and the error got, 28 cases", "Engine study"),
    ("two_engines", "The suspension of Fig. 12 by both engines: energy, cost", "Engine study"),
    ("regularization", "Three choices of delta(s): eigenvalues, slopes, runs", "Engine study"),
)

_MODULES = {"ewald": "ewald_tables", "images": "images_exact"}
"""Modules that are not called like their experiment."""

EXPERIMENTS: dict[str, Experiment] = {
    name: Experiment(name, title, source, f"stokesfibers.experiments.{_MODULES.get(name, name)}")
    for name, title, source in (
        *((name, title, f"{_PAPER}, {place}") for name, title, place in _TABLE),
        *_OTHERS,
    )
}
"""Experiments by the name that the command ``reproduce`` takes."""
