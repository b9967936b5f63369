"""Measure how fast the page of align drags two maps: ``python docs/align_drag.py [SIDE [SECONDS]]``.

Two maps of SIDE x SIDE cells (2,000 if not given) of one drawn building are opened in a headless Chromium: painted in
software, on an emulated graphics card, and as Chromium chooses. The pointer moves once a frame; frames are counted as
the browser shows them. Needs chromium, chromedriver and the package selenium.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import threading
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.support.ui import WebDriverWait

from mapping.geometry.se2 import SE2
from mapping.grid.frame import GridFrame
from mapping.grid.occupancy_grid import OccupancyGrid
from mapping.io.map_file import save_map
from mapquilt.align.open_task import open_task
from mapquilt.align.server import AlignServer
from mapquilt.align.workspace import Workspace

RESOLUTION = 0.05
QUIET = ("--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run", "--window-size=1360,1000")
PAINTING = {
    "software": ("--disable-gpu",),
    "chosen by Chromium": (),
    "emulated graphics card": ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"),
}
DRAG = """
const [seconds, done] = arguments, { page, view } = window.mapquilt, canvas = document.getElementById("canvas");
const box = canvas.getBoundingClientRect(), middle = view.screen(view.middle(page.selected)), times = [];
let grip = null;
for (let ring = 0; ring < 400 && !grip; ring++) for (let k = 0; k < 12 && !grip; k++) {
  const spot = [middle[0] + ring * Math.cos(k), middle[1] + ring * Math.sin(k)];
  if (view.hit(spot) === page.selected) grip = spot;
}
const at = (kind, dx, dy) => canvas.dispatchEvent(new PointerEvent(kind, {
  pointerId: 1, button: 0, bubbles: true, clientX: box.left + grip[0] + dx, clientY: box.top + grip[1] + dy,
}));
canvas.setPointerCapture = () => {};  // there is no real pointer to capture
at("pointerdown", 0, 0); page.frames.length = 0;
const step = (time) => {
  times.push(time);
  const passed = (time - times[0]) / 1000, angle = 3 * passed;
  at("pointermove", 120 * Math.sin(angle), 120 * (1 - Math.cos(angle)));
  if (passed < seconds) { requestAnimationFrame(step); return; }
  at("pointerup", 0, 0);
  const gaps = times.slice(1).map((each, k) => each - times[k]).sort((a, b) => a - b);
  const paints = [...page.frames].sort((a, b) => a - b);
  const of = (sorted, share) => sorted[Math.floor(share * sorted.length)];
  done([gaps.length / passed, of(gaps, 0.95), of(paints, 0.5), paints.length]);
};
requestAnimationFrame(step);
"""
"""Drags the selected map in circles; returns frames a second, the 95 % quantile of the time between two [ms], the
median time of painting [ms], and the number of paintings."""


def main(side: int, seconds: float) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder, rng = Path(name), np.random.default_rng(0)
        building = drawn_building(side, rng)
        for title in ("a", "b"):
            save_map(seen(building, rng), folder / title)
        server = AlignServer(Workspace(open_task((folder / "a.yaml", folder / "b.yaml"), folder / "out")))
        thread = threading.Thread(target=server.run)
        thread.start()
        try:
            for painting, flags in PAINTING.items():
                rate, slow, paint, paints = drag(server.address, flags, seconds)
                sys.stdout.write(
                    f"{painting}: {rate:.1f} frames a second, 95 % within {slow:.0f} ms; {paints} paintings, "
                    f"median {paint:.1f} ms\n"
                )
                sys.stdout.flush()
        finally:
            server.stop()
            thread.join()


def drawn_building(side: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """Draw rooms with doors as log-odds (side, side): walls every 60 to 160 cells, free floor between them."""
    cells = np.full((side, side), -2.0, np.float32)
    for axis in (0, 1):
        lines = cells if axis == 0 else cells.T
        places = np.cumsum(rng.integers(60, 160, side // 60))
        for place in (0, *places[places < side - 3].tolist(), side - 3):
            lines[place : place + 3] = 2.0
            for door in rng.integers(20, side - 40, 0 if place in (0, side - 3) else side // 150).tolist():
                lines[place : place + 3, door : door + 18] = -2.0
    return cells


def seen(building: NDArray[np.float32], rng: np.random.Generator) -> OccupancyGrid:
    """Forget a tenth of the building in blocks, and a hundredth of its cells, as a map does."""
    side = len(building)
    known = building.copy()
    for row, col in rng.integers(0, side * 9 // 10, (10, 2)).tolist():
        known[row : row + side // 10, col : col + side // 10] = 0.0
    known[rng.random(known.shape) < 0.01] = 0.0
    return OccupancyGrid(GridFrame(RESOLUTION, SE2(), known.shape), known)


def drag(address: str, flags: tuple[str, ...], seconds: float) -> tuple[float, float, float, int]:
    """Open the page and drag the selected map; return what ``DRAG`` does."""
    options = webdriver.ChromeOptions()
    options.binary_location = found("chromium")
    for flag in (*QUIET, *flags):
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=Service(found("chromedriver")))
    try:
        driver.set_script_timeout(seconds + 120.0)
        driver.get(address)
        WebDriverWait(driver, 120).until(lambda _: driver.execute_script("return document.body.dataset.ready"))
        rate, slow, paint, paints = driver.execute_async_script(DRAG, seconds)
        return float(rate), float(slow), float(paint), int(paints)
    finally:
        driver.quit()


def found(program: str) -> str:
    """Return the path of a program. Raises ``ValueError`` if it is not installed."""
    path = shutil.which(program)
    if path is None:
        raise ValueError(f"{program}: is not installed: apt-get install chromium chromium-driver")
    return path


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 2000, float(sys.argv[2]) if len(sys.argv) > 2 else 5.0)
