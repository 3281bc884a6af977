"""What a run says of its own error: good runs are trusted, bad ones doubted for their reason."""

from __future__ import annotations

import signal
from pathlib import Path

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.config.case import load_case
from stokesfibers.core.status import Reason, Status
from stokesfibers.run import simulate as simulate_module
from stokesfibers.run.health import WEIGHED, Health, limits
from stokesfibers.stepping.engines import stepper_of
from support import assert_same

CASES = Path(__file__).parents[3] / "cases"
RECORD = sf.every(0.25, observables=0.05)


def _run(engine, *, until=6.0, record=RECORD, **options):
    fiber = sf.Fiber(slenderness=1e-3)
    problem = sf.Problem(fiber, mu_bar=3e5, flow=sf.Shear(1.0), engine=engine)
    curve = sf.shapes.nearly_straight(fiber, angle=2.9, amplitude=2.0)
    return sf.simulate(problem, curve, until=until, record=record, threads=1, **options)


def _last(result):
    observables = result.data["observables"].to_dataset()
    return {name: float(observables[name][-1]) for name in WEIGHED}


@pytest.mark.parametrize("rtol", [1e-3, 1e-5])
def test_a_good_run_is_trusted_and_its_errors_follow_the_tolerance(rtol):
    result = _run(sf.SpectralEngine(rtol=rtol))
    assert (result.status.code, result.status.trust) == ("done", "trusted")
    assert result.status.reasons == ()
    found = _last(result)
    assert 1e-4 * rtol < found["motion_error"] < rtol
    assert 0.0 < found["energy_error"] < rtol
    assert found["force_error"] < 1e-10
    assert found["torque_error"] < 1e-10
    assert float(result.data["observables"]["elastic_energy"].max()) > 10.0, "it has to bend"


def test_too_few_nodes_are_what_is_doubted():
    result = _run(sf.SpectralEngine(nodes=12, adapt_nodes=False, rtol=1e-4))
    assert (result.status.code, result.status.trust) == ("done", "doubtful")
    first = result.status.reasons[0]
    assert first.quantity == "spatial_error"
    assert first.value > 10.0 * first.limit
    assert first.limit == 1e-4
    assert 0.0 < first.time <= 6.0
    assert "discretization.nodes" in first.hint
    assert {"energy_error", "length_error"} <= {r.quantity for r in result.status.reasons}
    assert all("nodes" in r.hint for r in result.status.reasons), "one cause, one remedy"


def test_steps_that_are_too_long_are_what_is_doubted():
    result = _run(sf.SpectralEngine(nodes=72, dt=0.25, order=2))
    assert (result.status.code, result.status.trust) == ("done", "doubtful")
    names = [r.quantity for r in result.status.reasons]
    assert "motion_error" in names
    assert "spatial_error" not in names
    assert all("stepping.dt" in r.hint for r in result.status.reasons)
    short = _run(sf.SpectralEngine(nodes=72, dt=0.02, order=4))
    assert short.status.trust == "trusted"


def test_a_grid_that_is_too_coarse_is_doubted_with_the_papers_engine():
    coarse = _run(sf.PaperEngine(intervals=36, dt=0.01, beta=20.0))
    assert (coarse.status.code, coarse.status.trust) == ("done", "doubtful")
    assert {r.quantity for r in coarse.status.reasons} & {"force_error", "length_error"}
    assert all("intervals" in r.hint for r in coarse.status.reasons)
    fine = _run(sf.PaperEngine(intervals=100, dt=0.0128, beta=20.0), until=1.0)
    assert fine.status.trust == "trusted"


def test_fibers_that_cross_are_what_is_doubted():
    """One sinks through the other in a flow that does not see them."""

    def velocity(points, t):  # noqa: ARG001
        found = np.zeros_like(points)
        found[:, 2] = 2.0 * np.exp(-(((points[:, 0] - 0.02) / 0.12) ** 2)) - 1.0
        return found

    along = np.linspace(-0.5, 0.5, 21)
    zero = np.zeros_like(along)
    lower, upper = [zero + 0.02, along + 0.01, zero - 0.38], [along, zero, zero + 0.42]
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-3, count=2),
        mu_bar=100.0,
        flow=sf.UserFlow(velocity),
        engine=sf.SpectralEngine(nodes=16, rtol=1e-3),
    )
    points = np.array([np.stack(lower, axis=1), np.stack(upper, axis=1)])
    result = sf.simulate(problem, points, until=0.8, record=RECORD, threads=1)
    assert "crossings" in result.data.attrs
    assert result.status.trust == "doubtful"
    (reason,) = [r for r in result.status.reasons if r.quantity == "crossings"]
    assert reason.what == "fibers 0 and 1 passed through each other"


def test_a_sum_less_accurate_than_the_run_is_doubted():
    from stokesfibers.summation import FastImages

    problem = sf.Problem(
        sf.Fiber(slenderness=1e-2, count=2),
        mu_bar=10.0,
        domain=sf.Periodic((2.0, 2.0, 2.0)),
        image_sum=FastImages(tolerance=1e-2),
    )
    pytest.importorskip("ducc0")
    status = Health(stepper_of(problem, 1), 1).judged(Status("done", 1.0), [])
    assert [r.quantity for r in status.reasons] == ["sum_tolerance"]
    assert (status.reasons[0].value, status.reasons[0].limit) == (1e-2, 1e-4)


def test_a_run_that_was_stopped_says_the_same_bitwise(tmp_path):
    engine, out = sf.SpectralEngine(nodes=12, adapt_nodes=False, rtol=1e-4), tmp_path / "run.zarr"
    whole = _run(engine, until=3.0)
    steps = []

    def watch(moment):
        steps.append(moment.time)
        if len(steps) in (7, 23):
            signal.raise_signal(signal.SIGINT)

    first = _run(engine, until=3.0, out=out, watch=watch)
    assert first.status.code == "interrupted"
    assert first.status.trust in ("trusted", "doubtful")
    assert sf.resume(out, watch=watch, threads=1).status.code == "interrupted"
    last = sf.resume(out, threads=1)
    assert last.status == whole.status
    assert_same(last.data, whole.data)
    assert Status.from_dict(sf.open_run(out).attrs["status"]) == whole.status


def test_stores_of_older_versions_open_and_go_on(tmp_path, monkeypatch):
    """They lack the observables of a run's health, and its state in the checkpoint."""
    from stokesfibers.run.recorder import Recorder

    out = tmp_path / "run.zarr"
    with monkeypatch.context() as patch:
        patch.setattr(simulate_module, "health_layout", dict)
        patch.setattr(Health, "state", lambda _: None)
        patch.setattr(Recorder, "judged", lambda _, status: status)
        old = _run(sf.SpectralEngine(rtol=1e-4), until=1.0, out=out)
    assert old.status.trust == ""
    assert not set(WEIGHED) & set(sf.open_run(out)["observables"].data_vars)
    again = sf.resume(out, until=2.0, threads=1)
    assert (again.status.code, again.status.trust) == ("done", "trusted")
    held = {"code": "done", "time": 1.0, "explanation": "", "hint": ""}
    assert Status.from_dict(held) == Status("done", 1.0)


def test_a_users_flow_that_fails_when_weighed_does_not_end_the_run():
    """The balance asks for it once more, at a place no step asks for."""
    engine = sf.SpectralEngine(nodes=12, dt=0.1, order=1)
    problem = sf.Problem(
        sf.Fiber(slenderness=1e-2), mu_bar=100.0, flow=sf.Shear(1.0), engine=engine
    )
    health = Health(stepper_of(problem, 1), 1)

    def fails(_):
        raise sf.InputError("flow", "a velocity", "none")

    health._weigh = fails
    stepper = stepper_of(problem, 1)
    carry = stepper.start((sf.shapes.straight(problem.fibers[0], angle=1.0),))
    for _ in range(2):
        carry, _ = stepper.step(carry)
    health.step(carry)
    assert health.judged(Status("done", 0.2), []).trust == "trusted"


def test_reasons_survive_json_and_numbers_that_it_cannot_hold():
    reason = Reason("length_error", float("inf"), 1e-4, 2.0, "a fiber changed its length", "Try")
    held = Status("failed", 2.0, trust="doubtful", reasons=(reason,)).to_dict()
    assert held["reasons"][0]["value"] == 1e308
    assert Status.from_dict(held).reasons[0].quantity == "length_error"
    assert str(reason).startswith("a fiber changed its length: inf at t = 2, trusted up to 0.0001")


def test_limits_follow_the_tolerance():
    make = lambda **k: sf.Problem(sf.Fiber(slenderness=1e-2), mu_bar=10.0, flow=sf.Shear(1.0), **k)  # noqa: E731
    assert set(limits(make(engine=sf.SpectralEngine(rtol=2e-5))).values()) == {2e-5}
    assert limits(make(engine=sf.SpectralEngine(dt=0.1)))["energy_error"] == 1e-3
    assert limits(make(engine=sf.PaperEngine()))["length_error"] == 1e-2


QUICK = {"buckling": 3.0, "fig01": 1.0, "extension_si": 50.0}
SHORT = {"fig02": 1.0, "fig03": 1.0, "fig04": 1.0, "fig12": 0.12, "rigid": 0.25}
LARGE = ("cloud", "sheared_1000")  # hours; looked at by hand
SHORT |= {"sheared_cell": 0.2, "steady_shear": 0.25, "suspension": 1.0}


def test_no_case_is_left_out():
    assert {file.stem for file in CASES.glob("*.toml")} == {*QUICK, *SHORT, *LARGE}


@pytest.mark.parametrize(
    "name", [*QUICK, *(pytest.param(name, marks=pytest.mark.slow) for name in SHORT)]
)
def test_the_cases_that_come_with_it_are_trusted(name):
    until = (QUICK | SHORT)[name]
    case = load_case(CASES / f"{name}.toml", [f"stepping.until={until}"])
    record = sf.every(until, observables=until / 10.0)
    result = sf.simulate(case.problem, case.curves(), until=case.until, record=record, threads=1)
    assert (result.status.code, result.status.trust) == ("done", "trusted"), result.status.reasons
    assert result.data["numerics"].sizes["step"] >= 8
