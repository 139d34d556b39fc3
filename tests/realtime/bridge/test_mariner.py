"""What a mariner does with the page in a browser: keys alone, the view, the chart, twenty ships, nothing cut off."""

from __future__ import annotations

import json
import math
import time
from pathlib import Path

import pytest

pytest.importorskip("fastapi")
from bridges import Running

from browser import CHROMIUM, Browser

pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason="no browser on this machine")]


def opened(browser: Browser, running: Running) -> None:
    browser.open(f"http://127.0.0.1:{running.port}/")
    browser.until("globalThis.seatrial?.drawn > 3 && seatrial.link.commands")


@pytest.fixture
def place(tmp_path: Path) -> Path:
    (tmp_path / "bridge").mkdir()
    return tmp_path / "bridge"


def test_keys_alone_hold_a_heading_turn_the_view_and_dim_the_page(place: Path, tmp_path: Path) -> None:
    running = Running(place)
    try:
        with Browser(tmp_path / "browser") as browser:
            opened(browser, running)
            browser.key("h", 72)
            browser.until("typeof seatrial.link.last.held === 'number'")
            held = browser.says("seatrial.link.last.held")
            for _ in range(3):
                browser.key(">", 190)
                time.sleep(0.2)
            turned = f"(seatrial.link.last.held - {held} + 7) % (2 * Math.PI)"
            browser.until(f"Math.abs(({turned}) - {(math.radians(30.0) + 7) % (2 * math.pi)}) < 0.02")
            browser.until(f"Math.sin(seatrial.link.last.own[2] - {held}) > 0.2", 60.0)  # to starboard
            browser.key("h", 72)
            browser.until("typeof seatrial.link.last.held !== 'number'")
            ups = [browser.says("seatrial.chart.view.up")]
            for _ in range(2):
                browser.key("o", 79)
                ups.append(browser.says("seatrial.chart.view.up"))
            assert sorted(ups) == ["course", "head", "north"]
            light = "['palette', 'light'].map(name => document.getElementById(name).value)"
            before = browser.says(light)
            browser.key("n", 78)
            browser.key("d", 68)
            after = browser.says(light)
            assert after[0] != before[0]
            assert float(after[1]) == pytest.approx(float(before[1]) - 0.1, abs=0.01)
            browser.key("?", 191)
            browser.until("document.getElementById('help').open")
            rows = browser.says("document.querySelectorAll('#help kbd').length")
            assert rows >= 20
    finally:
        running.close()


def test_a_place_and_its_pixel_are_inverse_whatever_is_up(place: Path, tmp_path: Path) -> None:
    running = Running(place)
    try:
        with Browser(tmp_path / "browser") as browser:
            opened(browser, running)
            told = browser.says("""(async () => {
                const { View } = await import('./view.js'), out = [];
                for (const up of ['north', 'head', 'course']) {
                    const view = new View(), own = [120, -40, 1.1, 5, 1, 0];
                    view.metre = 0.7; view.turn(up, own); view.fit(800, 500, own);
                    const [px, py] = view.at(200, 60), [x, y] = view.place(px, py);
                    const ahead = view.at(120 + 10 * Math.cos(1.1), -40 + 10 * Math.sin(1.1));
                    const starboard = view.at(120 - 10 * Math.sin(1.1), -40 + 10 * Math.cos(1.1));
                    out.push([x - 200, y - 60, ahead[0] - 400, ahead[1] - 250, starboard[0] - 400]);
                }
                return out;
            })()""")
            for dx, dy, *_ in told:
                assert abs(dx) < 1e-9
                assert abs(dy) < 1e-9
            _, head, course = told
            assert head[2] == pytest.approx(0.0, abs=1e-9), "head up: ahead is up"
            assert head[3] == pytest.approx(-7.0)
            assert head[4] == pytest.approx(7.0), "and starboard is to the right"
            assert course[2] == pytest.approx(-7.0 * math.sin(math.atan2(1, 5)), abs=1e-6), "drifting to starboard"
    finally:
        running.close()


@pytest.mark.parametrize("size", [(1280, 800), (1024, 768), (1920, 1080)])
def test_rudder_and_telegraph_are_on_the_screen(place: Path, tmp_path: Path, size: tuple[int, int]) -> None:
    running = Running(place)
    try:
        with Browser(tmp_path / "browser") as browser:
            browser.size(*size)
            opened(browser, running)
            inside = """(what => [...document.querySelectorAll(what)].filter(one => {
                const b = one.getBoundingClientRect(), x = b.x + b.width / 2, y = b.y + b.height / 2;
                const hit = document.elementFromPoint(x, y);
                return !(hit === one || one.contains(hit));
            }).map(one => one.textContent || one.className))"""
            covered = browser.says(f"{inside}('.bells button, header button:not([hidden]), #autopilot button')")
            assert covered == []
    finally:
        running.close()


def test_the_chart_that_is_brought_is_drawn_and_the_ship_feels_it(place: Path, tmp_path: Path) -> None:
    chart = tmp_path / "shoal.geojson"
    outline = [[-500, -300], [-500, 900], [500, 900], [500, -300]]
    features = [{"type": "Feature", "properties": {"kind": "depth", "depth": 0.5},
                 "geometry": {"type": "Polygon", "coordinates": [outline]}}]  # fmt: skip
    said = {"type": "FeatureCollection", "schema": "seatrial-chart/1", "name": "shoal", "frame": "metres",
            "source": "test", "features": features}  # fmt: skip
    chart.write_text(json.dumps(said), encoding="utf-8")
    running = Running(place, "--chart", str(chart))
    try:
        with Browser(tmp_path / "browser") as browser:
            opened(browser, running)
            assert browser.says("seatrial.link.hello.chart.areas.length") == 1
            browser.until("seatrial.link.last.depth === 0.5")
            browser.until("document.getElementById('conning').textContent.includes('0.5')")
    finally:
        running.close()


SIZES = ((390, 844), (768, 1024), (901, 768), (1024, 768), (1150, 768), (1440, 900), (1920, 1080), (3840, 2160))
WHOLE = """['badge', 'worst', 'who', 'over'].filter(id => {
    const e = document.getElementById(id), at = e.getBoundingClientRect();
    return at.left < -1 || at.top < -1 || at.right > innerWidth + 1 || at.bottom > innerHeight + 1
        || e.scrollWidth > e.clientWidth + 1 || e.scrollHeight > e.clientHeight + 2;
})"""


def test_alarms_who_steers_and_take_over_are_whole_on_screen_at_every_size(place: Path, tmp_path: Path) -> None:
    """With an alarm, and also for a bridge that has no command, whose header says more."""
    scenario = Path(__file__).parents[3] / "examples" / "range" / "crossing.toml"
    running = Running(place, "--scenario", str(scenario), "--factor", "20", ship="kvlcc2")
    try:
        with Browser(tmp_path / "one") as one, Browser(tmp_path / "two") as two:
            for browser in (one, two):
                browser.open(f"http://127.0.0.1:{running.port}/")
                browser.until("globalThis.seatrial?.drawn > 3")
                browser.until("document.getElementById('badge').dataset.worst === 'A'", 60.0)
                for width, height in SIZES:
                    browser.size(width, height)
                    browser.until("!document.getElementById('over').hidden")
                    time.sleep(0.5)
                    assert browser.says(f"JSON.stringify({WHOLE})") == "[]", width
                    assert browser.says("document.documentElement.scrollWidth") <= width
    finally:
        running.close()
