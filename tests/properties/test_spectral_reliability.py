"""Suspensions of the high-order engine, and single fibers: stops, faults, threads, memory."""

from __future__ import annotations

import errno
import gc
import os
import random
import signal
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.domain import Free, Periodic
from stokesfibers.fiber.suspension import Suspension
from stokesfibers.io import atomic
from stokesfibers.load import Gravity, StericRepulsion
from stokesfibers.run.start import first_carry
from stokesfibers.stepping import spectral_solve
from stokesfibers.stepping.engines import stepper_of
from support import assert_close, assert_same

ENGINE = sf.SpectralEngine(nodes=10, adapt_nodes=True, rtol=1e-4)
RECORD = sf.every(0.1, observables=0.03, checkpoint=0.2)
UNTIL = 1.6


def _suspension(**changes):
    arguments = {
        "mu_bar": 2e4,
        "flow": sf.OscillatoryShear(1.5, frequency=0.4),
        "engine": ENGINE,
        "domain": Periodic((2.0, 0.0, 0.0)),
    }
    return sf.Problem(sf.Fiber(slenderness=1e-2, count=3), **(arguments | changes))


def _single(**changes):
    arguments = {"mu_bar": 2e4, "flow": sf.OscillatoryShear(1.5, frequency=0.4), "engine": ENGINE}
    return sf.Problem(sf.Fiber(slenderness=1e-2), **(arguments | changes))


def _start(problem, until=UNTIL, **options):
    if len(problem.fibers) > 1:
        box = Suspension(seed=3, box=(2.0, 0.8, 0.8), least_gap=0.05)
        curves = box.curves(problem.fibers, problem.domain.lengths)
    else:
        curves = sf.shapes.nearly_straight(problem.fibers[0], angle=2.3, amplitude=0.2)
    return sf.simulate(problem, curves, until=until, record=RECORD, **options)


CASES = {
    "suspension": _suspension,
    "steric": lambda: _suspension(load=StericRepulsion(strength=2e3, range=0.3)),
    "gravity": lambda: _suspension(load=Gravity((0.0, -2e3, 0.0)), domain=Free()),
}


@pytest.fixture(scope="module", params=CASES)
def problem(request):
    """A suspension."""
    return CASES[request.param]()


@pytest.fixture(scope="module")
def whole(problem):
    """Its run without a stop."""
    result = _start(problem, threads=1)
    assert result.status.code == "done"
    steps = result.data["numerics"].to_dataset()
    assert np.ptp(steps["order"].to_numpy()) >= 3
    assert steps["nodes"].to_numpy()[-1] > 10
    return result.data


def test_suspension_stopped_at_random_steps_is_bitwise_the_unstopped_one(problem, whole, tmp_path):
    """Each stop is a SIGINT in the middle of a history of mixed orders and steps."""
    times, out = whole["numerics"]["time"].to_numpy(), tmp_path / "run.zarr"
    for stop in sorted(random.Random(5).sample(range(1, len(times) - 1), 3)):

        def watch(moment, stop=stop):
            if moment.time == times[stop]:
                signal.raise_signal(signal.SIGINT)

        options = {"watch": watch, "threads": 1}
        again = out.exists()
        result = sf.resume(out, **options) if again else _start(problem, out=out, **options)
        assert result.status.code == "interrupted"
        assert result.status.time == times[stop]
    assert_same(sf.resume(out).data, whole)


def test_threads_change_no_bit_of_a_run(problem, whole):
    assert_same(_start(problem, threads=2).data, whole)


@pytest.mark.parametrize("make", [_single, _suspension], ids=["single", "suspension"])
@pytest.mark.parametrize("fault", ["nan", "raises", "shape"])
def test_flow_that_fails_on_the_way_ends_the_run_with_what_it_has(make, fault, tmp_path):
    def velocity(points, t):
        if t > 0.45:
            if fault == "raises":
                raise RuntimeError("no wind")
            return points * np.nan if fault == "nan" else points[:, :2]
        return points * np.array([0.0, 1.0, -1.0])

    problem = make(flow=sf.UserFlow(velocity))
    out = tmp_path / "run.zarr"
    result = _start(problem, out=out)
    assert result.status.code == "failed"
    assert "The background flow cannot be used in the next step" in result.status.explanation
    if fault == "raises":
        assert "no wind" in result.status.explanation
    assert 0.2 < result.status.time <= 0.45
    kept = sf.open_run(out)
    assert kept.attrs["status"]["code"] == "failed"
    assert kept["numerics"]["time"].to_numpy()[-1] == result.status.time
    for values in kept["trajectory"].to_dataset().data_vars.values():
        assert np.isfinite(values.to_numpy()).all()
    mended = make(flow=sf.UserFlow(lambda points, _: points * np.array([0.0, 1.0, -1.0])))
    assert sf.resume(out, problem=mended).status.code == "done"
    assert_same(sf.open_run(out), _start(mended).data)


@pytest.mark.parametrize("writes", [120, 160, 300])
def test_full_disk_ends_a_run_that_can_go_on(writes, tmp_path, monkeypatch):
    problem, out, real, left = _single(), tmp_path / "run.zarr", atomic._write, [writes]

    def write(fd, data):
        left[0] -= 1
        if left[0] < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(fd, data)

    with monkeypatch.context() as patch:
        patch.setattr(atomic, "_write", write)
        result = _start(problem, out=out)
    assert result.status.code == "failed"
    assert "No space left on device" in result.status.explanation
    whole = _start(problem).data
    kept = result.data["trajectory"]["position"].to_numpy()
    assert len(kept) < whole["trajectory"].sizes["time"]
    assert np.array_equal(kept, whole["trajectory"]["position"].to_numpy()[: len(kept)])
    assert sf.resume(out).status.code == "done"
    assert_same(sf.open_run(out), whole)


@pytest.mark.parametrize(
    ("options", "fragment"),
    [
        ({"nodes": 3}, "nodes"),
        ({"rtol": 0.0}, "rtol"),
        ({"rtol": 1e-14}, "rtol"),
        ({"rtol": float("nan")}, "rtol"),
        ({"rtol": 1e-3, "dt": 0.1}, "either rtol or dt"),
        ({"dt": -0.1}, "dt"),
        ({"dt": 0.1, "order": 6}, "order"),
        ({"order": 3}, "order"),
        ({"newton_passes": 0}, "newton_passes"),
        ({"adapt_nodes": "yes"}, "adapt_nodes"),
    ],
    ids=str,
)
def test_bad_settings_are_refused_in_one_line(options, fragment):
    with pytest.raises(sf.InputError, match=fragment) as fault:
        sf.SpectralEngine(**options)
    assert "\n" not in str(fault.value)


@pytest.mark.parametrize("make", [_single, _suspension], ids=["single", "suspension"])
def test_a_step_without_a_solution_ends_the_run_with_a_word(make, tmp_path, monkeypatch):
    real, calls = spectral_solve.IncrementSolver.solve, [0]

    def solve(*args, **options):
        calls[0] += 1
        if calls[0] > 40:
            raise np.linalg.LinAlgError("singular")
        return real(*args, **options)

    monkeypatch.setattr(spectral_solve.IncrementSolver, "solve", solve)
    result = _start(make(), out=tmp_path / "run.zarr")
    assert result.status.code == "failed"
    assert "No step from t = " in result.status.explanation
    assert result.data["numerics"].sizes["step"] > 20


@pytest.mark.slow
@pytest.mark.parametrize("make", [_single, _suspension], ids=["single", "suspension"])
def test_memory_does_not_grow_from_step_to_step(make):
    """Live bytes of Python and NumPy after many steps, the run thrown away as it goes."""
    problem = make(engine=sf.SpectralEngine(nodes=16, dt=0.01, order=3))
    stepper = stepper_of(problem, threads=1)
    box = Suspension(seed=3, box=(2.0, 0.8, 0.8), least_gap=0.05)
    carry = first_carry(stepper, box.curves(problem.fibers, problem.domain.lengths))
    for _ in range(150):
        carry, _ = stepper.step(carry)
    tracemalloc.start()
    used = []
    for _ in range(3):
        for _ in range(300):
            carry, _ = stepper.step(carry)
            stepper.view(carry, stepper.time(carry))
        gc.collect()  # empties the interpreter's lists of free tuples, which count as live
        used.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert max(used) - used[0] < 20_000, "less than one array per step"


_LONG = """
import resource
import stokesfibers as sf
fiber = sf.Fiber(slenderness=1e-2)
engine = sf.SpectralEngine(nodes=16, dt=0.01, order=3)
problem = sf.Problem(fiber, mu_bar=1e4, flow=sf.OscillatoryShear(1.0, frequency=0.2), engine=engine)
curve = sf.shapes.nearly_straight(fiber, angle=2.3, amplitude=0.2)
seen = []
def watch(moment):
    seen.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
sf.simulate(problem, curve, until=30.0, record=sf.every(0.5), out={out!r}, watch=watch)
print(len(seen), seen[1000], seen[-1])
"""


@pytest.mark.slow
def test_memory_of_a_stored_run_does_not_grow(tmp_path):
    script = _LONG.format(out=str(tmp_path / "run.zarr"))
    said = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True)
    steps, early, late = map(int, said.stdout.split())
    assert steps > 2500
    assert late - early < 2048, "kilobytes over two thousand steps"


def test_a_store_in_a_folder_that_cannot_be_written_is_refused(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    monkeypatch.setattr(Path, "mkdir", refuse)
    with pytest.raises(sf.StoreError, match="Permission denied"):
        _start(_single(), out=tmp_path / "run.zarr")
    assert list(tmp_path.iterdir()) == []


def test_fixed_steps_of_a_suspension_go_on_bitwise(tmp_path):
    problem = _suspension(engine=sf.SpectralEngine(nodes=12, dt=0.02, order=4))
    whole = _start(problem, until=0.8).data
    _start(problem, until=0.3, out=tmp_path / "run.zarr")
    assert_same(sf.resume(tmp_path / "run.zarr", until=0.8).data, whole)
    assert_close(whole["numerics"]["step_size"].to_numpy()[-5:], np.full(5, 0.02), rtol=1e-12)
