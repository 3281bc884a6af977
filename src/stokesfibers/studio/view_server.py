"""The Rerun viewer as a process of its own that only this machine can reach."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO
from urllib.parse import quote

from stokesfibers.core.errors import InputError, StokesFibersError

HOST = "127.0.0.1"
_USUAL_DATA, _USUAL_WEB = 9876, 9090
_PATIENCE = 30.0  # seconds until the viewer must listen
_LOOK = 0.5  # seconds from one look for a request to end to the next
_MEMORY = "50%"  # of the machine, for what waits for a browser


class ViewerError(StokesFibersError):
    """The viewer did not start or ended at once."""


class ViewerProcess:
    """A viewer: a native window, or pages for a browser. A context manager: it ends with it.

    Parameters
    ----------
    web
        Serve pages instead of opening a window.
    web_port, data_port
        Ports of the pages and of the data; by default the usual ones, or free ones.

    Raises
    ------
    InputError
        If a port that was asked for is taken.
    ViewerError
        If the viewer does not start, as a window without a display.
    """

    def __init__(
        self, *, web: bool, web_port: int | None = None, data_port: int | None = None
    ) -> None:
        if not web:
            _check_display()
        self._data_port = _port("--data-port", data_port, _USUAL_DATA)
        self._web_port = _port("--port", web_port, _USUAL_WEB) if web else 0
        words = [*_command(), "--bind", HOST, "--port", str(self._data_port)]
        if web:
            words += ["--serve-web", "--web-viewer-port", str(self._web_port)]
            words += ["--server-memory-limit", _MEMORY]
        else:
            words += ["--hide-welcome-screen", "--expect-data-soon"]
        self._web = web
        self._said: IO[str] = tempfile.TemporaryFile(  # noqa: SIM115 - closed in `stop`
            "w+", encoding="utf-8", errors="replace"
        )
        # In a session of its own: on Ctrl-C the recording is closed first, then the viewer.
        self._process = subprocess.Popen(
            words,
            stdin=subprocess.DEVNULL,
            stdout=self._said,
            stderr=self._said,
            start_new_session=True,
        )
        try:
            self._await()
        except BaseException:
            self.stop()
            raise

    @property
    def sink(self) -> str:
        """Address that recordings are sent to."""
        return f"rerun+http://{HOST}:{self._data_port}/proxy"

    @property
    def page(self) -> str:
        """Address for the browser; empty for a window."""
        if not self._web:
            return ""
        return f"http://{HOST}:{self._web_port}/?url={quote(self.sink, safe='')}"

    def lives(self) -> bool:
        """Return whether the viewer is still there."""
        return self._process.poll() is None

    def wait(self, asked: Sequence[int] = ()) -> None:
        """Wait until the viewer is closed, or there is a request to end in `asked`.

        Raises
        ------
        ViewerError
            If it ended by a fault, as a window without a display.
        """
        while not asked and self.lives():
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(timeout=_LOOK)
        if self._process.returncode:
            raise ViewerError(self._complaint())

    def stop(self) -> None:
        """Close the viewer if it is still there."""
        if self.lives():
            self._process.terminate()
            try:
                self._process.wait(timeout=5.0)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._said.close()

    def __enter__(self) -> ViewerProcess:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.stop()

    def _await(self) -> None:
        """Wait until the viewer listens."""
        end = time.monotonic() + _PATIENCE
        ports = [self._data_port, *([self._web_port] if self._web else [])]
        while not all(_answers(port) for port in ports):
            if not self.lives() or time.monotonic() > end:
                raise ViewerError(self._complaint())
            time.sleep(0.05)

    def _complaint(self) -> str:
        self._said.seek(0)
        lines = [line.strip() for line in self._said.read().splitlines() if line.strip()]
        told = [line for line in lines if line.lower().startswith("error")] or lines[-1:]
        said = told[0].rstrip(".") if told else "it said nothing"
        hint = "" if self._web else " Without a display use --web, or --save FILE.rrd."
        return f"The viewer did not start: {said}.{hint}"


def _check_display() -> None:
    """Refuse a window where there can be none."""
    if sys.platform.startswith("linux") and not any(
        os.environ.get(name) for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
    ):
        raise ViewerError("There is no display for the viewer. Use --web, or --save FILE.rrd.")


def _command() -> list[str]:
    """Return what starts the viewer: its program, not a script, which would outlive a signal."""
    import rerun_cli

    folder = Path(str(rerun_cli.__file__)).parent
    places = ("Rerun.app/Contents/MacOS/Rerun", "rerun", "rerun.exe")
    found = [str(folder / place) for place in places if (folder / place).is_file()]
    return found[:1] or [sys.executable, "-m", "rerun_cli"]


def _answers(port: int) -> bool:
    try:
        socket.create_connection((HOST, port), timeout=0.2).close()
    except OSError:
        return False
    return True


def _port(option: str, wanted: int | None, usual: int) -> int:
    """Return the port asked for if it is free, else the usual one, else any free one."""
    if wanted is not None:
        if not _is_free(wanted):
            hint = "Leave the option out to take a free one."
            raise InputError(option, "a free port", f"{wanted}, which is taken", hint)
        return wanted
    if _is_free(usual):
        return usual
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])


def _is_free(port: int) -> bool:
    # one that answers is taken even where the system would let a second one listen
    if _answers(port):
        return False
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except (OSError, OverflowError):
            return False
    return True
