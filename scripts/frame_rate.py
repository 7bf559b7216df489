"""Measure how smoothly the page's player moves in headless Chromium: frames per second, and the work for a frame.

    python scripts/frame_rate.py runs/paper/report.html [--seconds 5]

The script plays the walk with all of its views. It prints the number of frames drawn per second, the longest wait for a
frame, and how long the page's script takes for one. The environment variable `CHROMIUM` gives the path of the browser
if it is not found.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parent.parent / "tests" / "views" / "report"))
from browser import Browser, executable

MEASURE = """
new Promise((done) => {{
  const original = requestAnimationFrame.bind(window);
  const [times, work] = [[], []];
  window.requestAnimationFrame = (draw) => original((now) => {{
    const begun = performance.now();
    draw(now);
    times.push(now);
    work.push(performance.now() - begun);
  }});
  document.querySelector(".loop").checked = true;
  document.querySelector(".play").click();
  setTimeout(() => {{
    document.querySelector(".play").click();
    const waits = times.slice(1).map((time, index) => time - times[index]);
    const middle = (values) => values.sort((a, b) => a - b)[values.length >> 1];
    done([waits.length, times.at(-1) - times[0], Math.max(...waits), middle(work), Math.max(...work)]);
  }}, {milliseconds});
}})
"""
SHOWN = "[document.querySelectorAll('.player .track').length, document.querySelectorAll('.player .view').length]"


def main() -> None:
    """Measure one page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("page", type=Path)
    parser.add_argument("--seconds", type=float, default=5.0)
    options = parser.parse_args()
    path = executable()
    if path is None:
        sys.exit("no Chromium is installed; CHROMIUM may name one")
    browser = Browser(path)
    try:
        browser.open(options.page.resolve())
        walkers, views = browser.evaluate(SHOWN)
        frames, span, longest, usual, most = browser.evaluate(MEASURE.format(milliseconds=1000 * options.seconds))
    finally:
        browser.close()
    print(
        f"{walkers} models, {views} views: {1000 * frames / span:.1f} frames/s, longest wait {longest:.0f} ms; "
        f"the script takes {usual:.1f} ms a frame (median; at most {most:.1f} ms)"
    )


if __name__ == "__main__":
    main()
