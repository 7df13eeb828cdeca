"""The documentation as a site: built without a warning, no dead link, searchable, readable on a telephone."""

import functools
import html
import http.server
import json
import os
import queue
import re
import shutil
import subprocess
import sys
import threading
from html.parser import HTMLParser
from pathlib import Path

import pytest
from filelock import FileLock

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
needs_browser = pytest.mark.skipif(
    BROWSER is None and "CI" not in os.environ, reason="no browser; CI has one"
)
HEADLESS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
]
WIDTHS = (390, 1280)
"""Of a telephone and of a desk (px)."""
MEASURE = """<!doctype html><title>widths</title><script>
async function widest(page, width) {
  const frame = document.createElement("iframe");
  frame.style = `border: 0; height: 900px; width: ${width}px`;
  frame.src = page;
  document.body.append(frame);
  await new Promise(resolve => frame.onload = resolve);
  const found = frame.contentDocument.documentElement.scrollWidth;
  frame.remove();
  return found;
}
onload = async () => {
  const [widths, pages] = await (await fetch("/asked")).json(), found = [];
  for (const width of widths) for (const page of pages) found.push([page, width, await widest(page, width)]);
  await fetch("/found", {method: "POST", body: JSON.stringify(found)});
};
</script><body></body>"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site, one for all processes that test it."""
    shared = tmp_path_factory.getbasetemp()
    shared = shared.parent if "PYTEST_XDIST_WORKER" in os.environ else shared
    folder = shared / "site"
    with FileLock(shared / "site.lock"):
        if not folder.exists():
            command = ["sphinx", "-W", "--keep-going", "-n", "-q", "-b", "html", "-d", shared / "doctrees"]
            built = subprocess.run(
                [sys.executable, "-m", *command, DOCS, shared / "new-site"],
                capture_output=True,
                text=True,
                check=False,
            )
            assert built.returncode == 0, built.stderr
            (shared / "new-site").rename(folder)
    return folder


class Links(HTMLParser):
    """What a page refers to."""

    def __init__(self, path):
        super().__init__()
        self.found = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        self.found |= {value for name, value in attributes if name in ("href", "src") and value}


def dump(url, milliseconds):
    """What a browser makes of a page."""
    command = [BROWSER, *HEADLESS, f"--virtual-time-budget={milliseconds}", "--dump-dom", url]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=300).stdout


def test_it_needs_no_network(site):
    """Scripts, styles, pictures and films are its own."""
    for page in site.rglob("*.html"):
        text = page.read_text(encoding="utf-8")
        loaded = re.findall(r"<(?:script|img|video|source)[^>]*\ssrc=\"([^\"]+)\"", text)
        loaded += re.findall(r"<link[^>]*rel=\"stylesheet\"[^>]*href=\"([^\"]+)\"", text)
        assert not [each for each in loaded if each.startswith(("http:", "https:", "//"))], page


def test_every_page_is_reached_from_the_first_one(site):
    index = site / "index.html"
    seen, waiting = {index}, [index]
    while waiting:
        page = waiting.pop()
        for link in Links(page).found:
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


@pytest.fixture(scope="module")
def server(site):
    """The site on a server of its own, which has one page more, /widths: it measures the pages ``asked``."""

    class Handler(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            pass

        def end_headers(self):
            self.send_header("LinkChecker", "yes")  # it may ask more often than ten times a second
            super().end_headers()

        def do_GET(self):
            more = {
                "/widths": ("text/html", MEASURE),
                "/asked": ("application/json", json.dumps(server.asked)),
            }
            if self.path not in more:
                return super().do_GET()
            kind, text = more[self.path]
            self.send_response(200)
            self.send_header("Content-Type", kind)
            self.end_headers()
            return self.wfile.write(text.encode())

        def do_POST(self):
            server.found.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            self.send_response(204)
            self.end_headers()

    handler = functools.partial(Handler, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        server.asked, server.found = [], queue.Queue()
        server.address = f"http://127.0.0.1:{server.server_port}"
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()


def test_no_link_is_dead(server, tmp_path):
    """Asked over a server: started by root, the checker gives up the right to read this folder itself."""
    settings = tmp_path / "settings"
    settings.write_text("[checking]\nmaxrequestspersecond=1000\n", encoding="utf-8")
    checker = shutil.which("linkchecker", path=os.path.dirname(sys.executable))
    command = [
        checker,
        f"--config={settings}",
        "--no-status",
        "--no-warnings",
        f"{server.address}/index.html",
    ]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout
    assert int(re.search(r"(\d+) links? in", result.stdout)[1]) > 100


@needs_browser
def test_search_finds_a_page_by_its_words(site):
    """As it is read: from a file, without a server."""
    shown = dump(f"file://{site}/search.html?q=oracle", 20_000)
    results = re.search(r'<ul[^>]* class="search"[^>]*>(.*?)</ul>', shown, re.DOTALL)
    assert results, "no list of results"
    assert "oracle.html" in results[1]


@needs_browser
def test_no_page_is_wider_than_its_window(site, server, tmp_path):
    """In true time: a page with a film is never done loading in a browser's own time."""
    pages = [str(page.relative_to(site)) for page in site.rglob("*.html") if "_modules" not in page.parts]
    server.asked = [WIDTHS, pages]
    command = [BROWSER, *HEADLESS, "--remote-debugging-port=0", f"--user-data-dir={tmp_path}"]
    with subprocess.Popen([*command, f"{server.address}/widths"], stderr=subprocess.DEVNULL) as browser:
        try:
            found = server.found.get(timeout=240)
        finally:
            browser.terminate()
    assert len(found) == len(WIDTHS) * len(pages)
    assert not [(page, wide) for page, width, wide in found if wide > width]
