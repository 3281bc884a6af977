"""The start of the command: interrupted before it is loaded it ends quietly with 130."""

from __future__ import annotations

import builtins
import sys

import pytest

from stokesfibers.cli import entry


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
