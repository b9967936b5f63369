"""The page inside a report, in a headless Chromium: it answers as the server does, and changes no map."""

from __future__ import annotations

import base64
from pathlib import Path

import numpy as np
import pytest
from selenium import webdriver
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

from mapping.io.map_file import save_map
from mapquilt.align.describe import measured_record
from mapquilt.align.embedded import MODULES, embedded_page
from mapquilt.align.open_task import open_task
from mapquilt.align.server import PAGE_FILES
from mapquilt.align.workspace import Workspace
from mapquilt.json_file import similarity_record
from tests.conftest import command
from tests.merge.test_merger import team

HOSTILE = "<img src=x onerror=document.title='hacked'>"
POSES = "return window.mapquilt.page.poses"
CALL = "const [name, body, done] = arguments; modules['embedded.js'].call(name, body).then(done)"


@pytest.fixture(scope="module")
def merge(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The merge of three maps, of which one has a hostile name."""
    maps, _ = team(8, 3)
    folder = tmp_path_factory.mktemp("three")
    files = [folder / f"{name}.yaml" for name in (HOSTILE, "b", "c")]
    for file, grid in zip(files, maps.grids, strict=True):
        save_map(grid, file.with_suffix(""))
    assert command("merge", *files, "--out", folder / "merge") in (0, 1)
    return folder / "merge"


@pytest.fixture(scope="module")
def workspace(merge: Path) -> Workspace:
    return Workspace(open_task((merge,)))


@pytest.fixture
def shown(browser: webdriver.Chrome, merge: Path, tmp_path: Path) -> webdriver.Chrome:
    (tmp_path / "page.html").write_text(embedded_page(merge), encoding="utf-8")
    browser.get_log("browser")
    browser.get((tmp_path / "page.html").as_uri())
    WebDriverWait(browser, 60).until(lambda _: browser.execute_script("return document.body.dataset.ready"))
    return browser


def test_all_modules_but_the_requests_to_the_server_are_embedded() -> None:
    assert {*MODULES} - {"embedded.js"} == {name for name in PAGE_FILES if name.endswith(".js")} - {"api.js"}


@pytest.mark.browser
@pytest.mark.parametrize("index", [0, 1, 2])
def test_it_measures_as_the_server_does(shown, workspace, index) -> None:
    others = [other for other in range(3) if other != index]
    pose = workspace.arrangement.placements[index].sheet_from_map
    wanted = measured_record(workspace, index, pose, others)
    found = shown.execute_async_script(CALL, "measure", {"map": index, **similarity_record(pose), "others": others})
    assert found["walls"].keys() == wanted["walls"].keys()
    for name, walls in wanted["walls"].items():
        one, two = (np.frombuffer(base64.b64decode(each), np.uint8) for each in (walls, found["walls"][name]))
        assert (one == two).all()
    for one, two in zip(wanted["pairs"], found["pairs"], strict=True):
        assert one["other"] == two["other"]
        assert two["score"] == pytest.approx(one["score"], abs=0.05)


@pytest.mark.browser
def test_a_click_takes_a_candidate_and_undo_goes_back(shown, workspace) -> None:
    before = shown.execute_script(POSES)
    pairs = shown.find_elements(By.CSS_SELECTOR, "#pairs .pair")
    assert len(pairs) == 3
    shown.execute_script("arguments[0].click()", pairs[0])
    WebDriverWait(shown, 60).until(lambda _: shown.find_elements(By.CSS_SELECTOR, "#candidates button"))
    buttons = shown.find_elements(By.CSS_SELECTOR, "#candidates button")
    target, source = map(workspace.maps.names.index, pairs_named(shown, workspace))
    _, candidates = workspace.candidates(source, target)
    assert len(buttons) == min(4, len(candidates))
    shown.execute_script("arguments[0].click()", buttons[-1])
    WebDriverWait(shown, 60).until(lambda _: shown.find_element(By.ID, "decided").text.startswith("placed at a cand"))
    sheet = workspace.arrangement.placements[target].sheet_from_map
    wanted = similarity_record(sheet @ candidates[len(buttons) - 1][0])
    assert shown.execute_script(POSES)[source] == pytest.approx(wanted)
    shown.find_element(By.ID, "undo").click()
    WebDriverWait(shown, 60).until(lambda _: shown.execute_script(POSES) == before)
    assert shown.get_log("browser") == []


def pairs_named(shown: webdriver.Chrome, workspace: Workspace) -> tuple[str, str]:
    """The target, from the title of the shown answer, and the selected map."""
    title = shown.find_element(By.ID, "verdict-title").text
    return title.removeprefix("Tool's answer against "), shown.find_element(By.ID, "selected-name").text


@pytest.mark.browser
def test_nothing_moves_a_map_or_asks_a_server(shown) -> None:
    before, canvas = shown.execute_script(POSES), shown.find_element(By.ID, "canvas")
    centre = shown.execute_script("return window.mapquilt.view.centre")
    ActionChains(shown, duration=20).move_to_element(canvas).click_and_hold().move_by_offset(60, 20).release().perform()
    canvas.send_keys("qs")
    assert shown.execute_script(POSES) == before
    assert shown.execute_script("return window.mapquilt.view.centre") != centre
    for name in ("snap", "solve", "save", "save-dialog", "quit"):
        assert shown.find_elements(By.ID, name) == []
    assert shown.execute_script("return performance.getEntriesByType('resource').length") == 0


@pytest.mark.browser
def test_a_hostile_name_is_text(shown) -> None:
    names = [each.text for each in shown.find_elements(By.CSS_SELECTOR, "#maps .name")]
    assert HOSTILE in names and shown.find_elements(By.TAG_NAME, "img") == []
    assert shown.title == "mapquilt align"
