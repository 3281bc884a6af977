"""What a run says of its own error: good runs are trusted, bad ones doubted for their reason."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stokesfibers as sf
from stokesfibers.cli.show import _say_trust
from stokesfibers.config.case import load_case
from stokesfibers.core.status import Reason, Status
from stokesfibers.kernels.spectral import step_errors
from stokesfibers.observe.balance import Balance
from stokesfibers.run import simulate as simulate_module
from stokesfibers.run.health import WEIGHED, Health, limits
from stokesfibers.run.start import first_carry
from stokesfibers.stepping.engines import stepper_of
from stokesfibers.stepping.spectral_run import SpectralRunStepper
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
    assert float(result.data["observables"].to_dataset()["elastic_energy"].max()) > 10.0, (
        "it has to bend"
    )


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
        patch.setattr(Recorder, "judged", lambda _, status, carry: status)  # noqa: ARG005
        old = _run(sf.SpectralEngine(rtol=1e-4), until=1.0, out=out)
    assert old.status.trust == ""
    assert not set(WEIGHED) & set(sf.open_run(out)["observables"].data_vars)
    again = sf.resume(out, until=2.0, threads=1)
    assert (again.status.code, again.status.trust) == ("done", "trusted")
    held = {"code": "done", "time": 1.0, "explanation": "", "hint": ""}
    assert Status.from_dict(held) == Status("done", 1.0)


def test_checkpoints_of_older_versions_held_no_speed():
    health = _weighed([replace(_power(0.1 * k, 0.0), pace=2.0) for k in range(1, 21)])
    held = json.loads(json.dumps(health.state()))
    assert held["last"].pop("speed") == 0.0
    again = Health(health._stepper, 1)
    again.recall(held)
    assert again._last is not None
    assert again._last.speed == 2.0


def test_what_settles_is_off_per_length_of_its_way():
    """Two fibers fall by 135 lengths and are off by 3e-3, of their shapes by far less."""
    fiber = sf.Fiber(slenderness=1e-2, count=2)
    load = sf.Gravity((0.0, -100.0, 0.0))
    problem = sf.Problem(fiber, mu_bar=1.0, load=load, engine=sf.SpectralEngine(rtol=1e-3))
    along = np.linspace(-0.5, 0.5, 11)
    points = np.array([[[s, 0.0, z] for s in along] for z in (0.0, 0.25)])
    result = sf.simulate(problem, points, until=0.1, record=sf.every(0.05), threads=1)
    assert result.status.trust == "trusted"
    motion = result.data["observables"]["motion_error"].to_numpy()
    fallen = -float(result.data["observables"]["centre"].isel(time=-1, fiber=0).sel(space="y"))
    assert fallen > 100.0
    assert 1e-3 < fallen * motion[-1] < 1e-2


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


def _rotating(length=1.0, rigidity=1.0, **units):
    """Return a run in which a nearly straight fiber only turns, for the same mu_bar."""
    fiber = sf.Fiber(slenderness=1e-3, length=length, rigidity=rigidity)
    flow, engine = sf.Rotation((0.0, 0.0, 1.0)), sf.SpectralEngine(rtol=1e-4)
    problem = sf.Problem(fiber, flow=flow, engine=engine, **(units or {"mu_bar": 1e5}))
    curve = sf.shapes.nearly_straight(fiber, angle=2.0, amplitude=-1e-4)
    record = sf.every(10.0, observables=1.0)
    return sf.simulate(problem, curve, until=10.0, record=record, threads=1)


def test_a_rigid_rotation_is_trusted_in_all_units():
    """Nothing is dissipated but by errors: the missing power is held against these."""
    plain = _rotating()
    length, rigidity = 20e-6, 7e-26
    viscosity = 1e5 * rigidity / length**4 / (8.0 * np.pi)
    for other in (plain, _rotating(2.0, 3.0), _rotating(length, rigidity, viscosity=viscosity)):
        assert (other.status.code, other.status.trust) == ("done", "trusted")
        found, expected = _last(other), _last(plain)
        assert 0.0 < found["energy_error"] < 1e-4
        assert found["energy_error"] == pytest.approx(expected["energy_error"], rel=1e-2)


def test_steps_behind_the_last_that_was_weighed_are_judged_at_the_end(tmp_path):
    """Two fibers: 28 steps, of which only the first eight have had their turn."""
    fiber = sf.Fiber(slenderness=1e-2, count=2)
    engine = sf.SpectralEngine(dt=0.15, order=2)
    problem = sf.Problem(fiber, mu_bar=1e3, flow=sf.Shear(1.0), engine=engine)
    along = np.linspace(-0.5, 0.5, 21)
    turn = np.array([np.cos(2.6), np.sin(2.6), 0.0]), np.array([-np.sin(2.6), np.cos(2.6), 0.0])
    points = np.array([np.outer(along, turn[0]) + off * turn[1] for off in (0.2, -0.2)])
    until = {"record": sf.every(0.5), "threads": 1}
    whole = sf.simulate(problem, points, until=2.0, out=tmp_path / "whole.zarr", **until)
    assert 16 < whole.data["numerics"].sizes["step"] < 32
    assert whole.status.trust == "doubtful"
    reasons = {r.quantity: r for r in whole.status.reasons}
    assert {"energy_error", "motion_error"} <= set(reasons)
    assert reasons["motion_error"].value > 3.0 * reasons["motion_error"].limit
    assert reasons["motion_error"].time >= 2.0
    assert Status.from_dict(sf.open_run(tmp_path / "whole.zarr").attrs["status"]) == whole.status
    # The look at the end leaves no trace: it says the same without a step, and goes on bitwise.
    assert sf.resume(tmp_path / "whole.zarr", threads=1).status == whole.status
    sf.simulate(problem, points, until=1.0, out=tmp_path / "part.zarr", **until)
    on = sf.resume(tmp_path / "part.zarr", until=4.0, threads=1)
    far = sf.simulate(problem, points, until=4.0, **until)
    assert on.status == far.status
    assert_same(on.data, far.data)


def test_a_run_that_blew_up_is_never_trusted():
    fiber = sf.Fiber(slenderness=1e-3)
    engine = sf.PaperEngine(intervals=50, dt=0.05, beta=20.0)
    problem = sf.Problem(fiber, mu_bar=3e3, flow=sf.Shear(1.0), engine=engine)
    curve = sf.shapes.nearly_straight(fiber, angle=2.9, amplitude=2.0)
    seen = []
    result = sf.simulate(
        problem,
        curve,
        until=40.0,
        record=sf.every(10.0),
        threads=1,
        watch=lambda moment: seen.append(moment.length_error),
    )
    assert (result.status.code, result.status.trust) == ("failed", "doubtful")
    (reason,) = result.status.reasons
    assert reason.quantity == "length_error"
    assert reason.value > 0.2 > max(seen), "of the step that was not taken"
    recorded = result.data["observables"].to_dataset()["length_error"]
    assert float(recorded.max()) < 1e-3, "no record shows it"


@pytest.mark.parametrize("engine", [None, sf.PaperEngine(intervals=16, dt=0.1, beta=1.0)])
def test_surfaces_that_overlap_are_told_first_with_what_keeps_fibers_apart(engine):
    health = Health(stepper_of(_rotating_problem(engine), 1), 1)
    health.note("energy_error", 1.0, 0.5)
    health.note("overlap", 1e-6, 0.7)
    health.note("length_error", 0.5, 0.5)
    reasons = health.judged(Status("done", 1.0), []).reasons
    assert [r.quantity for r in reasons] == ["overlap", "energy_error", "length_error"]
    assert ["steric" in r.hint for r in reasons] == [True, False, False]


@pytest.mark.parametrize("code", ["running", "failed"])
def test_only_what_ended_is_trusted(code):
    stepper = stepper_of(_rotating_problem(), 1)
    health = Health(stepper, 1)
    assert health.judged(Status(code, 1.0), []).trust == ""
    assert health.judged(Status("done", 1.0), []).trust == "trusted"
    health.note("length_error", 1.0, 0.5)
    assert health.judged(Status(code, 1.0), []).trust == "doubtful"


def _rotating_problem(engine=None):
    return sf.Problem(
        sf.Fiber(slenderness=1e-2),
        mu_bar=1e3,
        flow=sf.Rotation((0.0, 0.0, 1.0)),
        engine=engine or sf.SpectralEngine(nodes=12, rtol=1e-8),
    )


def _weighed(balances, engine=None, steps=20):
    """Return the health of a run that finds `balances` at its turns, one after the other."""
    stepper = stepper_of(_rotating_problem(engine), 1)
    health = Health(stepper, 1)
    health._every = 1
    left = iter(balances)
    health._weigh = lambda _: next(left)
    carry = stepper.start((sf.shapes.straight(stepper.problem.fibers[0], angle=1.0),))
    for _ in range(steps):
        carry, _ = stepper.step(carry)
        health.step(carry)
    return health


def _power(time, missing, dissipation=1.0):
    return Balance(
        time, missing - dissipation, dissipation, 0.0, 0.0, defect=0.0, pace=0.0, speed=0.0
    )


def test_what_is_missing_early_is_held_against_all_that_is_dissipated():
    """Rounding at the start, where next to nothing is dissipated, is no doubt; later it is one."""
    early = [_power(1e-6 * k, 1e-6, 1.0) for k in range(1, 19)]
    health = _weighed([*early, _power(2e-5, 0.0), _power(1e3, 0.0)])
    assert health.judged(Status("done", 1e3), []).trust == "trusted"
    health = _weighed([*early, _power(2e-5, 0.0), _power(3e-5, 0.0)])
    assert [r.quantity for r in health.judged(Status("done", 1.0), []).reasons] == ["energy_error"]


def test_what_was_missing_and_came_back_is_doubted():
    """The largest integral counts, not the last, in which errors may cancel."""
    there = [_power(0.1 * k, 1e-3) for k in range(1, 11)]
    back = [_power(0.1 * k, -1e-3) for k in range(11, 21)]
    health = _weighed([*there, *back])
    (reason,) = health.judged(Status("done", 2.0), []).reasons
    assert reason.quantity == "energy_error"
    assert reason.time == pytest.approx(1.0, abs=0.11), "between both"
    assert reason.value == pytest.approx(1e-3 / 2.0, rel=0.1)


@pytest.mark.parametrize(("speed", "moved"), [(0.2, 1.0), (5.0, 10.0)])
def test_errors_of_motion_are_integrals_over_what_moved(speed, moved):
    """By trapezoids, of t from 0.1 to 2 and what is first known from 0 on; 1 is the least."""
    balances = [replace(_power(0.1 * k, 0.0), defect=1e-4 * k, speed=speed) for k in range(1, 21)]
    found = _weighed(balances).state()["now"]["motion_error"]
    assert found == pytest.approx((1e-5 + 0.5e-3 * (2.0**2 - 0.1**2)) / moved, rel=1e-12)


def test_what_errors_within_the_limit_dissipate_counts_as_dissipated():
    """rtol 8 pi mu L^3 pace^2 = 1e-8 1e3 2^2 beside 1e-5 that the flow gives; 1e-6 is missing."""
    balances = [
        Balance(0.1 * k, 1e-6 - 1e-5, 1e-5, 0.0, 0.0, defect=0.0, pace=2.0, speed=0.0)
        for k in range(1, 21)
    ]
    found = _weighed(balances).state()["now"]["energy_error"]
    assert found == pytest.approx(1e-6 / (1e-5 + 4e-5), rel=1e-12)


@pytest.mark.parametrize("lost", [float("nan"), float("inf")])
def test_what_is_not_finite_is_doubted_and_survives_a_checkpoint(lost):
    balances = [_power(0.1 * k, 0.0) for k in range(1, 21)]
    balances[17] = Balance(1.8, *[lost] * 7)
    health = _weighed(balances)
    status = health.judged(Status("done", 2.0), [])
    assert {r.quantity for r in status.reasons} == {"energy_error", "motion_error"}
    held = json.loads(json.dumps(health.state(), allow_nan=False))
    again = Health(health._stepper, 1)
    again.recall(held)
    assert again.judged(Status("done", 2.0), []) == status
    assert again.state() == health.state()


@pytest.mark.parametrize("lost", [float("nan"), float("inf")])
def test_a_quantity_that_is_not_finite_is_the_worst(lost):
    health = Health(stepper_of(_rotating_problem(), 1), 1)
    health.note("spatial_error", lost, 0.5)
    health.note("spatial_error", 1.0, 0.7)
    (reason,) = health.judged(Status("done", 1.0), []).reasons
    assert (reason.value, reason.time) == (1e308, 0.5)
    none = Health(stepper_of(_rotating_problem(sf.PaperEngine(intervals=20)), 1), 1)
    none.note("spatial_error", float("nan"), 0.5)  # which that engine does not measure
    assert none.judged(Status("done", 1.0), []).trust == "trusted"


def test_a_fiber_whose_resolution_is_lost_is_seen_beside_others():
    """NaN wins, wherever among the fibers it stands."""
    thin, thick = sf.Fiber(slenderness=1e-3), sf.Fiber(slenderness=1e-2)
    for fibers in ((thin, thick), (thick, thin)):
        problem = sf.Problem(
            fibers, mu_bar=1e2, flow=sf.Shear(1.0), engine=sf.SpectralEngine(nodes=12, rtol=1e-3)
        )
        stepper = stepper_of(problem, 1)
        assert isinstance(stepper, SpectralRunStepper)
        along, zero = np.linspace(-0.5, 0.5, 21), np.zeros(21)
        points = np.stack([[along, zero + y, zero] for y in (0.0, 0.5)]).transpose(0, 2, 1)
        carry = first_carry(stepper, points)
        resolved = stepper._on(12).resolutions(carry)
        assert np.isfinite(stepper._spatial_error(carry, resolved))
        resolved[0] = replace(resolved[0], error=np.array([np.nan]))
        assert np.isnan(stepper._spatial_error(carry, resolved))


def test_errors_of_steps_keep_what_is_not_a_number():
    """NaN at the first, a middle or the last node is not dropped by the largest of the others."""
    fresh, history = np.ones((2, 3, 4)), np.ones((2, 2, 3, 4))

    def errors(table):
        rows = np.ones((1, 2)), np.ones(1)
        return step_errors(*rows, history, fresh, table, (0.1, 0.1, 1e-15), np.zeros(2))

    for node in range(4):
        table = np.eye(4)
        table[node, node] = np.nan
        assert np.isnan(errors(table)).all()
    assert np.isfinite(errors(np.eye(4))).all()
    fresh[0, 0, 0] = np.nan
    assert np.isnan(errors(np.eye(4))).all()


def test_show_calls_no_failed_run_trusted(capsys):
    """Some versions stored it for each run they had no doubts about."""
    for code in ("failed", "running"):
        _say_trust(Status(code, 1.0, trust="trusted").to_dict(), watched=False)
        assert capsys.readouterr().out == ""
        _say_trust(Status(code, 1.0, trust="trusted").to_dict(), watched=True)
        said = capsys.readouterr().out
        assert "within limits" in said
        assert "trusted" not in said
    _say_trust(Status("done", 1.0, trust="trusted").to_dict(), watched=True)
    assert capsys.readouterr().out.startswith("trusted")


def test_reasons_survive_json_and_numbers_that_it_cannot_hold():
    reason = Reason("length_error", float("inf"), 1e-4, 2.0, "a fiber changed its length", "Try")
    held = Status("failed", 2.0, trust="doubtful", reasons=(reason,)).to_dict()
    assert held["reasons"][0]["value"] == 1e308
    assert Status.from_dict(held).reasons[0].quantity == "length_error"
    assert str(reason).startswith("a fiber changed its length: inf at t = 2, trusted up to 0.0001")


def test_limits_follow_the_tolerance():
    make = lambda **k: sf.Problem(sf.Fiber(slenderness=1e-2), mu_bar=10.0, flow=sf.Shear(1.0), **k)  # noqa: E731
    found = limits(make(engine=sf.SpectralEngine(rtol=2e-5)))
    assert found.pop("overlap") == 0.0
    assert set(found.values()) == {2e-5}
    assert limits(make(engine=sf.SpectralEngine(dt=0.1)))["energy_error"] == 1e-3
    assert limits(make(engine=sf.PaperEngine()))["length_error"] == 2e-2


QUICK = {"buckling": 3.0, "fig01": 1.0, "extension_si": 50.0, "settling": 2e-3}
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
