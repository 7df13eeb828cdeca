"""The documentation as a site: built without a warning, no dead link, searchable."""

import functools
import html
import http.server
import os
import re
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from filelock import FileLock

from panto_baselines.benchmark.run import read_result
from panto_env.control.settings import fields
from panto_env.envs import IDS
from panto_env.envs.settings import EnvironmentSettings

pytest.importorskip("furo", reason="the extra 'docs' is not installed")
pytestmark = pytest.mark.slow

DOCS = Path(__file__).parents[2] / "docs"
PAGES = {
    "Pantograph-v0": "pantograph",
    "PantographStiffness-v0": "pantograph-stiffness",
    "PantographThreeSpan-v0": "pantograph-three-span",
}
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site, one for all processes that test it."""
    shared = tmp_path_factory.getbasetemp()
    shared = shared.parent if "PYTEST_XDIST_WORKER" in os.environ else shared
    folder = shared / "site"
    with FileLock(shared / "site.lock"):
        if not folder.exists():
            command = ["sphinx", "-W", "--keep-going", "-n", "-q", "-b", "html", "-d", shared / "doctrees"]
            command = [sys.executable, "-m", *command, DOCS, shared / "new-site"]
            built = subprocess.run(command, capture_output=True, text=True, check=False)
            assert built.returncode == 0, built.stderr
            (shared / "new-site").rename(folder)
    return folder


def test_it_needs_no_network(site):
    """Scripts, styles, pictures and films are its own."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|video|source)[^>]*\ssrc=\"([^\"]+)\"", text)
        loaded += re.findall(r"<link[^>]*rel=\"stylesheet\"[^>]*href=\"([^\"]+)\"", text)
        assert not [each for each in loaded if each.startswith(("http:", "https:", "//"))], page


def test_the_page_of_the_benchmark_has_every_track(site):
    page = (site / "benchmark" / "index.html").read_text(encoding="utf-8")
    for path in (DOCS / "benchmark").glob("*.json.gz"):
        assert html.escape(read_result(path).title) in page


def test_every_page_is_reached_from_the_first_one(site):
    index = site / "index.html"
    seen, waiting = {index}, [index]
    while waiting:
        page = waiting.pop()
        for link in re.findall(r'(?:href|src)="([^"]+)"', page.read_text(encoding="utf-8")):
            target = (page.parent / link.partition("#")[0]).resolve()
            if ":" not in link and target.suffix == ".html" and target.is_file() and target not in seen:
                seen.add(target)
                waiting.append(target)
    assert {page for page in site.rglob("*.html") if "_modules" not in page.parts} <= seen


@pytest.mark.parametrize("name", IDS)
def test_each_id_has_a_page_with_all_its_arguments(site, name):
    text = html.unescape((site / "environments" / f"{PAGES[name]}.html").read_text(encoding="utf-8"))
    for argument in fields(EnvironmentSettings):
        assert f">{argument}<" in text
    for value in IDS[name].values():
        assert repr(value) in re.sub(r"<[^>]+>", "", text)
    assert "<video" in text


class Handler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass

    def end_headers(self):
        self.send_header("LinkChecker", "yes")  # it may ask more often than ten times a second
        super().end_headers()


def test_no_link_is_dead(site, tmp_path):
    """Asked over a server: started by root, the checker gives up the right to read this folder itself."""
    settings = tmp_path / "settings"
    settings.write_text("[checking]\nmaxrequestspersecond=1000\n", encoding="utf-8")
    checker = shutil.which("linkchecker", path=os.path.dirname(sys.executable))
    command = [checker, f"--config={settings}", "--no-status", "--no-warnings"]
    handler = functools.partial(Handler, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/index.html"
        result = subprocess.run([*command, address], capture_output=True, text=True, check=False)
        server.shutdown()
    assert result.returncode == 0, result.stdout
    assert int(re.search(r"(\d+) links? in", result.stdout)[1]) > 100


@pytest.mark.skipif(BROWSER is None and "CI" not in os.environ, reason="no browser; CI has one")
def test_search_finds_a_page_by_its_words(site):
    """As it is read: from a file, without a server."""
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
    address = f"file://{site}/search.html?q=oracle"
    command = [BROWSER, *options, "--virtual-time-budget=20000", "--dump-dom", address]
    shown = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300).stdout
    results = re.search(r'<ul[^>]* class="search"[^>]*>(.*?)</ul>', shown, re.DOTALL)
    assert results, "no list of results"
    assert "oracle.html" in results[1]
