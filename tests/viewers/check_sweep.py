"""Opens the report of a sweep of 1,000 cases in headless Chromium, chooses cases, sorts the table and follows a link;
then that of a grid of two inputs, a map.

    check_sweep.py percuss-read SCREENSHOT.png

Needs the PyPI package selenium and Debian's packages chromium and chromium-driver. The screenshots, a wide one and a narrow one,
are for people.
"""

import json
import math
import pathlib
import subprocess
import sys

from selenium import webdriver
from selenium.common.exceptions import StaleElementReferenceException
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import Select, WebDriverWait

reader, screenshot = map(pathlib.Path, sys.argv[1:])
CASES = 1000
folder = pathlib.Path("masses")
(folder / "runs").mkdir(parents=True)
with open(folder / "summary.csv", "w") as summary, open(folder / "manifest.jsonl", "w") as journal:
    print("case,indenter.mass,target.shear_wave_speed,target.thickness,status,peak_force [N],peak_time [s],restitution", file=summary)
    for case in range(1, CASES + 1):
        mass, speed, thickness = 0.1 * 1000 ** (case % 20 / 19), 0.3 + case // 20 % 5 * 0.05, 1 + case // 100
        force, time, lost = 4e3 * mass**0.4 * (1 + speed), 2e-5 * math.sqrt(mass), math.exp(-mass / thickness)
        is_done = case % 50 != 7
        measures = f"{force!r},{time!r},{0.9 - 0.3 * lost!r}" if is_done else ",,"
        print(f"{case},{mass!r},{speed!r},{thickness},{'done' if is_done else 'failed'},{measures}", file=summary)
        name = f"runs/{case:04}.mcap" if is_done else None
        print(json.dumps({"case": case, "file": name}), file=journal)
        if name:
            (folder / name).touch()
subprocess.run([reader.resolve(), "report", folder], check=True)
page = pathlib.Path("masses.html")

options = webdriver.ChromeOptions()
for option in [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1280,1700",
]:
    options.add_argument(option)
options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
try:
    driver.get(page.resolve().as_uri())
    body = driver.find_element(By.TAG_NAME, "body")

    def count(name):
        return int(body.get_attribute(f"data-{name}"))

    def until(what, fits):
        WebDriverWait(driver, 5, ignored_exceptions=[StaleElementReferenceException]).until(lambda _: fits(), what)

    until("the script comes to its end", lambda: body.get_attribute("data-ready") == "true")
    done = CASES - CASES // 50
    assert (count("chosen"), count("points")) == (CASES, done), "cases without a force are no points"
    badges = [badge.text for badge in driver.find_elements(By.CSS_SELECTOR, "#verdict li")]
    assert badges == [f"{done} done", f"{CASES - done} failed"], badges
    driver.save_screenshot(str(screenshot))

    # with the mouse, as a person would: half of the first axis, then of the second
    canvas = driver.find_element(By.CSS_SELECTOR, "#parallel canvas")
    left, top = -canvas.size["width"] / 2, -canvas.size["height"] / 2
    axes = driver.execute_script("return document.querySelectorAll('#x option').length")
    step = (canvas.size["width"] - 130) / (axes - 1)

    def drag(axis, start, end):
        x = round(left + 40 + axis * step)
        mouse = ActionChains(driver).move_to_element_with_offset(canvas, x, round(top + start)).click_and_hold()
        mouse.move_to_element_with_offset(canvas, x, round(top + end)).release().perform()

    drag(0, 105, 256)
    until("heavy cases are chosen", lambda: 0 < count("chosen") < CASES)
    heavy = count("chosen")
    assert 0.3 < heavy / CASES < 0.7, heavy
    drag(1, 105, 256)
    until("fewer cases fit both", lambda: 0 < count("chosen") < heavy)
    driver.find_element(By.ID, "all").click()
    until("all are shown again", lambda: count("chosen") == CASES)

    def first(column):
        return driver.find_element(By.CSS_SELECTOR, f"#cases tbody tr:first-child td:nth-child({column})").text

    heads = driver.find_elements(By.CSS_SELECTOR, "#cases th button")
    assert "peak_force" in heads[5].text and "kN" in heads[5].text, heads[5].text
    heads[5].click()
    least = float(first(6))
    heads[5].click()
    assert float(first(6)) > 10 * least, "the largest force comes first"
    link = driver.find_element(By.CSS_SELECTOR, "#cases a").get_attribute("href")
    assert link == (folder / "runs" / f"{int(first(1)):04}.mcap").resolve().as_uri(), link
    rows = len(driver.find_elements(By.CSS_SELECTOR, "#cases tbody tr"))
    assert rows < 100, "only rows in sight are drawn"
    driver.execute_script("const f = document.querySelector('#cases .wide'); f.scrollTop = f.scrollHeight")
    until("the last row has no force", lambda: driver.find_elements(By.CSS_SELECTOR, "#cases tbody tr")[-1].text.endswith("failed"))

    Select(driver.find_element(By.ID, "x")).select_by_visible_text("restitution")
    Select(driver.find_element(By.ID, "colour")).select_by_visible_text("none")
    driver.find_element(By.ID, "log-y").click()
    until("the points are drawn again", lambda: count("points") == done)
    plot = driver.find_element(By.CSS_SELECTOR, "#scatter canvas")
    for offset in range(0, 400, 8):
        ActionChains(driver).move_to_element_with_offset(plot, offset, 0).perform()
        if driver.find_element(By.ID, "point").text:
            break
    assert driver.find_element(By.ID, "point").text.startswith("case "), "a point says which case it is"

    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {"width": 400, "height": 1700, "deviceScaleFactor": 1, "mobile": False})
    assert driver.execute_script("return document.documentElement.scrollWidth <= 400"), "a narrow page does not scroll sideways"
    driver.save_screenshot(str(screenshot.with_name(screenshot.stem + "-narrow.png")))

    # two inputs on a grid are a map, with the line on which the largest stress is the strength
    map_folder = pathlib.Path("failure")
    map_folder.mkdir()
    with open(map_folder / "summary.csv", "w") as summary:
        print("case,target.thickness [m],impact.velocity [m/s],status,peak_force [N],tensile_ratio", file=summary)
        for case in range(42):
            thickness, speed = 1e-3 * (1 + case // 7), 2.0 * (1 + case % 7)
            print(f"{case + 1},{thickness},{speed},completed,{1e3 * speed},{speed / (4e3 * thickness)}", file=summary)
    subprocess.run([reader.resolve(), "report", map_folder], check=True)
    driver.set_window_size(1280, 1700)
    driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    driver.get(pathlib.Path("failure.html").resolve().as_uri())
    body = driver.find_element(By.TAG_NAME, "body")
    until("the map is drawn", lambda: body.get_attribute("data-ready") == "true")
    assert (count("cells"), count("points")) == (42, 42), "a cell for every case"
    assert count("pieces") >= 3, "the line where the ratio is 1 crosses speeds of 4 to 14 m/s"
    driver.save_screenshot(str(screenshot.with_name(screenshot.stem + "-map.png")))
    Select(driver.find_element(By.ID, "colour")).select_by_visible_text("peak_force [kN]")
    until("a force has no strength", lambda: (count("cells"), count("pieces")) == (42, 0))
    Select(driver.find_element(By.ID, "y")).select_by_visible_text("tensile_ratio")
    until("others are points", lambda: count("cells") == 0)
    log = driver.get_log("browser")
    assert not log, f"the console says {log}"
finally:
    driver.quit()
print(f"{page.name}: {CASES} cases, chosen along axes, sorted and linked; nothing on the console")
