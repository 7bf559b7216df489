"""Take the picture of the report in docs/tutorial.md: the page of the tutorial's walker in a headless Chromium.

python scripts/picture_of_page.py
"""

import io
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from browser import Browser, executable  # noqa: E402
from PIL import Image  # noqa: E402

import walkerlab  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "page.png"


def main(picture=PICTURE):
    browser = Browser(executable())
    with tempfile.TemporaryDirectory() as folder:
        config = Path(folder) / "heavier.yaml"
        config.write_text("extends: paper\nwalker:\n  hip_mass_kg: 15\n", encoding="utf-8")
        runs = Path(folder) / "runs"
        walkerlab.run("report", config, runs=runs)
        try:
            browser.open(runs / "heavier" / "report.html", 1200, 1150)
            # a palette is a third of the size
            Image.open(io.BytesIO(browser.screenshot())).quantize(128).save(picture, optimize=True)
        finally:
            browser.close()


if __name__ == "__main__":
    main()
