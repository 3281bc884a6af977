"""The report is one page that holds everything, escapes everything and stands for itself."""

from __future__ import annotations

import json
import tomllib
from html.parser import HTMLParser

import numpy as np
import pytest
import xarray as xr

from stokesfibers.config.case import case_from_tables
from stokesfibers.core.errors import InputError
from stokesfibers.observe.averages import block_average
from stokesfibers.studio.report import report, report_text
from stokesfibers.studio.report_averages import has_averages, run_averages
from stokesfibers.studio.report_facts import case_tables
from stokesfibers.studio.report_figures import drawings
from stokesfibers.studio.report_toml import toml_text

VOID = {"meta", "link", "img", "br", "hr"}
NASTY = "<script>alert('x')</script>\" & more"


class Page(HTMLParser):
    """Tags, attributes and text of a page; complains about tags that do not close."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.words: list[str] = []
        self.open: list[str] = []
        self.feed(source)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.words.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self.words).split())


CASE = {
    "engine": "spectral",
    "fiber": [
        {"length": 1.0, "slenderness": 0.01, "rigidity": 1.0, "count": 2},
        {"length": 0.5, "slenderness": 0.02, "rigidity": 1.0, "count": 1},
    ],
    "fluid": {"mu_bar": 20000.0},
    "flow": {"kind": "shear", "rate": 1.0},
    "domain": {"kind": "free"},
    "model": {"mobility": "nonlocal", "regularization": {"kind": "spheroidal", "m": 2.0}},
    "stepping": {"rtol": 1e-3, "until": 4.0},
    "initial": {"kind": "suspension", "seed": 1, "orientation": {"kind": "isotropic"}},
    "record": {"positions_every": 0.1},
}
STATUS = {"code": "done", "time": 4.0, "explanation": "", "hint": "", "trust": "trusted"}


def made_up(fibers: int, records: int = 9) -> xr.DataTree:
    """Return a run of fibers that bend in the plane x, y."""
    time = np.linspace(0.0, 4.0, records)
    observed = np.linspace(0.0, 4.0, 81)
    s = np.linspace(0.0, 1.0, 11)
    bend = 1.0 + np.sin(time)[:, None, None] * (s - 0.5) + 0.1 * np.arange(fibers)[:, None]
    along = np.stack([np.cos(bend), np.sin(bend), 0.0 * bend], axis=-1)
    position = np.cumsum(along, axis=2) * 0.1
    stress = np.zeros((81, 3, 3))
    stress[:, 0, 1] = 3.0 + np.sin(40.0 * observed)
    scalars = {
        "first_normal_stress_difference": np.sin(observed),
        "second_normal_stress_difference": 0.2 * np.sin(observed),
        "shear_stress": np.cos(observed),
        "smallest_gap": 0.1 + 0.05 * np.cos(observed),
    }
    each = {"elastic_energy": 0.5, "largest_curvature": 1.0, "length_error": 1e-7}
    steps = np.linspace(0.04, 4.0, 100)
    wall = np.tile([0.25, 0.5], (100, 1))
    tree = xr.DataTree.from_dict(
        {
            "/trajectory": xr.Dataset(
                {
                    "position": (("time", "fiber", "node", "space"), position),
                    "tension": (("time", "fiber", "node"), np.sin(bend) + 0.0 * s),
                    "arclength": (("fiber", "node"), np.tile(s, (fibers, 1))),
                },
                coords={"time": time},
            ),
            "/observables": xr.Dataset(
                {
                    **{k: ("time", v) for k, v in scalars.items()},
                    **{
                        k: (
                            ("time", "fiber"),
                            v * np.abs(np.sin(observed))[:, None] ** 2 + np.zeros(fibers),
                        )
                        for k, v in each.items()
                    },
                    "particle_stress": (("time", "i", "j"), stress),
                    "orientation_tensor": (("time", "i", "j"), np.tile(np.eye(3) / 3, (81, 1, 1))),
                },
                coords={"time": observed},
            ),
            "/numerics": xr.Dataset(
                {
                    "step_size": ("step", np.full(100, 0.04)),
                    "rejected": ("step", np.eye(1, 100, 7, dtype=np.int64)[0] * 3),
                    "wall_time": (("step", "stage"), wall),
                },
                coords={"time": ("step", steps), "stage": ["solve", "rest"]},
            ),
        }
    )
    tree.attrs.update(case=json.dumps(CASE), status=dict(STATUS))
    tree.attrs["provenance"] = json.dumps(
        {"time": "2024-05-06", "command": "run x", "versions": {"stokesfibers": "9.9"}}
    )
    return tree


@pytest.fixture
def three():
    """Three fibers."""
    return made_up(3)


@pytest.fixture
def few_figures(monkeypatch):
    """Leave out all figures but the energy, which takes time."""
    from stokesfibers.studio import report_figures

    every = report_figures.drawings
    monkeypatch.setattr(
        report_figures,
        "drawings",
        lambda data: (d for d in every(data) if d.caption.startswith("Elastic energy")),
    )


def test_the_page_is_whole_and_asks_for_nothing_outside(three):
    page = Page(report_text(three, "my run"))
    names = [tag for tag, _ in page.tags]
    assert "script" not in names
    for tag, attributes in page.tags:
        for name in ("src", "href", "srcset"):
            target = attributes.get(name)
            assert target is None or target.startswith(("data:", "#")), (tag, target)
        if tag == "img":
            assert len(attributes.get("alt") or "") > 20
    images = [a.get("class") for tag, a in page.tags if tag == "img"]
    assert images.count("on-light") == images.count("on-dark") == names.count("figure") >= 8
    anchors = {a["href"] for tag, a in page.tags if tag == "a"}
    places = {f"#{a['id']}" for tag, a in page.tags if tag == "section"}
    assert anchors == places
    assert names.count("h1") == 1
    assert ("html", {"lang": "en"}) in page.tags


@pytest.mark.usefixtures("few_figures")
def test_numbers_of_the_run_are_on_the_page(three):
    words = Page(report_text(three)).text
    for part in (
        "This run is done.",
        "can be trusted",
        "steps 100",
        "rejected tries 3",
        "wall time of the steps, solve 25 s",
        "wall time of the steps, all stages 1 min 15 s",
        "smallest gap between surfaces 0.05",
        "largest relative length error 9.99",
        "3 flexible fibers",
        "run x",
        "stokesfibers 9.9",
        "TornbergShelley2004",
        "stokesfibers run case.toml --out run-again.zarr",
    ):
        assert part in words, part


@pytest.mark.usefixtures("few_figures")
def test_nothing_from_the_case_becomes_html(three):
    case = {**CASE, "initial": {"kind": "file", "path": NASTY}, NASTY: {NASTY: NASTY}}
    three.attrs["case"] = json.dumps(case)
    three.attrs["provenance"] = json.dumps({"command": NASTY, "time": NASTY})
    three.attrs["status"] = {**STATUS, "explanation": NASTY}
    page = Page(report_text(three, NASTY))
    assert "script" not in [tag for tag, _ in page.tags]
    assert page.text.count("<script>alert('x')</script>") >= 6


@pytest.mark.usefixtures("few_figures")
def test_doubts_are_said_with_their_reasons(three):
    reason = {"quantity": "q", "value": 2.0, "limit": 1.0, "time": 3.0}
    reason |= {"what": "the length", "hint": "Take smaller steps."}
    three.attrs["status"] = {**STATUS, "trust": "doubtful", "reasons": [reason]}
    words = Page(report_text(three)).text
    assert "doubtful" in words
    assert "the length: 2 at t = 3, trusted up to 1. Take smaller steps." in words
    three.attrs["status"] = {"code": "failed", "time": 1.0, "explanation": "It broke."}
    words = Page(report_text(three)).text
    assert "This run failed" in words
    assert "It broke." in words
    assert "did not watch its own balances" in words


@pytest.mark.usefixtures("few_figures")
@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("failed", "Nothing was beyond its limit until then."),
        ("running", "Nothing has been beyond its limit so far."),
        ("done", "The result can be trusted"),
    ],
)
def test_a_run_that_watched_itself_is_not_said_not_to_have(code, told, three):
    error = 1e-6 * three["observables"]["shear_stress"]
    three["observables"] = three["observables"].to_dataset().assign(energy_error=error)
    trust = "trusted" if code == "done" else ""
    three.attrs["status"] = {**STATUS, "code": code, "trust": trust}
    words = Page(report_text(three)).text
    assert told in words
    assert "did not watch" not in words
    assert ("The result can be trusted" in words) == (code == "done")


SOLVER = {"solver": "fixed_point", "tolerance": 1e-6, "most": 100}


@pytest.mark.parametrize(
    ("engine", "count", "said"),
    [
        ("spectral", 1, ()),
        ("spectral", 2, ("close_approach",)),
        ("paper", 1, ("beta",)),
        ("paper", 2, ("beta", "solver", "tolerance", "close_approach")),
    ],
)
def test_keys_without_effect_are_not_in_the_tables_of_the_case(engine, count, said):
    case = {
        "engine": engine,
        "fiber": [{"length": 1.0, "count": count}],
        "domain": {"kind": "free"},
        "model": {"mobility": "nonlocal", "close_approach": {"kind": "smooth"}},
        "constraint": {"beta": 20.0, **SOLVER},
    }
    page = case_tables(case)
    words = ("beta", "solver", "tolerance", "close_approach")
    assert tuple(word for word in words if word in page) == said
    assert "mobility" in page
    for odd in ({**case, "fiber": 3}, {**case, "constraint": 5, "domain": None}):
        assert "engine" in case_tables(odd)


def test_a_run_that_holds_almost_nothing_has_a_report():
    words = Page(report_text(xr.DataTree())).text
    assert "not recorded" in words
    empty = made_up(1, records=9)
    for name in ("observables", "numerics"):
        empty[name] = xr.DataTree()
    empty.attrs.clear()
    assert "fibers 1" in Page(report_text(empty)).text


def test_a_python_flow_is_not_run_without_leave(three, tmp_path):
    flow = tmp_path / "flow.py"
    flow.write_text("raise SystemExit('it ran')")
    case = {**CASE, "flow": {"kind": "python", "file": str(flow)}}
    three.attrs["case"] = json.dumps(case)
    words = Page(report_text(three)).text
    assert "groups are not known here" in words
    assert "--allow-python" in words


def test_figures_fit_the_run(three):
    flat = [d.caption for d in drawings(three)]
    assert any("Centrelines" in c for c in flat)
    assert any("Stress per volume" in c for c in flat)
    assert not any("in the cell" in c for c in flat)
    three["trajectory"]["position"][..., 2] = np.linspace(0.0, 0.5, 11)
    solid = [d.caption for d in drawings(three)]
    assert sum("in the cell" in c for c in solid) == 2
    assert not any("Orientation" in d.caption for d in drawings(made_up(1)))


@pytest.mark.parametrize("tables", [CASE, {"a": {"b": {"c": [1, 2.5, True, 'q"\\\n']}, "d": {}}}])
def test_the_case_reads_back_from_its_text(tables):
    assert tomllib.loads(toml_text(tables)) == tables


def test_the_text_of_a_resolved_case_is_a_case():
    # the radius of a kind follows from its own length
    case = case_from_tables({k: v for k, v in CASE.items() if k != "initial"}).tables()
    again = case_from_tables(tomllib.loads(toml_text(case)))
    assert again.tables() == case


def test_averages_are_those_of_the_blocks(three):
    assert has_averages(three)
    found = run_averages(three, after=1.0, block=0.5)
    time = three["observables"]["time"].to_numpy()
    stress = three["observables"]["particle_stress"].to_numpy()[:, 0, 1]
    own = block_average(time[time >= 1.0], stress[time >= 1.0], block=0.5)
    assert (found[0].mean, found[0].error) == (own.mean, own.error)
    assert found[0].after == 1.0
    assert [one.variable.unit for one in found] == ["force length^-2"] * 3
    with pytest.raises(InputError, match="after"):
        run_averages(three, after=3.99)


def test_bad_places_are_refused_and_failures_leave_nothing(three, tmp_path, monkeypatch):
    for name in ("a.pdf", "no/a.html"):
        with pytest.raises(InputError, match="path"):
            report(three, tmp_path / name)

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    monkeypatch.setattr("stokesfibers.studio.report.figures", lambda _: ())
    with pytest.raises(OSError, match="space"):
        report(three, tmp_path / "a.html")
    assert list(tmp_path.iterdir()) == []
