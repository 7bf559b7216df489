"""Take the picture of docs/explore.md: `walkerlab explore` in a headless Chromium, at 2.5 degrees.

python scripts/picture_of_explore.py
"""

import io
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from browser import Browser, executable  # noqa: E402
from PIL import Image  # noqa: E402

import walkerlab  # noqa: E402

PICTURE = ROOT / "docs" / "images" / "explore.png"


class Address:
    """Address of a page that is not a file."""

    def __init__(self, text):
        self.text = text

    def as_uri(self):
        return self.text


def main(picture=PICTURE):
    page = walkerlab.explore(contact=walkerlab.contact())
    browser = Browser(executable())
    try:
        browser.open(Address(page.url), 1360, 1120)
        browser.until("document.body.dataset.state === 'shown'")
        for slope in (1.5, 2.0, 2.5):
            browser.evaluate(f"setParameter('slope_deg', {slope}, true)")
            browser.until(f"shown.request.set.slope_deg === {slope}")
        browser.until("along.gaits?.some(({ model }) => model === 'contact')")
        time.sleep(2.5)
        # a palette is a third of the size
        Image.open(io.BytesIO(browser.screenshot())).quantize(128).save(picture, optimize=True)
    finally:
        browser.close()
        page.close()


if __name__ == "__main__":
    main()
