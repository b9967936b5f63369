"""One folder of each kind for the report, and a headless Chromium."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.chrome.service import Service

from tests.conftest import command
from tests.mapquilt.dataset.conftest import spec_file, tiny
from tests.mapquilt.study.conftest import tiny_study

__all__ = ["spec_file", "tiny", "tiny_study"]

CHROMIUM, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
QUIET = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--force-prefers-reduced-motion",
    "--window-size=1360,1000",
)
"""A page of one's own in a container with WebGL in software, and no calls home."""


@pytest.fixture(scope="session")
def tiny_benchmark(tiny: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two methods on all pairs of the tiny data set."""
    folder = tmp_path_factory.mktemp("bench") / "tiny"
    given = ["--dataset", tiny, "--method", "quilt", "--method", "orb", "--pictures", 0, "--out", folder]
    assert command("benchmark", *given) == 0
    return folder


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[webdriver.Chrome]:
    """A headless Chromium that keeps its console; skipped with the reason where there is none."""
    if CHROMIUM is None or DRIVER is None:
        pytest.skip("no chromium and chromedriver here: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in (*QUIET, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    driver.set_page_load_timeout(120)
    yield driver
    driver.quit()
