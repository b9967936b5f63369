"""The report in a browser: no console messages, sorting and filtering of the table, slider of the overlay."""

from __future__ import annotations

from pathlib import Path

import pytest
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select

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
