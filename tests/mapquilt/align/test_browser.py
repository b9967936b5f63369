"""The page in a headless Chromium: dragging, keys, snap, hostile names, themes and narrow windows."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from mapping.io.map_file import save_map
from mapquilt.align.open_task import open_task
from mapquilt.align.server import AlignServer
from mapquilt.align.workspace import Workspace
from tests.mapquilt.align.conftest import sheet_pose

pytestmark = pytest.mark.browser

HOSTILE = "<img src=x onerror=document.title='hacked'>"
GRIP = """
const { view, page } = window.mapquilt, [x, y] = view.middle(page.selected), at = view.screen([x, y]);
for (let ring = 0; ring < 200; ring++) for (let k = 0; k < 12; k++) {
  const spot = [at[0] + ring * Math.cos(k), at[1] + ring * Math.sin(k)];
  if (view.hit(spot) === page.selected) return spot;
}
"""
"""Finds a pixel at which the selected map can be gripped."""


@pytest.fixture
def shown(browser: webdriver.Chrome, client) -> Iterator[webdriver.Chrome]:
    yield opened(browser, client.server)


def opened(browser: webdriver.Chrome, server: AlignServer) -> webdriver.Chrome:
    browser.get_log("browser")
    browser.get(server.address)
    WebDriverWait(browser, 60).until(lambda _: browser.execute_script("return document.body.dataset.ready"))
    return browser


def decided(browser: webdriver.Chrome) -> str:
    return browser.find_element(By.ID, "decided").text


def wait_for(browser: webdriver.Chrome, text: str) -> None:
    WebDriverWait(browser, 60).until(lambda _: decided(browser) == text)


def drag(browser: webdriver.Chrome, dx: int, dy: int) -> None:
    canvas = browser.find_element(By.ID, "canvas")
    x, y = browser.execute_script(GRIP)
    at = round(x - canvas.size["width"] / 2), round(y - canvas.size["height"] / 2)
    actions = ActionChains(browser, duration=20).move_to_element_with_offset(canvas, *at).click_and_hold()
    for _ in range(5):
        actions.move_by_offset(dx // 5, dy // 5)
    actions.release().perform()


def test_a_drag_moves_a_map_by_as_much_and_undo_takes_it_back(shown, workspace) -> None:
    before = workspace.arrangement.placements[1].sheet_from_map
    zoom = shown.execute_script("return window.mapquilt.view.zoom")
    drag(shown, 50, -30)
    wait_for(shown, "placed by hand")
    after = workspace.arrangement.placements[1].sheet_from_map
    assert (after.x - before.x) * zoom == pytest.approx(50.0, abs=1.5)
    assert (after.y - before.y) * zoom == pytest.approx(30.0, abs=1.5)
    shown.find_element(By.TAG_NAME, "body").send_keys(Keys.CONTROL, "z")
    wait_for(shown, "not placed yet")
    assert workspace.arrangement.placements[1].sheet_from_map == before
    assert shown.get_log("browser") == []


def test_arrow_keys_move_by_a_cell_and_letters_turn_by_half_a_degree(shown, workspace) -> None:
    before = workspace.arrangement.placements[1].sheet_from_map
    canvas = shown.find_element(By.ID, "canvas")
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT, Keys.ARROW_UP)
    wait_for(shown, "placed by hand")
    after = workspace.arrangement.placements[1].sheet_from_map
    cell = workspace.maps.grids[1].frame.resolution
    assert (after.x - before.x, after.y - before.y) == (pytest.approx(2 * cell), pytest.approx(cell))
    canvas.send_keys("q")
    WebDriverWait(shown, 60).until(lambda _: workspace.arrangement.placements[1].sheet_from_map.yaw != 0.0)
    assert workspace.arrangement.placements[1].sheet_from_map.yaw == pytest.approx(0.5 * 3.141592653589793 / 180)


def test_snap_says_how_sure_it_is_and_the_walls_are_coloured(shown, workspace, two) -> None:
    workspace.place(1, sheet_pose(workspace, two.target_from_source))
    shown.refresh()
    WebDriverWait(shown, 60).until(lambda _: shown.find_element(By.ID, "scores").text)
    shown.find_element(By.ID, "snap").click()
    wait_for(shown, "snapped")
    WebDriverWait(shown, 60).until(lambda _: "Accepted" in shown.find_element(By.ID, "verdict-text").text)
    matched = "return [...window.mapquilt.page.walls.get(1)].filter(kind => kind === 1).length"
    assert shown.execute_script(matched) > 100


def test_the_answer_explains_itself_and_a_click_takes_a_candidate(shown, workspace) -> None:
    shown.find_element(By.ID, "ask").click()
    WebDriverWait(shown, 60).until(lambda _: shown.find_elements(By.CSS_SELECTOR, "#candidates button"))
    answer, found = workspace.candidates(1, 0)
    pictures = shown.find_elements(By.CSS_SELECTOR, "#candidates canvas")
    assert len(pictures) == min(4, len(found))
    drawn = "return new Set(arguments[0].getContext('2d').getImageData(0, 0, 100, 100).data).size"
    assert all(shown.execute_script(drawn, picture) > 3 for picture in pictures)
    rows = shown.find_elements(By.CSS_SELECTOR, "#evidence tr")
    assert [row.text for row in rows if row.text.startswith("alignment score")] == [
        f"alignment score {answer.evidence.score:.2f} {workspace.task.settings.acceptance.min_score:.2f}"
    ]
    shown.find_element(By.CSS_SELECTOR, "#candidates button").click()
    wait_for(shown, "placed at a candidate that you chose")
    assert workspace.arrangement.target_from_source(0, 1).yaw == pytest.approx(found[0][0].yaw)


def test_save_writes_the_map_in_the_frame_that_was_chosen(shown, workspace) -> None:
    shown.find_element(By.ID, "save").click()
    Select(shown.find_element(By.ID, "frame-of")).select_by_visible_text("b")
    shown.find_element(By.ID, "save-merge").click()
    WebDriverWait(shown, 60).until(lambda _: "merged_in_frame" in shown.find_element(By.ID, "saved").text)
    assert (workspace.task.folder / "merged_in_frame.yaml").is_file()
    assert shown.get_log("browser") == []


def test_a_hostile_name_is_text(browser, two, workspace, tmp_path) -> None:
    grids = workspace.maps.grids
    files = [tmp_path / f"{HOSTILE}.yaml", tmp_path / "b.yaml"]
    for file, grid in zip(files, grids, strict=True):
        save_map(grid, file.with_suffix(""))
    server = AlignServer(Workspace(open_task(files, tmp_path / "other", None, None, 0)))
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        opened(browser, server)
        names = [each.text for each in browser.find_elements(By.CSS_SELECTOR, "#maps .name")]
        assert names == [HOSTILE, "b"]
        assert browser.find_elements(By.TAG_NAME, "img") == []
        assert browser.title == "mapquilt align"
        assert browser.get_log("browser") == []
    finally:
        server.stop()
        thread.join(60)


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 820, 1360])
def test_the_page_fits_the_window_in_both_themes(shown, theme, width) -> None:
    size = {"width": width, "height": 800, "deviceScaleFactor": 1, "mobile": False}
    shown.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    shown.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]}
    )
    assert shown.execute_script("return document.documentElement.scrollWidth") <= width
    paper = shown.execute_script("return getComputedStyle(document.body).backgroundColor")
    bright = sum(map(int, paper.removeprefix("rgb(").removesuffix(")").split(", "))) > 3 * 128
    assert bright == (theme == "light")
    assert shown.get_log("browser") == []
    shown.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    shown.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_quit_ends_the_server(shown, client) -> None:
    shown.find_element(By.ID, "quit").click()
    WebDriverWait(shown, 60).until(lambda _: "ended" in shown.find_element(By.ID, "status").text)
    assert "has ended" in shown.find_element(By.ID, "status").text
