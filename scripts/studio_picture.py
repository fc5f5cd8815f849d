#!/usr/bin/env python3
"""Writes docs/images/studio.png: the studio with its first design, cut open. Needs `make studio`, playwright and Chromium."""

import shutil
from pathlib import Path

from playwright.sync_api import sync_playwright

ROOT = Path(__file__).resolve().parent.parent
READY = "state.opened && !state.busy && !state.stale"


def main():
    """Draws the picture."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1240, "height": 720})
        page.goto((ROOT / "build/studio/index.html").as_uri())
        page.wait_for_function(READY, timeout=60_000)
        page.check("#skin")
        page.check("#ramp")
        page.wait_for_function("text.value.includes('linear')")
        page.fill("#top-number", "0.45")
        page.wait_for_function("text.value.includes('0.45')")
        page.select_option("[name=axis]", "x")
        page.wait_for_function(READY, timeout=60_000)
        page.wait_for_timeout(500)
        page.screenshot(path=ROOT / "docs/images/studio.png")
        browser.close()


if __name__ == "__main__":
    main()
