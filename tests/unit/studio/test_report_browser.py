"""A real browser shows the report without a complaint and asks no one for anything."""

from __future__ import annotations

import shutil
import socket
import subprocess
import threading
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from stokesfibers.cli.main import main

BROWSER = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
)
pytestmark = pytest.mark.skipif(BROWSER is None, reason="there is no Chromium here")

CASE = """\
[fiber]
slenderness = 1e-2
[fluid]
mu_bar = 1e4
[flow]
kind = "shear"
[initial]
kind = "nearly_straight"
angle = 2.0
amplitude = 0.1
[stepping]
rtol = 1e-2
until = 0.5
[record]
positions_every = 0.1
"""


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    """The report of a short run."""
    from click.testing import CliRunner

    folder = tmp_path_factory.mktemp("report")
    case, run = folder / "case.toml", folder / "run.zarr"
    case.write_text(CASE)
    for words in (["run", case, "--out", run, "--quiet"], ["report", run]):
        result = CliRunner().invoke(main, list(map(str, words)))
        assert result.exit_code == 0, result.stderr
    return folder / "run.html"


class Proxy:
    """Takes every connection that a browser tries to make, and remembers it."""

    def __init__(self) -> None:
        self._socket = socket.create_server(("127.0.0.1", 0))
        self.port = self._socket.getsockname()[1]
        self.asked: list[bytes] = []
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                connection, _ = self._socket.accept()
            except OSError:
                return
            with connection:
                connection.settimeout(1.0)
                try:
                    self.asked.append(connection.recv(4096).split(b"\r\n")[0])
                except OSError:
                    continue

    def close(self) -> None:
        self._socket.close()


def browse(page: Path, *options: str) -> str:
    """Open the page in a headless browser and return what it printed."""
    assert BROWSER is not None
    command = [BROWSER, "--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
    command += [f"--user-data-dir={page.parent / 'profile'}", "--disable-background-networking"]
    command += ["--disable-component-update", "--no-first-run", *options, page.as_uri()]
    done = subprocess.run(command, capture_output=True, text=True, timeout=200, check=True)
    return done.stdout + done.stderr


def test_no_complaint_and_no_request(page):
    proxy = Proxy()
    try:
        said = browse(
            page, "--enable-logging=stderr", "--dump-dom", f"--proxy-server=127.0.0.1:{proxy.port}"
        )
    finally:
        proxy.close()
    assert "How to cite" in said
    assert "CONSOLE" not in said
    # the browser's own services may call home; the page has no address to ask
    own = (b"google", b"gstatic", b"gvt1")
    assert [line for line in proxy.asked if not any(word in line for word in own)] == []


def test_a_complaint_would_be_seen(page):
    broken = page.with_name("broken.html")
    text = page.read_text().replace(
        "<main>", '<main><img alt="" src="http://example.invalid/a.png">'
    )
    broken.write_text(text)
    assert "CONSOLE" in browse(broken, "--enable-logging=stderr", "--dump-dom")


@pytest.mark.parametrize(("scheme", "light"), [("1", True), ("0", False)])
def test_both_schemes_show_figures_on_their_ground(scheme, light, page):
    shot = page.with_name(f"shot{scheme}.png")
    browse(
        page,
        f"--blink-settings=preferredColorScheme={scheme}",
        "--window-size=1000,2400",
        f"--screenshot={shot}",
    )
    picture = matplotlib.image.imread(shot)[..., :3]
    ground = np.mean(picture > 0.85) if light else np.mean(picture < 0.25)
    assert ground > 0.8
    ink = np.mean(picture < 0.4) if light else np.mean(picture > 0.6)
    assert 0.005 < ink < 0.2
