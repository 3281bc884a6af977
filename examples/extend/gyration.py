"""An observable in its own file: the radius of gyration of each fiber.

Importing this file is enough: runs record it from then on, `StopWhen` knows it, and figures have
its label. Import it before `resume`, too.
"""

import numpy as np

from stokesfibers.core.arrays import Array
from stokesfibers.core.variables import Variable, register
from stokesfibers.observe.observables import OBSERVABLES, centre
from stokesfibers.observe.snapshot import Snapshot


def radius_of_gyration(snapshot: Snapshot) -> Array:
    """Return the root of the mean squared distance from the centre, (fiber,)."""
    away = snapshot.x - centre(snapshot)[:, :, None]  # (fiber, 3, node)
    squared = np.einsum("fin,fin->fn", away, away)
    return np.sqrt(snapshot.integrate(squared) / snapshot.lengths)


register(
    Variable(
        name="radius_of_gyration",
        group="observables",
        dims=("time", "fiber"),
        unit="length",
        symbol="R_g",
        meaning="radius of gyration",
    )
)
OBSERVABLES["radius_of_gyration"] = radius_of_gyration
