"""A real browser for the tests of pages."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext

#: Everything that a browser does by itself over the network is switched off: what is left comes from the page.
ARGUMENTS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
]
#: How long to wait for anything on a page, in milliseconds; only a hang takes so long.
PATIENCE_MS = 600_000


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Return Chromium, driven by playwright; skip where one of them is absent."""
    sync_api = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed (pip install -e '.[dev]')"
    )
    path = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if path is None:
        pytest.skip("no Chromium here (bash .ci/setup dev installs it)")
    with sync_api.sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=ARGUMENTS, timeout=PATIENCE_MS)
        new_context = chromium.new_context

        def patient_context(**options: Any) -> BrowserContext:
            """Return a context whose pages wait as long as a busy machine needs."""
            context: BrowserContext = new_context(**options)
            context.set_default_timeout(PATIENCE_MS)
            return context

        chromium.new_context = patient_context
        yield chromium
        chromium.close()
