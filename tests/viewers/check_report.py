"""Opens the report of a recording in headless Chromium, moves its slider and reads what the page shows.

    check_report.py REPORT.html SCREENSHOT.png

Needs the PyPI package selenium and Debian's packages chromium and chromium-driver. The screenshot is for people.
"""

import pathlib
import sys

from selenium import webdriver
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.support.ui import WebDriverWait

page, screenshot = map(pathlib.Path, sys.argv[1:])
text = page.read_text()
for outside in ["http://", "https://", "//cdn", "@import", "url("]:
    # the name space of SVG is a name, not an address that is asked for anything; url(#…) is a place on the page
    assert outside not in text.replace("http://www.w3.org/2000/svg", "").replace("url(#", ""), f"the page mentions {outside}"

options = webdriver.ChromeOptions()
for option in [
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--window-size=1300,1700",
]:
    options.add_argument(option)
options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
driver = webdriver.Chrome(options=options, service=Service("/usr/bin/chromedriver"))
try:
    driver.get(page.resolve().as_uri())
    assert driver.find_element(By.TAG_NAME, "body").get_attribute("data-ready") == "true", "the script came to its end"

    def state():
        """What is drawn: time, profile, field, values in the legends."""
        profile = driver.find_element(By.CSS_SELECTOR, "#profile .curve").get_attribute("d")
        field = driver.execute_script("return document.querySelector('#field canvas').toDataURL()")
        drag = driver.find_element(By.CSS_SELECTOR, "#chart-drag .legend span").text
        return driver.find_element(By.ID, "now").text, profile, field, drag

    def move(thousandths):
        driver.execute_script(
            "const s = document.getElementById('time'); s.value = Math.round(arguments[0] * s.max / 1000);"
            "s.dispatchEvent(new Event('input', { bubbles: true }));", thousandths)
        return state()

    begin, middle, end = move(0), move(500), move(1000)
    for a, b in [(begin, middle), (middle, end)]:
        assert all(x != y for x, y in zip(a, b)), "the slider moves everything"
    assert begin[0] == "t = 0", begin[0]
    assert all(len(profile) > 100 for _, profile, _, _ in (begin, middle, end))
    assert float(end[3]) > float(middle[3]) > 0, "the drag grows"

    # with the keyboard and the button, as a person would
    slider = driver.find_element(By.ID, "time")
    slider.send_keys("\ue012")  # arrow left
    assert state()[0] != end[0], "arrow keys move the slider"
    keys = webdriver.ActionChains(driver)

    def frame():
        return int(slider.get_attribute("value"))

    driver.execute_script("document.activeElement.blur()")
    move(500)
    there = frame()
    keys.send_keys("\ue014").perform()  # arrow right, with nothing focused
    assert frame() == there + 1, "arrow keys step by one frame"
    keys.send_keys(" ").perform()
    WebDriverWait(driver, 5).until(lambda _: frame() > there + 3)
    keys.send_keys(" ").perform()
    assert driver.find_element(By.ID, "play").text == "play", "space plays and stops"
    assert "frame" in slider.get_attribute("aria-valuetext") and slider.get_attribute("aria-label")
    move(100)
    driver.find_element(By.ID, "play").click()
    driver.implicitly_wait(1)
    WebDriverWait(driver, 5).until(lambda _: float(state()[0][4:]) > 1.0)
    driver.find_element(By.ID, "play").click()
    stopped = state()
    assert stopped[1] != begin[1], "it plays"

    badges = [badge.text for badge in driver.find_elements(By.CSS_SELECTOR, "#verdict li")]
    assert any(badge.startswith("completed") for badge in badges) and "recording sound" in badges, badges
    assert any(badge.startswith("warning: ") and "sharp edge" in badge for badge in badges), badges
    for id in ["results", "run", "ledger"]:
        assert len(driver.find_elements(By.CSS_SELECTOR, f"#{id} tr")) > 3, id
    assert "Largest pressure" in driver.find_element(By.ID, "results").text
    assert "largest_pressure.r = " in driver.find_element(By.ID, "records").get_attribute("textContent")
    assert not driver.find_element(By.ID, "records").is_displayed(), "raw metadata are folded away"

    # the section at equal scales, the indenter and the contact on it
    move(500)
    for part in ["body", "contact"]:
        assert driver.find_element(By.CSS_SELECTOR, f"#field .{part}").get_attribute("d"), part

    def proportions():
        return driver.execute_script(
            "const c = document.querySelector('#field .section canvas'), b = c.getBoundingClientRect();"
            "return (b.width / b.height) / (c.width / c.height);")

    def overlaps():
        """Pairs of labels of a chart or of the section that lie on each other."""
        return driver.execute_script("""
            const found = [];
            for (const svg of document.querySelectorAll("svg")) {
                const boxes = [...svg.querySelectorAll("text")].map((t) => [t.textContent, t.getBoundingClientRect()]);
                boxes.forEach(([a, p], i) => boxes.slice(i + 1).forEach(([b, q]) => {
                    if (p.left < q.right && q.left < p.right && p.top + 2 < q.bottom && q.top + 2 < p.bottom) found.push([a, b]);
                }));
            }
            return found;""")

    for width in [360, 800, 1400]:
        driver.execute_cdp_cmd(
            "Emulation.setDeviceMetricsOverride", {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500})
        driver.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
        assert driver.execute_script("return document.documentElement.scrollWidth") <= width, f"no sideways scrolling at {width}"
        assert not overlaps(), f"labels at {width}: {overlaps()}"
        assert abs(proportions() - 1) < 0.02, f"equal scales at {width}: {proportions()}"
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert not driver.find_element(By.ID, "time").is_displayed() and not driver.find_element(By.ID, "records").is_displayed()
    assert driver.find_element(By.CSS_SELECTOR, "#field canvas").is_displayed(), "a still frame"
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    assert "shear_wave_speed" in driver.find_element(By.ID, "case").get_attribute("textContent")
    charts = [chart.get_attribute("id") for chart in driver.find_elements(By.CSS_SELECTOR, "#charts figure")]
    assert charts == ["chart-drag", "chart-velocity", "chart-probes", "chart-energy"], charts

    move(420)
    driver.save_screenshot(str(screenshot))
    assert screenshot.stat().st_size > 50_000, "a picture with something in it"
    log = driver.get_log("browser")
    assert not log, f"the console says {log}"
finally:
    driver.quit()
print(f"{page.name}: the slider moves profile, field and values; {len(charts)} charts; nothing on the console")
