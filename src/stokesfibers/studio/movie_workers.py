"""Frames drawn by several processes, in order.

Drawing holds Python's lock, so threads gain nothing. Each process gets one shot, draws it and sends
the frame back before it gets the next one: pipes never fill up on both sides.
Run as a module, this is such a process.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from typing import IO

from stokesfibers.core.errors import StokesFibersError
from stokesfibers.studio.frames import Scene, Shot, Stage

_HEAD = struct.Struct("<Q")


def frames(scene: Scene, shots: Iterable[Shot], workers: int) -> Iterator[bytes]:
    """Yield the frame of each shot, in order, drawn by as many processes (here, for one).

    Raises
    ------
    StokesFibersError
        If a process ends before its time; the message says what it said last.
    """
    if workers == 1:
        stage = Stage(scene)
        yield from map(stage.draw, shots)
        return
    with contextlib.ExitStack() as stack:
        team = [stack.enter_context(_worker(scene)) for _ in range(workers)]
        count = 0
        for shot in shots:
            worker = team[count % workers]
            if count >= workers:
                yield worker.receive()
            worker.send(shot)
            count += 1
        for number in range(max(0, count - workers), count):
            yield team[number % workers].receive()


class _Worker:
    """A process that draws one shot at a time."""

    def __init__(self, process: subprocess.Popen[bytes], said: IO[bytes]) -> None:
        self._process = process
        self._said = said

    def send(self, item: Scene | Shot) -> None:
        assert self._process.stdin is not None
        with self._explained():
            _send(self._process.stdin, pickle.dumps(item))

    def receive(self) -> bytes:
        assert self._process.stdout is not None
        with self._explained():
            return _receive(self._process.stdout)

    @contextlib.contextmanager
    def _explained(self) -> Iterator[None]:
        try:
            yield
        except (OSError, EOFError):
            self._process.wait()
            self._said.seek(0)
            last = self._said.read().decode(errors="replace").strip().splitlines()
            why = last[-1] if last else f"it ended with code {self._process.returncode}"
            raise StokesFibersError(f"A process that draws frames ended: {why}") from None


@contextlib.contextmanager
def _worker(scene: Scene) -> Iterator[_Worker]:
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            [sys.executable, "-m", "stokesfibers.studio.movie_workers"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
            # Ctrl-C is for the one that writes the movie; it ends the others
            start_new_session=os.name == "posix",
        )
        try:
            worker = _Worker(process, said)
            worker.send(scene)
            yield worker
        finally:
            for pipe in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    if pipe is not None:
                        pipe.close()
            process.terminate()
            process.wait()


def _send(pipe: IO[bytes], content: bytes) -> None:
    pipe.write(_HEAD.pack(len(content)))
    pipe.write(content)
    pipe.flush()


def _receive(pipe: IO[bytes]) -> bytes:
    return _exactly(pipe, _HEAD.unpack(_exactly(pipe, _HEAD.size))[0])


def _exactly(pipe: IO[bytes], count: int) -> bytes:
    content = pipe.read(count)
    if len(content) < count:
        raise EOFError
    return content


def _serve() -> None:
    """Draw shots from standard input until it ends."""
    source, target = sys.stdin.buffer, sys.stdout.buffer
    with contextlib.suppress(EOFError, BrokenPipeError):
        stage = Stage(pickle.loads(_receive(source)))
        while True:
            _send(target, stage.draw(pickle.loads(_receive(source))))


if __name__ == "__main__":
    _serve()
