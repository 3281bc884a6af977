"""The folder of a sweep: one writer, one store and one outcome per case, all that a restart needs.

::

    DIR/sweep.json          the resolved sweep: axes, cases, what is collected
    DIR/session.json        only while it runs: who runs it; runs stop when it goes
    DIR/runs/NAME.zarr      the run of a case, with its own checkpoints and status
    DIR/runs/NAME.json      why a case has no run that tells how it ended
    DIR/sweep.zarr          the dataset
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import time
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from stokesfibers.core.errors import InputError, StoreError
from stokesfibers.core.status import Status
from stokesfibers.io import lock, marker
from stokesfibers.io.atomic import disk_errors, write_atomic
from stokesfibers.study.sweep_plan import FORMAT, FORMAT_VERSION, Plan, SweepCase

_LOOK_SECONDS = 0.2
PLAN, SESSION, RUNS, DATASET = "sweep.json", "session.json", "runs", "sweep.zarr"
Code = Literal["waiting", "running", "interrupted", "done", "failed"]
UNREADABLE = "The run cannot be read"
"""How the reason of a run begins that ended well, and is damaged by now."""


@dataclass(frozen=True)
class State:
    """How a case stands.

    Attributes
    ----------
    code
        ``"waiting"``, ``"running"``, ``"interrupted"``, ``"done"`` or ``"failed"``.
    time
        Simulated time reached.
    reason
        Why it failed, and what to try.
    final
        Whether trying again cannot help; a full disk can be mended, a blow-up not.
    doubt
        Why what it gave cannot be trusted.
    """

    code: Code
    time: float = 0.0
    reason: str = ""
    final: bool = True
    doubt: str = ""

    @property
    def unreadable(self) -> bool:
        """Whether its run ended well and is damaged by now."""
        return self.code == "failed" and self.reason.startswith(UNREADABLE)


def doubt_of(status: Mapping[str, Any]) -> str:
    """Return why a run with this stored status cannot be trusted; empty if it can."""
    return "; ".join(map(str, Status.from_dict(dict(status)).reasons))


@dataclass(frozen=True)
class SweepFolder:
    """Paths and states of a sweep's folder.

    Attributes
    ----------
    path
        The folder.
    """

    path: Path

    def store(self, case: SweepCase) -> Path:
        """Return the store of a case."""
        return self.path / RUNS / f"{case.name}.zarr"

    def stores(self) -> dict[str, Path]:
        """Return the stores that are there, by the keys of their cases."""
        found = (self.path / RUNS).glob("*-*.zarr")
        return {store.stem.rpartition("-")[2]: store for store in found}

    def adopt(self, plan: Plan) -> None:
        """Give stores that an earlier sweep named otherwise the names of `plan`."""
        held = self.stores()
        for case in plan.cases:
            if case.key in held and not self.store(case).exists():
                held[case.key].rename(self.store(case))

    def note(self, case: SweepCase) -> Path:
        """Return the file that says why a case has no run that tells how it ended."""
        return self.path / RUNS / f"{case.key}.json"

    def plan(self) -> Plan:
        """Return the plan of the sweep that was last started here.

        Raises
        ------
        StoreError
            If there is none.
        """
        file = self.path / PLAN
        try:
            table = json.loads(file.read_bytes())
            if table["format"] == FORMAT and table["format_version"] == FORMAT_VERSION:
                return Plan.from_table(table)
            got = f"version {table['format_version']} of {table['format']}"
        except FileNotFoundError:
            got = f"a folder without {PLAN}" if self.path.is_dir() else "nothing there"
        except OSError as error:
            got = f"'{error.strerror}'"
        except (ValueError, KeyError, TypeError, AttributeError, InputError) as error:
            got = f"a damaged {PLAN} ({error!r})"
        raise StoreError(str(self.path), f"the folder of a sweep, with its {PLAN}", got)

    def state(self, case: SweepCase, *, active: bool = False, store: Path | None = None) -> State:
        """Return how a case stands.

        Parameters
        ----------
        case
            The case.
        active
            Whether the sweep is running.
        store
            Its store, if that has another name.
        """
        where, noted = store or self.store(case), self._noted(case)
        if where.exists():
            try:
                found = marker.read(where)[1]["status"]
            except (StoreError, KeyError) as error:
                return State("failed", 0.0, str(error), final=False)
            if found["code"] in ("done", "failed"):
                reason = ". ".join(
                    t.rstrip(".") for t in (found["explanation"], found["hint"]) if t
                )
                told = reason if found["code"] == "failed" else ""
                if found["code"] == "done" and noted is not None and noted.unreadable:
                    return noted
                doubt = doubt_of(found)
                return State(found["code"], float(found["time"]), told, doubt=doubt)
            if noted is None:
                return State("running" if active else "interrupted", float(found["time"]))
            return State(noted.code, float(found["time"]), noted.reason, noted.final)
        return noted or State("waiting")

    def _noted(self, case: SweepCase) -> State | None:
        try:
            return State(**json.loads(self.note(case).read_bytes()))
        except (OSError, ValueError, TypeError):
            return None

    def write_note(self, case: SweepCase, state: State | None) -> None:
        """Write how a case stands, or that there is nothing to say."""
        if state is None:
            self.note(case).unlink(missing_ok=True)
        else:
            write_atomic(self.note(case), json.dumps(asdict(state)).encode())

    def session(self) -> dict[str, Any] | None:
        """Return who runs the sweep, if anybody does: token, process, host, started, share."""
        try:
            return json.loads((self.path / SESSION).read_bytes())
        except (OSError, ValueError):
            return None

    def active(self) -> bool:
        """Return whether a process of this machine, or one that cannot be seen, runs the sweep."""
        session = self.session()
        if session is None:
            return False
        if session["host"] != socket.gethostname():
            return True
        try:
            lock.release(lock.acquire(self.path), self.path)
        except StoreError:
            return True
        except OSError:
            return False
        return False


@contextmanager
def opened(path: Path) -> Iterator[SweepFolder]:
    """Make or open the folder of a sweep as its only writer.

    Raises
    ------
    StoreError
        If another sweep runs there, it holds something else, or cannot be written.
    """
    folder = SweepFolder(path.resolve())
    _check_place(folder)
    with disk_errors(path):
        (folder.path / RUNS).mkdir(parents=True, exist_ok=True)
        try:
            held = _only_writer(folder.path)
        except StoreError as error:
            hint = "Wait until it ends, stop it, or choose another --out."
            expected = "a folder where no sweep is running"
            raise StoreError(str(path), expected, error.got, hint) from None
    try:
        _clear_parts(folder.path)
        yield folder
    finally:
        lock.release(held, folder.path)


def _only_writer(path: Path) -> int:
    try:
        return lock.acquire(path)
    except StoreError:
        # Somebody who asks whether a sweep runs holds it for a moment; a sweep holds it longer.
        time.sleep(_LOOK_SECONDS)
        return lock.acquire(path)


def _check_place(folder: SweepFolder) -> None:
    path = folder.path
    if not path.parent.is_dir():
        hint = f"Make the folder {path.parent} first."
        raise StoreError(str(path), "a place in an existing folder", "a missing folder", hint)
    if not path.exists():
        return
    ours = {PLAN, SESSION, RUNS, DATASET, lock.NAME}
    held = {p.name for p in path.iterdir()} if path.is_dir() else {"a file"}
    if PLAN not in held and not held <= ours:
        some = ", ".join(sorted(held - ours)[:3])
        hint = "Choose another --out."
        raise StoreError(str(path), "the folder of a sweep, or an empty one", f"{some}", hint)


def _clear_parts(path: Path) -> None:
    """Remove what a kill left half made; bring back a dataset it took from its place."""
    old = path / f".{DATASET}.old"
    if old.exists() and not (path / DATASET).exists():
        old.rename(path / DATASET)
    for part in (old, *path.glob(f".{DATASET}.*.partial"), *(path / RUNS).glob(".*.partial")):
        shutil.rmtree(part, ignore_errors=True)


@contextmanager
def session(folder: SweepFolder, facts: Mapping[str, Any]) -> Iterator[str]:
    """Say in the folder that the sweep runs, and give the token that its runs look for."""
    token = uuid.uuid4().hex
    held = {
        "token": token,
        "process": os.getpid(),
        "host": socket.gethostname(),
        "started": time.time(),
        **facts,
    }
    with disk_errors(folder.path):
        write_atomic(folder.path / SESSION, json.dumps(held).encode())
    try:
        yield token
    finally:
        end_session(folder, token)


def end_session(folder: SweepFolder, token: str) -> None:
    """Tell all runs of a session to stop; they notice between steps."""
    if is_token(folder, token):
        with suppress(OSError):
            (folder.path / SESSION).unlink()


def is_token(folder: SweepFolder, token: str) -> bool:
    """Return whether the session of `token` goes on."""
    held = folder.session()
    return held is not None and held.get("token") == token
