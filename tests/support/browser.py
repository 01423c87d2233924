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
  const inside = node => node.parentElement && node.parentElement.closest(".wide");
  const past = [...page.body.querySelectorAll("*")].filter(node =>
    node.getBoundingClientRect().right > root.clientWidth + 1 &&
    (name === "paper" || !inside(node)));
  found[name] = {
    width: root.scrollWidth,
    past: past.map(node => node.outerHTML.slice(0, 80)),
    text: page.body.innerText.length,
    images: [...page.images].map(image => {
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


@dataclass(frozen=True)
class Seen:
    """What the browser made of a page.

    Attributes:
        frames: by phone, desk and paper: width, what lies past it, text and images.
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
    measuring = scratch / "measuring.html"
    text = {"widths": json.dumps(widths), "page": json.dumps(page.as_uri())}
    measuring.write_text(_MEASURE % text, "utf-8")
    log = scratch / "network.json"
    # Time inside the page runs ahead, so that it waits for nothing of its own.
    options = [f"--log-net-log={log}", "--dump-dom", "--virtual-time-budget=20000"]
    done = _run(scratch, [*options, measuring.as_uri()])
    result = re.search(r'<pre id="found">(.*?)</pre>', done.stdout, re.S)
    assert result, done.stdout[-2000:] + done.stderr[-2000:]
    complaints = [line for line in done.stderr.splitlines() if "CONSOLE" in line]
    return Seen(json.loads(unescape(result[1])), complaints, _requests(log))


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
