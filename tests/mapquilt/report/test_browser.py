"""The report in a browser: no console messages, sorting and filtering of the table, slider of the overlay."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from mapquilt.cli.verbs.report import read_content
from mapquilt.report.page import render_page

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def pages(merged_run, tiny, tiny_benchmark, tiny_study, tmp_path_factory) -> dict[str, Path]:
    out = tmp_path_factory.mktemp("pages")
    folders = {"run": merged_run, "dataset": tiny, "benchmark": tiny_benchmark, "study": tiny_study}
    for name, folder in folders.items():
        (out / f"{name}.html").write_text(render_page(read_content(folder), 8), encoding="utf-8")
    return {name: out / f"{name}.html" for name in folders}


@pytest.fixture
def study(browser: webdriver.Chrome, pages: dict[str, Path]) -> webdriver.Chrome:
    browser.get(pages["study"].as_uri())
    return browser


def rows(browser: webdriver.Chrome):
    return [row for row in browser.find_elements(By.CSS_SELECTOR, "#pairs tbody tr") if row.is_displayed()]


def column(browser: webdriver.Chrome, name: str) -> list[str]:
    heads = [head.text.split("\n")[0] for head in browser.find_elements(By.CSS_SELECTOR, "#pairs thead th")]
    return [row.find_elements(By.TAG_NAME, "td")[heads.index(name)].text for row in rows(browser)]


def head(browser: webdriver.Chrome, name: str):
    heads = browser.find_elements(By.CSS_SELECTOR, "#pairs thead th")
    return next(one for one in heads if one.text.split("\n")[0] == name)


@pytest.mark.parametrize("name", ["run", "dataset", "benchmark", "study"])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_the_console_stays_silent(browser, pages, name, theme):
    browser.get_log("browser")
    browser.get(pages[name].as_uri())
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]}
    )
    for button in browser.find_elements(By.CSS_SELECTOR, "button.open")[:2]:
        browser.execute_script("arguments[0].click()", button)
        browser.find_element(By.ID, "close").click()
    assert browser.get_log("browser") == []
    paper = browser.execute_script("return getComputedStyle(document.body).backgroundColor")
    bright = sum(map(int, paper.removeprefix("rgb(").removesuffix(")").split(", "))) > 3 * 128
    assert bright == (theme == "light")
    assert (
        browser.execute_script(
            "return performance.getEntriesByType('resource').filter(r => !r.name.startsWith('data:')).length"
        )
        == 0
    )


def test_a_column_sorts_up_and_down(study):
    before = column(study, "confidence")
    head(study, "confidence").find_element(By.TAG_NAME, "button").click()
    up = [float(text) for text in column(study, "confidence")]
    assert up == sorted(up) and sorted(before) == sorted(column(study, "confidence"))
    assert head(study, "confidence").get_attribute("aria-sort") == "ascending"
    head(study, "confidence").find_element(By.TAG_NAME, "button").send_keys(Keys.ENTER)
    down = [float(text) for text in column(study, "confidence")]
    assert down == sorted(up, reverse=True)
    assert up != down


def test_filters_select_rows_and_show_their_number(study):
    every = len(rows(study))
    Select(study.find_element(By.NAME, "method")).select_by_visible_text("orb")
    assert set(column(study, "method")) == {"orb"}
    assert len(rows(study)) == every // 2
    Select(study.find_element(By.NAME, "level")).select_by_visible_text("3")
    assert set(column(study, "level")) == {"3"}
    assert study.find_element(By.ID, "count").text == f"{every // 4} of {every} rows"
    study.find_element(By.ID, "search").send_keys("001 robot_1")
    assert all(text.startswith("001") for text in column(study, "pair"))
    assert len(rows(study)) == every // 8
    study.find_element(By.ID, "search").send_keys(" nowhere")
    assert rows(study) == []


def test_the_slider_moves_the_overlay(study):
    study.execute_script("arguments[0].scrollIntoView()", rows(study)[0])
    rows(study)[0].find_element(By.CSS_SELECTOR, "button.open").send_keys(Keys.ENTER)
    dialog = study.find_element(By.ID, "pair")
    assert dialog.is_displayed()
    over, slider = dialog.find_element(By.CSS_SELECTOR, ".over"), study.find_element(By.ID, "slider")
    assert "50%" in over.value_of_css_property("clip-path")
    for _ in range(20):
        slider.send_keys(Keys.ARROW_RIGHT)
    assert slider.get_attribute("value") == "70"
    assert "30%" in over.value_of_css_property("clip-path")
    assert slider.get_attribute("aria-valuetext") == "70 % merge, 30 % truth"
    shown = "return arguments[0].complete && arguments[0].naturalWidth > 100"
    for image in dialog.find_elements(By.CSS_SELECTOR, ".overlay img, .two img"):
        assert study.execute_script(shown, image)
        assert image.get_attribute("alt")


def test_pairs_can_be_browsed_by_keyboard(study):
    first = rows(study)[0].find_element(By.CSS_SELECTOR, "button.open")
    first.send_keys(Keys.ENTER)
    title = study.find_element(By.ID, "pair-title")
    before = title.text
    study.find_element(By.ID, "close").send_keys(Keys.ARROW_RIGHT)
    assert title.text != before
    study.find_element(By.ID, "close").send_keys(Keys.ARROW_LEFT)
    assert title.text == before
    study.find_element(By.ID, "close").send_keys(Keys.ESCAPE)
    assert not study.find_element(By.ID, "pair").is_displayed()
    assert study.switch_to.active_element == first


def test_light_and_dark_can_be_chosen(study):
    colour = "return getComputedStyle(document.body).backgroundColor"
    before = study.execute_script(colour)
    button = study.find_element(By.ID, "theme")
    words = button.text
    button.click()
    assert study.execute_script(colour) != before
    assert {words, button.text} == {"Light", "Dark"}


def pixels(browser: webdriver.Chrome) -> np.ndarray:
    """What the canvas of the mission shows, as RGB (rows, cols, 3)."""
    png = np.frombuffer(browser.find_element(By.ID, "mission-canvas").screenshot_as_png, np.uint8)
    return cv2.imdecode(png, cv2.IMREAD_COLOR)


def move_to(browser: webdriver.Chrome, seconds: float) -> None:
    browser.execute_script(
        "const s = document.getElementById('moment'); s.value = arguments[0]; s.dispatchEvent(new Event('input'));"
        "return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))",
        seconds,
    )


def test_the_mission_is_drawn_and_follows_the_slider(browser, pages):
    browser.get(pages["run"].as_uri())
    browser.execute_script("document.getElementById('mission').scrollIntoView()")
    WebDriverWait(browser, 20).until(lambda _: browser.find_element(By.ID, "clock").text == "12.0 of 12 s")
    move_to(browser, 0.0)
    start = pixels(browser)
    assert len(np.unique(start.reshape(-1, 3), axis=0)) > 50
    assert browser.find_element(By.ID, "clock").text == "0.0 of 12 s"
    move_to(browser, 9.0)
    later = pixels(browser)
    assert (start != later).any(axis=2).mean() > 0.001
    move_to(browser, 0.0)
    np.testing.assert_array_equal(pixels(browser), start)
    browser.find_element(By.ID, "from-above").click()
    move_to(browser, 0.0)
    assert (start != pixels(browser)).any(axis=2).mean() > 0.05


def test_the_mission_plays_and_pauses(browser, pages):
    browser.get(pages["run"].as_uri())
    move_to(browser, 1.0)
    play = browser.find_element(By.ID, "play")
    play.click()
    assert play.text == "Pause"
    WebDriverWait(browser, 20).until(lambda _: float(browser.find_element(By.ID, "moment").get_attribute("value")) > 2)
    if play.text == "Pause":
        play.click()
    assert play.text == "Play"


def test_without_webgl_a_note_stands_in_place_of_the_mission(browser, pages):
    hide = "HTMLCanvasElement.prototype.getContext = () => null"
    made = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": hide})
    browser.get(pages["run"].as_uri())
    assert browser.find_element(By.ID, "no-webgl").is_displayed()
    assert not browser.find_element(By.ID, "play").is_displayed()
    browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", made)


def test_the_link_of_a_pair_opens_it(study, pages):
    row = rows(study)[2]
    anchor, title = row.get_attribute("id"), row.find_element(By.CSS_SELECTOR, ".title").text
    study.get("about:blank")
    study.get(f"{pages['study'].as_uri()}#{anchor}")
    assert study.find_element(By.ID, "pair").is_displayed()
    assert study.find_element(By.ID, "pair-title").text.startswith(title)
    assert study.find_element(By.ID, "link").get_attribute("href").endswith(f"#{anchor}")
    study.find_element(By.ID, "close").click()
    WebDriverWait(study, 20).until(lambda _: "#" not in study.current_url)


def test_merge_and_truth_stand_in_one_order(study):
    rows(study)[0].find_element(By.CSS_SELECTOR, "button.open").click()
    merge, truth = study.find_element(By.CSS_SELECTOR, ".tag.left"), study.find_element(By.CSS_SELECTOR, ".tag.last")
    first, last = study.find_elements(By.CSS_SELECTOR, ".slide span")
    assert [one.text for one in (merge, truth)] == [one.text for one in (first, last)] == ["merge", "truth"]
    assert merge.location["x"] < truth.location["x"] and first.location["x"] < last.location["x"]


@pytest.mark.parametrize("name", ["run", "dataset", "benchmark", "study"])
def test_every_column_fits_1280_pixels(browser, pages, name):
    size = {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    browser.get(pages[name].as_uri())
    wide = "return [...document.querySelectorAll('.scroll')].filter(e => e.scrollWidth > e.clientWidth).length"
    assert browser.execute_script(wide) == 0
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 1280
    browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_a_merged_run_shows_its_maps(browser, pages):
    browser.get_log("browser")
    browser.get(pages["run"].as_uri())
    browser.find_element(By.ID, "theme").click()
    browser.switch_to.frame(browser.find_element(By.ID, "maps-page"))
    WebDriverWait(browser, 60).until(lambda _: browser.execute_script("return document.body.dataset.ready"))
    assert [each.text for each in browser.find_elements(By.CSS_SELECTOR, "#maps .name")] == ["robot_0", "robot_1"]
    WebDriverWait(browser, 60).until(lambda _: browser.find_elements(By.CSS_SELECTOR, "#scores .score"))
    theme = browser.execute_script("return document.documentElement.dataset.theme")
    browser.switch_to.default_content()
    assert theme == browser.execute_script("return document.documentElement.dataset.theme")
    assert browser.get_log("browser") == []
