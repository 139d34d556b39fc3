"""The page in a browser: what it draws, at every size, day and night, and after a reload."""

from __future__ import annotations

import math
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

pytest.importorskip("fastapi")
from browser import CHROMIUM, Browser
from seatrial.core.parameters import Free
from seatrial.identify import Problem
from seatrial.identify.watch import with_values
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime.fit_page.board import DONE, STATIC, Board, Part, Tracker
from seatrial.realtime.pages import Watched
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason="no browser on this machine")]

SHIP = load("kvlcc2_l7")
FREE = Free("rudder.t_R", 0.5, 0.1, 0.9), Free("hull.Y_v", -0.3, prior=-0.3, sigma=0.05)


@pytest.fixture
def served() -> Iterator[tuple[str, Board, ExitStack, Part]]:
    trial = simulate(SHIP, Zigzag(10.42, 0.35, 0.35), dt=0.5, duration=120.0, name="zigzag_20_20")
    board = Board("a run", {"one": Path("nowhere"), "two": Path("nowhere")})
    with socket.create_server(("127.0.0.1", 0)) as listening:
        part = board.begin("one", Problem(SHIP, (trial,), FREE), 60.0)
        with ExitStack() as page:
            page.enter_context(Watched(board, STATIC, listening))
            page.enter_context(Tracker(board))
            yield f"http://127.0.0.1:{listening.getsockname()[1]}/", board, page, part


def test_the_page_follows_the_fit(served: tuple[str, Board, ExitStack, Part], tmp_path: Path) -> None:
    url, board, page, part = served
    with Browser(tmp_path / "browser") as browser:
        browser.open(url)
        browser.until("globalThis.seatrial?.drawn > 0 && seatrial.last")
        assert browser.says("document.getElementById('none-yet').hidden") is False
        for k in range(1, 9):
            part.at(with_values(SHIP, FREE, [0.9 - 0.1 / k, -0.3 - 0.02 / k]))
            part(k, 1000.0 / k, 0.5 / k if k > 1 else math.nan)
        browser.until("seatrial.curves.rows.length === 8 && seatrial.tracks.predicted.length === 1")
        assert browser.says("document.getElementById('iteration').textContent") == "8"
        numbers = "[...document.querySelectorAll('.parameter .number')].map(one => one.textContent)"
        assert browser.says(numbers)[0].startswith("0.8875")
        assert browser.says("document.querySelectorAll('#parts li').length") == 2
        part.at(with_values(SHIP, FREE, [0.9, -0.9]))  # at a bound, and far outside its prior
        part(9, 100.0, 0.1)
        browser.until("document.querySelectorAll('.parameter.stuck').length === 1")
        places = "[...document.querySelectorAll('.rail .value')].map(one => parseFloat(one.style.left))"
        assert max(browser.says(places)) <= 100.0
        for _ in range(2):  # day, dusk, night
            browser.key("n", 78, "n")
        assert browser.says("document.documentElement.dataset.theme") == "night"
        browser.call("Page.reload")
        browser.until("globalThis.seatrial?.curves.rows.length === 9")
        assert browser.says("document.documentElement.dataset.theme") == "night"
        for width, height in ((1280, 800), (800, 1200), (390, 844)):
            browser.size(width, height, mobile=width < 500)
            assert browser.says("document.documentElement.scrollWidth <= innerWidth")
        board.end(DONE, "converged")
        page.close()
        browser.until("document.getElementById('notice').textContent.includes('The run has ended')")
        assert all(url.removeprefix("http") in request or request.startswith("data:") for request in
                   (one.replace("ws://", "http://").removesuffix("line") for one in browser.requests))  # fmt: skip
        assert not [error for error in browser.errors if "WebSocket" not in error]  # it looks for the fit again
