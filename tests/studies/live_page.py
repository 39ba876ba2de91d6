"""The live page in a browser: a server in a process of its own, and a browser that reaches this machine alone."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.studies.command import ROOT, command

BROWSER, DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
STUDY = """
import tolalloc as ta

def gap(housing, shaft, shim):
    return housing - shaft - shim

SHIM = ta.Setting(name="shim [mm]", value=0.01, lower=0.0, upper=0.05, step=0.001)
ZONE = {"plus": 0.02, "minus": -0.02, "unit": "mm", "min": 0.005, "max": 0.1, "cost": 2}
study = ta.Study(
    ta.model(gap, inputs=("housing", "shaft"), outputs=("gap [mm]",), settings=(SHIM,)),
    ta.Drawing.of_rows([{"id": "housing", "nominal": 30.1, **ZONE}, {"id": "shaft", "nominal": 30.0, **ZONE}]),
    limits={"gap [mm]": ta.Limit(lower=0.07, upper=0.11, show=ta.AtYield(target=0.98))},
    name="fit",
    seed=3,
)
"""
"""A study of a user's own function with two zones and a setting."""


class OpenStudy:
    """A study that ``tolalloc open`` serves; it can be killed and started again."""

    def __init__(self, script: Path) -> None:
        self.script = script
        self.start()

    def start(self) -> None:
        """Start the command, and wait for the address that it says."""
        words = command("open", self.script, "--no-browser")
        kept = {"cwd": ROOT, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL, "text": True}
        self.process = subprocess.Popen(words, env=dict(os.environ), **kept)
        self.address = self.process.stdout.readline().split()[-1]

    def kill(self) -> None:
        """End it without a word."""
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


def browser() -> Any:
    """Return a browser without a window, which finds no machine but this one."""
    from selenium.webdriver import Chrome
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service

    options = Options()
    options.binary_location = BROWSER
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    for argument in (
        "--headless=new",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--window-size=1400,1000",
        "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
    ):
        options.add_argument(argument)
    driver = Chrome(options=options, service=Service(DRIVER))
    driver.set_script_timeout(300)
    return driver


def until(true: Callable[[], Any], seconds: float = 120.0) -> Any:
    """Wait until something is true, on a busy machine that compiles too, and return it."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if found := true():
            return found
        time.sleep(0.02)
    raise AssertionError("it did not become true")


def width(driver: Any, pixels: int, dark: bool = False) -> None:
    """Show the page as wide as this, light or dark."""
    size = {"width": pixels, "height": 1000, "deviceScaleFactor": 1, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [scheme]})


MOVE = """
const [moves, seed, done] = arguments, answer = document.getElementById("answer");
let state = seed;
const random = () => ((state = (state * 1103515245 + 12345) % 2147483648) / 2147483648);
const shown = (key, turn) => new Promise((found) => {
  const look = () => Number(answer.dataset[key]) >= turn && (watch.disconnect(), found(performance.now()));
  const watch = new MutationObserver(look);
  watch.observe(answer, { attributes: true });
  look();
});
(async () => {
  const drawn = [], judged = [], sliders = [...document.querySelectorAll(".row input[type=range]:not(:disabled)")];
  for (let move = 0; move < moves; move++) {
    const slider = sliders[Math.floor(random() * sliders.length)];
    const low = Number(slider.min), high = Number(slider.max), turn = Number(answer.dataset.drawn) + 1;
    const from = performance.now();
    slider.value = low + random() * (high - low);
    slider.dispatchEvent(new Event("input", { bubbles: true }));
    drawn.push((await shown("drawn", turn)) - from);
    judged.push((await shown("judged", turn)) - from);
    slider.dispatchEvent(new Event("change", { bubbles: true }));
    await shown("drawn", turn + 1);
    await shown("judged", turn + 1);
  }
  done([drawn, judged]);
})();
"""
"""Moves sliders at random, and returns how long cost and curve, and the yield, of each took [ms]."""

CONTRASTS = """
const light = (colour) => {
  const [r, g, b] = colour.map((c) => (c /= 255) <= 0.03928 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
};
const read = (text) => text.match(/[\\d.]+/g).map(Number);
const behind = (own) => {
  for (; own; own = own.parentElement) {
    const [r, g, b, a = 1] = read(getComputedStyle(own).backgroundColor);
    if (a > 0.5) return [r, g, b];
  }
  return [255, 255, 255];
};
const found = [];
for (const own of document.querySelectorAll("body *")) {
  const said = [...own.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim());
  if (!said || !own.checkVisibility() || own.disabled || own.closest(".mechanism, script, .stale")) continue;
  const style = getComputedStyle(own), ink = read(own instanceof SVGElement ? style.fill : style.color).slice(0, 3);
  const [one, other] = [light(ink), light(behind(own))].sort((a, b) => b - a);
  const contrast = (one + 0.05) / (other + 0.05);
  if (contrast < 4.5) found.push(`${own.tagName} ${own.textContent.trim().slice(0, 30)} ${contrast.toFixed(2)}`);
}
return found;
"""
"""Returns the texts whose contrast with what is behind them is below 4.5, as WCAG 2 counts it."""

CUT = """
const wide = document.documentElement.clientWidth, found = [];
if (document.documentElement.scrollWidth > wide) found.push(`the page is ${document.documentElement.scrollWidth} wide`);
for (const own of document.querySelectorAll("body *")) {
  if (!own.checkVisibility() || own.closest(".wide, .mechanism svg, .chart svg")) continue;
  const box = own.getBoundingClientRect();
  const said = `${own.tagName} ${own.id} ${own.textContent.slice(0, 40)}`;
  if (box.width && (box.right > wide + 1 || box.left < -1)) found.push(`${said} ${box.left} ${box.right}`);
  const holds = own.matches("button, dd, dt, h1, h2, p, label") && own.clientWidth;
  if (holds && own.scrollWidth > own.clientWidth + 1) found.push(said);
}
for (const text of document.querySelectorAll(".chart svg text")) {
  const box = text.getBoundingClientRect(), frame = text.ownerSVGElement.getBoundingClientRect();
  if (box.width && (box.left < frame.left - 1 || box.right > frame.right + 1)) found.push(`chart: ${text.textContent}`);
}
return found;
"""
"""Returns what stands beyond the edge of the page, of its own box or of its chart."""
