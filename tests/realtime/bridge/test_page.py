"""The page in a browser: how soon, how smooth, and which way the wheel turns the ship."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("fastapi")
from browser import CHROMIUM, Browser
from test_server import Running

pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason="no browser on this machine")]


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    made = Running(tmp_path)
    yield made
    made.close()


def test_the_page_is_quick_smooth_and_steers(running: Running, tmp_path: Path) -> None:
    with Browser(tmp_path / "browser") as browser:
        first: list[float] = []
        for _ in range(3):  # the best of three: a machine that works on something else delays one of them
            browser.open("about:blank")
            browser.open(f"http://127.0.0.1:{running.port}/")
            browser.until("globalThis.seatrial?.drawn > 0")
            first.append(browser.says("performance.getEntriesByName('first-contentful-paint')[0].startTime"))
        assert min(first) <= 1000.0

        count = "[seatrial.drawn, seatrial.link.pictures, performance.now() / 1000]"
        drawn_0, came_0, t_0 = browser.says(count)
        time.sleep(4.0)
        drawn, came, t = browser.says(count)
        assert (came - came_0) / (t - t_0) == pytest.approx(20.0, abs=1.0)
        assert (drawn - drawn_0) / (t - t_0) >= 50.0

        psi = browser.says("seatrial.link.last.own[2]")
        for _ in range(3):
            browser.key("ArrowRight", 39)
        browser.until("seatrial.link.last.ord.delta > 0.26")
        browser.until(f"seatrial.link.last.own[2] > {psi} + 0.05")
        browser.key(" ", 32, " ")
        browser.until("seatrial.link.last.ord.delta === 0")
        for _ in range(4):
            browser.key("ArrowLeft", 37)
        browser.until("seatrial.link.last.own[5] < -0.005", 30.0)
        browser.key("ArrowDown", 40)
        browser.until("seatrial.link.last.ord.n_P < 0.9 * seatrial.link.hello.orders[0].full")

        browser.call("Page.reload")
        browser.until("globalThis.seatrial?.drawn > 5 && seatrial.link.commands")
        assert browser.says("seatrial.link.hello.trail.length") > 3
        for width, height in ((390, 844), (1024, 768), (1280, 800)):
            browser.size(width, height)
            time.sleep(0.3)
            assert browser.says("document.documentElement.scrollWidth") <= width
            cut = "[...document.querySelectorAll('.cell span')].filter(e => e.scrollWidth > e.clientWidth).length"
            assert browser.says(cut) == 0
        assert browser.errors == []
        assert {url.split("/")[2] for url in browser.requests if "://" in url} == {f"127.0.0.1:{running.port}"}
