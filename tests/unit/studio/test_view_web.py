"""``view --web``: the page and the data are served to this machine, and to a real browser."""

from __future__ import annotations

import asyncio
import base64
import io
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from contextlib import suppress
from pathlib import Path
from urllib.parse import parse_qs, urlparse

import numpy as np
import pytest

from stokesfibers.studio import view_server
from stokesfibers.studio.view import _until_stopped
from stokesfibers.studio.view_server import ViewerError, ViewerProcess

pytest.importorskip("rerun", reason="the extra 'view' is not installed")

COMMAND = [sys.executable, "-c", "from stokesfibers.cli.main import main; main()"]
CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), ""
)
TELL_TALES = ((8, 64, 138), (163, 26, 14))  # ends of the tension's colours, in the scale


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def served(cell_run):
    """The command, serving the run, and the address it printed."""
    words = ["view", cell_run, "--web", "--port", free_port(), "--data-port", free_port()]
    process = subprocess.Popen(
        [*COMMAND, *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        line = process.stdout.readline()
        assert line.startswith("The run is at http://127.0.0.1:"), process.stderr.read()
        yield process, line.removeprefix("The run is at ").strip()
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=90)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def ports(page: str) -> tuple[int, int]:
    """Return the ports of the page and of the data."""
    parts = urlparse(page)
    sink = parse_qs(parts.query)["url"][0].removeprefix("rerun+")
    return parts.port, urlparse(sink).port


def answers(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
    except OSError:
        return False
    return True


@pytest.mark.skipif(sys.platform != "linux", reason="reads what listens from /proc")
def test_page_and_data_are_served_to_this_machine_only(served):
    process, page = served
    with urllib.request.urlopen(page, timeout=20) as answer:
        text = answer.read().decode()
    assert answer.status == 200
    assert "re_viewer" in text
    rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    rows += [line.split() for line in Path("/proc/net/tcp6").read_text().splitlines()[1:]]
    hosts = {int(r[1].split(":")[1], 16): r[1].split(":")[0] for r in rows if r[3] == "0A"}
    for port in ports(page):
        assert hosts[port] == "0100007F"  # 127.0.0.1
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=90)
    assert process.returncode == 0
    assert not any(answers(port) for port in ports(page))


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
def test_no_viewer_stays_behind_after_a_request_to_end(served):
    process, page = served
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=90)
    assert process.returncode == 0
    assert not any(answers(port) for port in ports(page))


@pytest.mark.skipif(os.name == "nt", reason="signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_request_to_end_holds_though_its_exception_is_dropped(number, monkeypatch):
    """As Python does when it comes while an object is cleared away."""
    program = "import socket, sys; s = socket.create_server(('127.0.0.1', int(sys.argv[4])))\n"
    program += "while True: s.accept()"
    monkeypatch.setattr(view_server, "_command", lambda: [sys.executable, "-c", program])
    monkeypatch.setattr(view_server, "_check_display", lambda: None)
    start = time.monotonic()
    before = signal.getsignal(number)
    with _until_stopped() as asked, ViewerProcess(web=False, data_port=free_port()) as viewer:
        with suppress(KeyboardInterrupt):
            signal.raise_signal(number)
        assert asked == [number]
        viewer.wait(asked)
        assert viewer.lives()
    assert not viewer.lives()
    assert signal.getsignal(number) is before
    assert time.monotonic() - start < 60.0


def test_a_port_that_is_taken_is_refused(cell_run):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        number = str(taken.getsockname()[1])
        words = ["view", str(cell_run), "--web", "--port", number]
        said = subprocess.run([*COMMAND, *words], capture_output=True, text=True, timeout=60)
    assert said.returncode == 2
    assert f"--port: expected a free port, got {number}, which is taken" in said.stderr


def test_a_window_needs_a_display(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(ViewerError, match=r"no display.*--web"):
        ViewerProcess(web=False)


def test_a_viewer_that_ends_at_once_tells_why(monkeypatch):
    program = [sys.executable, "-c", "import sys; print('error: no luck'); sys.exit(3)"]
    monkeypatch.setattr(view_server, "_command", lambda: program)
    with pytest.raises(ViewerError, match="did not start: error: no luck"):
        ViewerProcess(web=True, web_port=free_port(), data_port=free_port())


@pytest.mark.slow
@pytest.mark.skipif(not CHROMIUM, reason="no Chromium is installed")
def test_a_browser_draws_the_fibers_and_their_scale(served, tmp_path):
    pytest.importorskip("tornado", reason="tornado, which drives the browser, is not installed")
    _, page = served
    found = asyncio.run(watched(f"{page}&renderer=webgl", tmp_path))
    if kept := os.environ.get("STOKESFIBERS_SCREENSHOTS"):
        found.save(Path(kept) / "view.png")
    missing = [colour for colour in TELL_TALES if not shows(found, colour)]
    assert not missing, "the scale's colours are not on the page"


def shows(picture, colour: tuple[int, int, int]) -> bool:
    """Return whether at least 20 pixels have the colour, up to what smoothing does."""
    pixels = np.asarray(picture.convert("RGB")).astype(int)
    return int((np.abs(pixels - colour).max(axis=-1) <= 6).sum()) >= 20


async def watched(address: str, folder: Path, patience: float = 150.0):
    """Open the address in Chromium without a window; return its picture when the scale is drawn."""
    from PIL import Image
    from tornado.websocket import websocket_connect

    profile = folder / "profile"
    drawing = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    words = [CHROMIUM, "--headless=new", "--no-sandbox", *drawing, "--remote-debugging-port=0"]
    words += [f"--user-data-dir={profile}", "--window-size=1400,900", "about:blank"]
    browser = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + patience
    try:
        talk = await websocket_connect(tab_of(profile, end), max_message_size=2**28)

        async def call(number: int, method: str, **given):
            await talk.write_message(json.dumps({"id": number, "method": method, "params": given}))
            while True:
                answer = json.loads(await talk.read_message())
                if answer.get("id") == number:
                    return answer["result"]

        await call(1, "Page.navigate", url=address)
        number = 2
        while True:
            await asyncio.sleep(3.0)
            answer = await call(number, "Page.captureScreenshot", format="png")
            picture = Image.open(io.BytesIO(base64.b64decode(answer["data"])))
            done = all(shows(picture, colour) for colour in TELL_TALES)
            if done or time.monotonic() > end:
                talk.close()
                return picture
            number += 1
    finally:
        browser.terminate()
        browser.wait()


def tab_of(profile: Path, end: float) -> str:
    """Return the address that drives the first page of the browser with this profile."""
    while not (profile / "DevToolsActivePort").exists():
        assert time.monotonic() < end, "the browser did not start"
        time.sleep(0.1)
    time.sleep(0.2)
    port = (profile / "DevToolsActivePort").read_text().split()[0]
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=20) as answer:
        tabs = json.load(answer)
    return next(tab["webSocketDebuggerUrl"] for tab in tabs if tab["type"] == "page")
