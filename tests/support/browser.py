"""A real browser that looks at a page: widths, pictures, complaints and requests."""

import json
import os
import re
import shutil
import subprocess
from dataclasses import dataclass
from html import unescape
from pathlib import Path

import pytest

PHONE, DESK = 390, 1200
# Between the margins of an A4 sheet: 210 mm less twice 16 mm, at 96 pixels per inch.
PAPER = 673
_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_QUIET = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--no-first-run",
    "--no-default-browser-check",
    "--no-pings",
    "--enable-logging=stderr",
    # The measuring page looks into its frames, which are files as well.
    "--allow-file-access-from-files",
    # Nothing listens there: whatever is asked for stays on this machine.
    "--proxy-server=127.0.0.1:9",
    "--proxy-bypass-list=<-loopback>",
)
_MEASURE = """<!DOCTYPE html><meta charset="utf-8"><body><script>
const widths = %(widths)s, found = {};
let waiting = Object.keys(widths).length;
function measure(name, frame) {
  const page = frame.contentDocument, root = page.documentElement;
  if (name === "paper")
    for (const sheet of page.styleSheets) for (const rule of sheet.cssRules)
      if (rule instanceof frame.contentWindow.CSSMediaRule)
        rule.media.mediaText = rule.media.mediaText === "print" ? "all" : "not all";
  const first = page.body.innerText.length;
  // On paper everything is open by itself.
  if (name !== "paper")
    for (const folded of page.querySelectorAll("details")) folded.open = true;
  const inside = node => node.parentElement && node.parentElement.closest(".wide");
  const past = [...page.body.querySelectorAll("*")].filter(node =>
    node.getBoundingClientRect().right > root.clientWidth + 1 &&
    (name === "paper" || !inside(node)));
  found[name] = {
    width: root.scrollWidth,
    past: past.map(node => node.outerHTML.slice(0, 80)),
    first: first,
    text: page.body.innerText.length,
    canvases: page.querySelectorAll("canvas").length,
    images: [...page.images].filter(image => image.offsetParent).map(image => {
      const box = image.getBoundingClientRect();
      return {natural: image.naturalWidth, width: box.width, height: box.height};
    }),
  };
  if (--waiting === 0) {
    const result = document.createElement("pre");
    result.id = "found";
    result.textContent = JSON.stringify(found);
    document.body.append(result);
  }
}
for (const name in widths) {
  const frame = document.createElement("iframe");
  frame.style = `border: 0; height: 800px; width: ${widths[name]}px`;
  frame.onload = () => measure(name, frame);
  frame.src = %(page)s;
  document.body.append(frame);
}
</script>"""

_PLAY = """<!DOCTYPE html><meta charset="utf-8"><body><script>
const frame = document.createElement("iframe");
frame.style = "border: 0; height: 2000px; width: %(width)spx";
frame.onload = async () => {
  const result = document.createElement("pre");
  const act = async page => { %(script)s };
  result.textContent = JSON.stringify(await act(frame.contentDocument));
  result.id = "found";
  document.body.append(result);
};
frame.src = %(page)s;
document.body.append(frame);
</script>"""


@dataclass(frozen=True)
class Seen:
    """What the browser made of a page.

    Attributes:
        frames: by phone, desk and paper: width, what lies past it, images that show,
            canvases, letters of the text, and those before anything is unfolded.
        complaints: lines of the browser's console.
        requests: everything that was asked of the network.
    """

    frames: dict[str, dict]
    complaints: list[str]
    requests: list[str]


def chromium() -> str:
    """Return the browser; without one skip, or fail where one is required."""
    for name in _NAMES:
        if found := shutil.which(name):
            return found
    if os.environ.get("HDCAL_REQUIRE_BROWSER") == "1":
        pytest.fail("no Chromium is installed, and HDCAL_REQUIRE_BROWSER is 1")
    pytest.skip("no Chromium is installed")


def look(page: Path, scratch: Path) -> Seen:
    """Open a page as wide as a phone, a desk's screen and a sheet of paper."""
    widths = {"phone": PHONE, "desk": DESK, "paper": PAPER}
    text = {"widths": json.dumps(widths), "page": json.dumps(page.as_uri())}
    log = scratch / "network.json"
    found, complaints = _found(_MEASURE % text, scratch, f"--log-net-log={log}")
    return Seen(found, complaints, _requests(log))


def play(page: Path, scratch: Path, script: str) -> dict:
    """Open a page in a frame, and return what a script beside it finds.

    Args:
        page: as wide as a desk's screen.
        scratch: a folder.
        script: body of an asynchronous function of `page`, the document in the frame.
    """
    text = {"script": script, "page": json.dumps(page.as_uri()), "width": DESK}
    return _found(_PLAY % text, scratch)[0]


def _found(measuring: str, scratch: Path, *options: str) -> tuple[dict, list[str]]:
    """Return what a measuring page found, and what the browser complained of."""
    place = scratch / "measuring.html"
    place.write_text(measuring, "utf-8")
    # Time inside the page runs ahead, so that it waits for nothing of its own.
    asked = ["--dump-dom", "--virtual-time-budget=20000", *options, place.as_uri()]
    done = _run(scratch, asked)
    result = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    assert result, done.stdout[-2000:] + done.stderr[-2000:]
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return json.loads(unescape(result[1])), complaints


def print_pages(page: Path, scratch: Path) -> int:
    """Print a page, and return how many sheets it takes."""
    target = scratch / "printed.pdf"
    options = [f"--print-to-pdf={target}", "--no-pdf-header-footer"]
    done = _run(scratch, [*options, page.as_uri()])
    assert target.exists(), done.stderr[-2000:]
    return len(re.findall(rb"/Type\s*/Page\b", target.read_bytes()))


def _run(scratch: Path, options: list[str]):
    home = f"--user-data-dir={scratch / 'profile'}"
    return subprocess.run(
        [chromium(), *_QUIET, home, *options],
        capture_output=True,
        text=True,
        errors="replace",
        timeout=120,
    )


def _requests(log: Path) -> list[str]:
    """Return the addresses that a page asked for; the browser asks for others."""
    found = json.loads(log.read_text("utf-8"))
    start = found["constants"]["logEventTypes"]["URL_REQUEST_START_JOB"]
    asked = [event["params"] for event in found["events"] if event["type"] == start]
    return [
        request["url"]
        for request in asked
        if "url" in request and request["initiator"] != "not an origin"
    ]
