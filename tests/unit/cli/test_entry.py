"""The start and the end of the command: interrupted there it ends quietly with its exit code."""

from __future__ import annotations

import builtins
import signal
import sys
from collections.abc import Iterator

import pytest

from stokesfibers.cli import entry


@pytest.fixture(autouse=True)
def handler() -> Iterator[None]:
    """Put back what takes SIGINT, which the command lets go at its end."""
    kept = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, kept)


def test_an_interrupt_while_loading_ends_with_130(monkeypatch, capsys):
    real = builtins.__import__

    def interrupted(name, *args, **options):
        if name == "stokesfibers.cli.main":
            raise KeyboardInterrupt
        return real(name, *args, **options)

    monkeypatch.setattr(builtins, "__import__", interrupted)
    with pytest.raises(SystemExit) as ended:
        entry.main()
    assert ended.value.code == 130
    assert capsys.readouterr().err == "Interrupted.\n"


def test_otherwise_it_is_the_command(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["stokesfibers", "--version"])
    with pytest.raises(SystemExit) as ended:
        entry.main()
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith("stokesfibers ")
    assert signal.getsignal(signal.SIGINT) == signal.SIG_IGN, "what is done stays done"
