"""Periodic images (Section 3.4): the nearest exactly, the next ones by six moments, (42).

Along each periodic direction images |p| <= 1 about the nearest one are summed exactly, those with
2 <= |p| <= Q through the moments (41) of each fiber. In one direction the rest decays as p^-3.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import ClassVar, Literal

import numpy as np

from stokesfibers.core import checks
from stokesfibers.core.arrays import Array
from stokesfibers.core.errors import InputError
from stokesfibers.domain import AbstractDomain

About = Literal["midpoint", "centre_of_mass"]


@dataclass(frozen=True)
class ImageSum:
    """The paper's approximate image sum.

    Attributes
    ----------
    reach
        Q: images up to |p| = Q are included.
    about
        The point that stands for a far image: ``"midpoint"`` as in the paper, or
        ``"centre_of_mass"``, which is 3.5 times more accurate at no cost.
    """

    reach: int = 20
    about: About = "midpoint"
    kind: ClassVar[str] = "images"
    citation: ClassVar[str] = "Tornberg & Shelley 2004, (41), (42)"

    def __post_init__(self) -> None:
        checks.whole("reach", self.reach, 1)
        if self.about not in ("midpoint", "centre_of_mass"):
            raise InputError("about", "'midpoint' or 'centre_of_mass'", repr(self.about))

    def shifts(self, domain: AbstractDomain) -> tuple[Array, Array, Array]:
        """Return periods (3,), shifts of the exact images (image, 3), of the far ones (3, image).

        In more than one periodic direction the sum is cut at a cube; it converges slowly and
        depends on that shape.
        """
        lengths = domain.lengths
        ranges = [range(-self.reach, self.reach + 1) if d > 0.0 else range(1) for d in lengths]
        index = np.array(list(product(*ranges)), dtype=float)
        exact = np.abs(index).max(axis=1) <= 1.0
        shifts = index * lengths
        return lengths, np.ascontiguousarray(shifts[exact]), np.ascontiguousarray(shifts[~exact].T)
