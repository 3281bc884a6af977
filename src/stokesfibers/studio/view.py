"""Looking at a run in three dimensions with a time slider: a window, a browser, or a file."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from stokesfibers.io.reader import open_run
from stokesfibers.studio.export_target import Target, written
from stokesfibers.studio.view_recording import APPLICATION, Look, Show, write_rrd
from stokesfibers.studio.view_server import ViewerProcess

PathLike = str | os.PathLike[str]
Progress = Callable[[int, int], None]
"""Called with how many parts are shown, and how many there are: records and slices of the fluid."""


def save_view(
    run: PathLike,
    file: PathLike,
    *,
    look: Look | None = None,
    overwrite: bool = False,
    progress: Progress | None = None,
) -> Path:
    """Write a run as a Rerun recording, which the viewer opens later; return the file.

    Parameters
    ----------
    run
        The run's folder. A run in progress can be shown too.
    file
        File to write; after an error it is as before.
    look
        How the run is shown.
    overwrite
        Whether a file that exists is replaced.
    progress
        Called after each record.

    Raises
    ------
    InputError
        If the file exists or cannot be made, the run holds no shapes, or the look is not possible.
    MissingExtraError
        If rerun is not installed.
    """
    source, look = Path(run), look or Look()
    data = open_run(source)
    show = Show.of(data, source.resolve().name, look)
    target = Target("--save", Path(file), folder=False)
    target.check(source, overwrite=overwrite)
    count = show.count
    with written([target]):
        logged = write_rrd(data, target.partial, name=show.name, look=look)
        for done, _ in enumerate(logged, start=1):
            if progress is not None:
                progress(done, count)
    return target.place


def view_run(
    run: PathLike,
    *,
    look: Look | None = None,
    web: bool = False,
    port: int | None = None,
    data_port: int | None = None,
    ready: Callable[[str], None] | None = None,
    progress: Progress | None = None,
) -> None:
    """Show a run in the Rerun viewer; return when the viewer is closed, or on Ctrl-C.

    Records are sent one after the other while the viewer shows those before. The viewer can be
    reached from this machine only.

    Parameters
    ----------
    run
        The run's folder. A run in progress can be shown too: what is complete is.
    look
        How the run is shown.
    web
        Serve the viewer for a browser instead of opening a window.
    port, data_port
        Ports of the pages and of the data; by default 9090 and 9876, or free ones.
    ready
        Called with the address of the page, or an empty one, when the viewer is there.
    progress
        Called after each record.

    Raises
    ------
    InputError
        If the run holds no shapes, the look is not possible or a port is taken.
    MissingExtraError
        If rerun is not installed.
    ViewerError
        If the viewer does not start.
    """
    source, look = Path(run), look or Look()
    show = Show.of(open_run(source), source.resolve().name, look)
    count = show.count
    ports = {"web_port": port, "data_port": data_port}
    with _until_stopped() as asked, ViewerProcess(web=web, **ports) as viewer:
        if ready is not None:
            ready(viewer.page)
        with _sent_to(viewer, show) as stream:
            for done, _ in enumerate(show.log(stream), start=1):
                if asked or not viewer.lives():
                    break
                if progress is not None:
                    progress(done, count)
            viewer.wait(asked)


@contextmanager
def _sent_to(viewer: ViewerProcess, show: Show) -> Iterator[Any]:
    """Give a recording stream into the viewer; close it before the viewer goes."""
    stream = show.rr.RecordingStream(APPLICATION)
    try:  # a stream that an interrupt leaves connected waits, at the end, for a viewer that is gone
        stream.connect_grpc(viewer.sink, default_blueprint=show.blueprint)
        try:
            yield stream
        except RuntimeError:
            if viewer.lives():
                raise  # else the user closed it, and what was sent then is lost with it
    finally:
        if viewer.lives():
            stream.disconnect()


@contextmanager
def _until_stopped() -> Iterator[list[int]]:
    """End the block quietly on Ctrl-C or a request to end, so that no viewer stays behind.

    Yield the signals that came: Python drops what is raised while it clears away an object.
    """
    asked: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        asked.append(number)
        raise KeyboardInterrupt

    ours = threading.current_thread() is threading.main_thread()
    names = [n for n in ("SIGINT", "SIGTERM", "SIGHUP") if ours and hasattr(signal, n)]
    before = {n: signal.signal(getattr(signal, n), stop) for n in names}
    try:
        yield asked
    except KeyboardInterrupt:
        return
    finally:
        for name, handler in before.items():
            signal.signal(getattr(signal, name), handler)
