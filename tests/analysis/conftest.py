"""A real browser for the pages: what it complains of, what it fetches, which pictures it shows."""

from __future__ import annotations

import html
import json
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

CHROMIUM = next(
    (path for name in ("chromium", "chromium-browser", "google-chrome", "chrome") if (path := shutil.which(name))),
    None,
)
# Runs after everything has loaded and writes what the page did into the page, which --dump-dom then prints.
PROBE = """<script>addEventListener("load", () => {
  const seen = {
    pictures: [...document.images].map(i => [i.alt, i.naturalWidth, i.naturalHeight]),
    fetched: performance.getEntriesByType("resource").map(e => e.name).filter(n => !n.startsWith("data:")),
    width: innerWidth,
    too_wide: document.documentElement.scrollWidth - document.documentElement.clientWidth,
  };
  const mark = document.createElement("pre"); mark.id = "probe"; mark.textContent = JSON.stringify(seen);
  document.body.append(mark); })</script></body>
  """
# A window is never narrower than 500 px; a phone's width is that of a frame inside it.
FRAME = """<!doctype html><iframe src="page.html" style="border:0;width:{width_px}px;height:900px"></iframe>
<script>addEventListener("load", () =>
  document.body.append(frames[0].document.getElementById("probe").cloneNode(true)))</script>"""


@dataclass(frozen=True)
class Seen:
    """What a browser saw: console lines, fetched addresses, pictures (alt, width, height), pixels of sideways
    scroll.
    """

    console: list[str]
    fetched: list[str]
    pictures: list[tuple[str, int, int]]
    too_wide: int


@pytest.fixture
def browse(tmp_path):
    """Function (page text, width in px) -> Seen; the test is skipped where no Chromium is installed."""
    if CHROMIUM is None:
        pytest.skip("no chromium on this machine (apt-get install chromium)")

    (tmp_path / "page.html").touch()
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(SimpleHTTPRequestHandler, directory=tmp_path))
    Thread(target=server.serve_forever, daemon=True).start()

    def look(page: str, width_px: int = 1100) -> Seen:
        (tmp_path / "page.html").write_text(page.replace("</body>", PROBE), encoding="utf-8")
        (tmp_path / "frame.html").write_text(FRAME.format(width_px=width_px), encoding="utf-8")
        done = subprocess.run(
            [
                CHROMIUM,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-extensions",
                "--no-first-run",
                "--enable-logging=stderr",
                # of its own: a page written twice in a second is the same to a profile that has seen it
                f"--user-data-dir={tempfile.mkdtemp(dir=tmp_path)}",
                f"--window-size={width_px + 50},950",
                "--virtual-time-budget=10000",
                "--dump-dom",
                "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
                f"http://127.0.0.1:{server.server_port}/frame.html",
            ],
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        found = re.search(r'<pre id="probe">(.*?)</pre>', done.stdout, re.DOTALL)
        assert found, "the page did not finish loading"
        seen = json.loads(html.unescape(found[1]))
        assert seen["width"] == width_px
        console = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
        return Seen(console, seen["fetched"], [tuple(p) for p in seen["pictures"]], seen["too_wide"])

    yield look
    server.shutdown()
    server.server_close()


SHARED = Path(__file__).resolve().parents[2].parent / "shared"


@pytest.fixture
def practice() -> Path:
    """The practice series beside the checkout; the test is skipped without them."""
    if not (SHARED / "practice").is_dir():
        pytest.skip("no practice series beside the checkout")
    return SHARED / "practice"
