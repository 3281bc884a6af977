"""A kernel fresh from the compiler and one from the cache are the same code, bit for bit."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

SCRIPT = """
import hashlib
import stokesfibers as sf
fiber = sf.Fiber(slenderness=1e-2, count=2)
problem = sf.Problem(fiber, mu_bar=1e4, flow=sf.Shear(1.0), engine=sf.PaperEngine(24))
curves = tuple(
    sf.shapes.nearly_straight(fiber, amplitude=-0.1, centre=(0.0, y, 0.0)) for y in (0.0, 0.2)
)
result = sf.simulate(problem, curves, until=1.0, record=sf.every(1.0))
for name in ("position", "tension"):
    values = result.data["trajectory"][name].to_numpy()
    print(hashlib.sha256(values.tobytes()).hexdigest())
"""


@pytest.mark.slow
def test_a_run_is_the_same_with_and_without_compiled_kernels_at_hand(tmp_path):
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    fresh, cached = (
        subprocess.run(
            [sys.executable, "-c", SCRIPT], env=environment, check=True, capture_output=True
        ).stdout
        for _ in range(2)
    )
    assert len(fresh) > 100
    assert fresh == cached
