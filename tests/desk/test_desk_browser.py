"""The page in a browser: from dropped logs to a report by keyboard alone, and on screens of every size."""

from __future__ import annotations

import asyncio
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("fastapi")
from browser import CHROMIUM, Browser
from seatrial.data.trialfile import write_trials
from seatrial.desk.app import desk
from seatrial.desk.jobs import Jobs
from seatrial.manoeuvres.turning import Turning
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.realtime import pages
from seatrial.ships.files import load
from seatrial.simulate.run import approach, simulate

pytestmark = [pytest.mark.long, pytest.mark.skipif(CHROMIUM is None, reason="no browser on this machine")]

SIZES = ((390, 844), (768, 1024), (1024, 768), (1440, 900), (1920, 1080), (3840, 2160))
TAB, ENTER = ("Tab", 9), ("Enter", 13)


def logs() -> list[tuple[str, str]]:
    """Logs of four manoeuvres as tables in the units of a ship's crew, with noise."""
    ship, rng, found = load("kvlcc2_l7"), np.random.default_rng(8), []
    _, n_P = approach(ship)
    runs = [Zigzag(n_P, np.radians(a), np.radians(a)) for a in (10, 20, 15)] + [Turning(n_P, np.radians(25.0))]
    for k, policy in enumerate(runs):
        run = simulate(ship, policy, duration=120.0, dt=0.05, every=8, name=f"run{k}")
        size = len(run.t)
        columns = {
            "Time [s]": run.t, "North [m]": run["x"] + rng.normal(0.0, 0.02, size),
            "East [m]": run["y"] + rng.normal(0.0, 0.02, size),
            "Heading [deg]": np.degrees(run["psi"]) % 360.0 + rng.normal(0.0, 0.1, size),
            "Surge [m/s]": run["u"] + rng.normal(0.0, 0.005, size),
            "Sway [m/s]": run["v_m"] + rng.normal(0.0, 0.005, size),
            "Yaw rate [deg/s]": np.degrees(run["r"]) + rng.normal(0.0, 0.05, size),
            "Rudder [deg]": np.degrees(run["delta"]), "Shaft [1/s]": run["n_P"],
        }  # fmt: skip
        rows = [",".join(columns), *(",".join(f"{v:.4f}" for v in row) for row in zip(*columns.values(), strict=True))]
        found.append((f"run{k}.csv", "\n".join(rows) + "\n"))
    return found


@contextmanager
def served(folder: Path) -> Iterator[str]:
    jobs = Jobs(folder)
    serving = pages.server(desk(folder, jobs, "key"))
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen(64)
        thread = threading.Thread(target=lambda: asyncio.run(pages.attend(serving, listening)))
        thread.start()
        try:
            yield f"http://127.0.0.1:{listening.getsockname()[1]}/?key=key"
        finally:
            serving.should_exit = True
            thread.join(10.0)
            jobs.close()


def drop(browser: Browser, files: list[tuple[str, str]]) -> None:
    """Files as the mouse drops them on the page."""
    browser.says(
        f"(() => {{ const d = new DataTransfer(), files = {json.dumps(files)};"
        "for (const [name, text] of files) d.items.add(new File([text], name));"
        "dispatchEvent(new DragEvent('drop', { dataTransfer: d, cancelable: true })); })()"
    )


def tab_to(browser: Browser, words: str) -> None:
    """Press Tab until an element of these words has the focus, as who has no mouse does."""
    for _ in range(150):
        browser.key(*TAB)
        if words in browser.says("(e => e.matches('button, summary') ? e.innerText : '')(document.activeElement)"):
            return
    raise AssertionError(f"Tab never comes to {words}")


def press(browser: Browser, words: str) -> None:
    tab_to(browser, words)
    browser.key(*ENTER, "\r")


def choose(browser: Browser, value: str) -> None:
    """The entry of the menu that has the focus: its list is drawn by the system, whose keys no page sees."""
    assert browser.says("document.activeElement.tagName") == "SELECT"
    browser.says(f"document.activeElement.value = {json.dumps(value)};"
                 "document.activeElement.dispatchEvent(new Event('input', { bubbles: true }))")  # fmt: skip
    assert browser.says("document.activeElement.value") == value


def done(browser: Browser, command: str) -> str:
    """Wait until the last command, which must be this one, is done; what it said."""
    first = "document.querySelector('#jobs .job')"
    browser.until(f"{first}?.querySelector('code').textContent.startsWith({json.dumps(command)})", 30.0)
    browser.until(f"{first}.querySelector('.state').textContent !== 'running'", 180.0)
    assert browser.says(f"{first}.querySelector('.state').textContent") == "done", browser.says(f"{first}.innerText")
    return str(browser.says(f"{first}.querySelector('pre').textContent"))


def test_from_dropped_logs_to_a_report_by_keyboard_alone(tmp_path: Path) -> None:
    folder = tmp_path / "my ship"
    folder.mkdir()
    with served(folder) as url, Browser(tmp_path / "browser", 1440, 900) as browser:
        browser.open(url)
        browser.until("document.getElementById('next')?.innerText.includes('Drop the logs')")
        assert browser.says("document.querySelector('#view h1').innerText") == "From logs to a model"
        drop(browser, logs())
        browser.until("document.querySelector('#next button')?.innerText === 'import the logs'")
        press(browser, "import the logs")
        press(browser, "Run")
        assert "0 doubts" in done(browser, "seatrial import --guess")
        browser.until("document.getElementById('items').innerText.includes('mapping.toml')")
        # the mapping is chosen in the form that is open, and the next one would have another name
        taken = "[...document.querySelectorAll('#view input')].map(one => one.value)"
        browser.until(f"{taken}.includes('mapping-2.toml')")
        press(browser, "Import")
        browser.until("document.activeElement.tagName === 'SUMMARY' && document.activeElement.parentElement.open")
        browser.key(*TAB)
        browser.key(*TAB)
        assert browser.says("document.activeElement.value") == "mapping.toml"
        press(browser, "Run")
        assert "4 trials in trials" in done(browser, "seatrial import csv logs --mapping mapping.toml -o trials")
        browser.until("document.querySelector('#next button')?.innerText === 'a ship for these trials'", 30.0)
        press(browser, "a ship for these trials")
        browser.until("document.querySelector('#view h1').innerText === 'A ship for these trials'")
        browser.key(*TAB)
        browser.key(*TAB)
        choose(browser, "kvlcc2_l7")
        browser.until("document.querySelector('#view .command').textContent.includes('copy kvlcc2_l7')")
        press(browser, "Run")
        done(browser, "seatrial copy kvlcc2_l7 ship.toml")
        browser.until("document.querySelector('#next button')?.innerText === 'write a study'", 30.0)
        press(browser, "write a study")
        press(browser, "Run")
        done(browser, "seatrial study new ship.toml trials")
        browser.until("document.querySelector('#next button')?.innerText === 'fit'", 30.0)
        press(browser, "fit")
        press(browser, "Run")
        assert "Error after" in done(browser, "seatrial identify study.toml -o run")
        browser.until("document.querySelector('#next button')?.innerText === 'read the report of the fit'", 30.0)
        press(browser, "read the report")
        browser.until("[...document.querySelectorAll('#view a')].some(a => a.innerText === 'Open report.html')")
        assert (folder / "run" / "report.html").exists()
        assert not browser.errors
        assert all(one.startswith(("http://127.0.0.1", "data:", "about:")) for one in browser.requests)
        browser.open(url.partition("?")[0] + "files/run/report.html")
        browser.until("document.body?.innerText.includes('Growth of the error')")


def test_a_stretch_is_cut_by_the_mouse_and_nothing_runs_over_on_any_screen(tmp_path: Path) -> None:
    folder = tmp_path / "ship"
    (folder / "trials").mkdir(parents=True)
    ship = load("kvlcc2_l7")
    zigzag = Zigzag(approach(ship)[1], 0.35, 0.35)
    write_trials((simulate(ship, zigzag, duration=100, dt=0.1, name="a"),), folder / "trials")
    with served(folder) as url, Browser(tmp_path / "browser", 1440, 900) as browser:
        browser.open(url)
        browser.until("document.querySelector('#items button')")
        browser.says("document.querySelector('#items button').click()")
        browser.until("document.querySelectorAll('.plots svg').length === 2")
        traces = "document.querySelectorAll('.plots svg')[1]"
        browser.says(f"{traces}.scrollIntoView()")
        box = browser.says(f"(b => [b.x, b.y, b.width])({traces}.getBoundingClientRect())")
        left, wide = box[0] + box[2] * 78 / 640, box[2] * 552 / 640  # the axis of time within the drawing
        for kind, share in (("mousePressed", 0.3), ("mouseMoved", 0.4), ("mouseMoved", 0.5), ("mouseReleased", 0.5)):
            browser.call("Input.dispatchMouseEvent", type=kind, x=left + share * wide, y=box[1] + 30.0, button="left",
                         buttons=1, clickCount=1)  # fmt: skip
        times = browser.says("[...document.querySelectorAll('#view .row input')].map(one => Number(one.value))")
        assert times == pytest.approx([30.0, 50.0], abs=0.5)
        browser.says("[...document.querySelectorAll('.row button')].find(b => b.innerText === 'Cut this out').click()")
        browser.says("[...document.querySelectorAll('.row button')].find(b => b.innerText.startsWith('Write')).click()")
        browser.until("document.querySelector('#view details[open] .command')?.textContent.includes('--by cuts.toml')")
        said = (folder / "cuts.toml").read_text()
        assert 'trials = ["a"]' in said
        for width, height in SIZES:
            browser.size(width, height)
            time.sleep(0.3)
            assert browser.says("document.documentElement.scrollWidth <= innerWidth"), width
            small = "[...document.querySelectorAll('#items button, #ship-new')].filter(b => b.offsetHeight < 44).length"
            assert browser.says(small) == 0
            browser.says("scrollTo(0, 0); document.querySelector('#view h1').remove()")
            browser.says("document.querySelector('#items button').click()")
            browser.until("document.querySelector('#view h1') && document.querySelectorAll('.plots svg').length === 2")
            top = browser.says("document.querySelector('#view h1').getBoundingClientRect().top")
            assert 0 <= top < height / 4, width  # what is chosen is seen, also below a long list
        assert not browser.errors
