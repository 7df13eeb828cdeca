"""The page of ``panto app`` in a browser: what one moves changes what one sees, and all is its own."""

import http.client
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from functools import partial

import pytest

pytest.importorskip("bokeh", reason="the extra 'app' is not installed")
playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

BROWSER = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(BROWSER is None and "CI" not in os.environ, reason="no browser; CI has one"),
]
PATIENCE = 120e3
"""Time that a change may take (ms): the first run may have to compile, on busy cores."""


@pytest.fixture(scope="module")
def port():
    """Of the command, which runs until it is interrupted, and ends well then."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    words = [sys.executable, "-c", "from panto_env.cli import main; main()", "app", "--no-browser"]
    # Whoever runs tests in the background may have interrupts ignored, and children inherit that.
    heard = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    given = {"stdout": subprocess.PIPE, "text": True, "preexec_fn": heard}
    with subprocess.Popen([*words, "--port", str(number)], **given) as command:
        try:
            assert command.stdout.readline() == f"The page is http://127.0.0.1:{number}/; Ctrl+C ends it.\n"
            yield number
            command.send_signal(signal.SIGINT)
            assert command.wait(60) == 0
        finally:
            command.kill()  # or a page that does not end would hold up all tests


@pytest.fixture
def tab(port):
    """The page in a browser; all that it loads is its own, and it logs no error."""
    with playwright.sync_playwright() as driver:
        browser = driver.chromium.launch(
            executable_path=BROWSER, args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        context = browser.new_context(viewport={"width": 1400, "height": 1000})
        context.grant_permissions(["clipboard-read", "clipboard-write"])
        context.set_default_timeout(PATIENCE)
        opened, loaded, faults = context.new_page(), [], []
        opened.on("request", lambda request: loaded.append(request.url))
        opened.on("pageerror", lambda error: faults.append(str(error)))
        opened.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
        opened.goto(f"http://127.0.0.1:{port}/")
        yield opened
        browser.close()
    assert loaded
    assert {re.split("[/?]", url)[2] for url in loaded} == {f"127.0.0.1:{port}"}
    assert faults == []


def figures(tab):
    """Values of σ in the table of figures."""
    return [float(value) for value in tab.locator("tr[data-key=std]").last.locator("td").all_text_contents()]


def test_one_moves_and_picks_and_sees(tab):
    tab.locator(".verdict", has_text="re250 at 250 km/h, passive").wait_for()
    (first,) = figures(tab)
    speed = tab.locator(".speed_kmh .noUi-handle")
    for _ in range(4):
        speed.press("ArrowRight")
    tab.locator(".verdict", has_text="270 km/h, passive").wait_for()
    (faster,) = figures(tab)
    assert faster != first
    tab.locator(".policy select").select_option("agent-any-pantograph")
    tab.locator(".verdict", has_text="270 km/h, agent-any-pantograph").wait_for()
    passive, controlled = figures(tab)
    assert passive == faster > controlled
    tab.locator(".policy select").select_option("mpc")
    tab.locator(".error", has_text="The policy 'mpc' failed in reset").wait_for()
    assert figures(tab) == [faster]
    speed.press("End")
    tab.locator(".error", has_text="below the wave speed of the contact wire").wait_for()
    tab.locator(".policy select").select_option("passive")
    speed.press("Home")
    tab.locator(".verdict", has_text="80 km/h, passive").wait_for()
    tab.get_by_role("button", name="Copy the command", exact=True).click()
    copied = tab.evaluate("navigator.clipboard.readText()")
    assert copied == "panto simulate --catenary re250 --pantograph dsa380 --speed 80"
    for width in (1400, 400):
        tab.set_viewport_size({"width": width, "height": 900})
        # A page lays itself out anew some frames after the window has changed.
        tab.wait_for_function(f"document.documentElement.scrollWidth <= {width}")


@pytest.mark.parametrize(("origin", "status"), [("http://example.org", 403), (None, 101)])
def test_a_page_of_another_origin_cannot_reach_it(port, origin, status):
    asked = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    asked.request("GET", "/")
    token = re.search(r'"token":"([^"]+)"', asked.getresponse().read().decode())[1]
    headers = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
    headers |= {"Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Protocol": f"bokeh, {token}"}
    asked = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    asked.request("GET", "/ws", headers=headers | {"Origin": origin or f"http://127.0.0.1:{port}"})
    assert asked.getresponse().status == status
