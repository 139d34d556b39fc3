"""Velocity vectors of the chart: one time for all ships, chosen on the page; where each ends by dead reckoning."""

from __future__ import annotations

import json
import math
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from bridges import Running

import seatrial.realtime.bridge
from browser import CHROMIUM, Browser

STATIC = Path(seatrial.realtime.bridge.__file__).with_name("static")
NODE = shutil.which("node")

SCRIPT = """
globalThis.Option = class { constructor(text, value) { this.text = text; this.value = value; } };
const { TIMES, Vectors, lasting, reach, usual } = await import(process.argv[1]);
const given = JSON.parse(process.argv[2]), menu = { replaceChildren(...all) { this.all = all; }, blur() {} };
const vectors = new Vectors(menu), begun = [];
for (const [L, U] of given.ships) { vectors.begin({ L }, U); begun.push(vectors.time); }
const turned = given.turns.map(way => { vectors.turn(way); return vectors.time; });
vectors.begin({ L: 1 }, 1);
console.log(JSON.stringify({ TIMES, begun, turned, after: vectors.time, texts: menu.all.map(one => one.text),
  reached: given.poses.map(([pose, t]) => reach(pose, t)) }));
"""


@pytest.fixture(scope="module")
def page() -> dict[str, Any]:
    if NODE is None:
        pytest.skip("node is not on this machine")
    asked = {"ships": [[320.0, 7.97], [2.0, 1.5], [150.0, 8.0], [400.0, 0.01], [0.5, 9.0]],
             "turns": [1, -1, -1, *[-1] * 20, *[1] * 30, -1],
             "poses": [[[10.0, 20.0, psi, u, v, 0.0], t] for psi in (0.0, 0.7, 3.9) for u, v in ((3.0, 0.0), (-2.0, .5))
                       for t in (6.0, 900.0)]}  # fmt: skip
    command = [NODE, "--input-type=module", "-e", SCRIPT, (STATIC / "vectors.js").as_uri(), json.dumps(asked)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return {**json.loads(done.stdout), "asked": asked}


@pytest.mark.slow
def test_the_usual_time_is_the_first_in_which_the_ship_goes_four_lengths(page):
    assert page["TIMES"] == sorted(page["TIMES"])
    for (L, U), time in zip(page["asked"]["ships"], page["begun"], strict=True):
        wanted = 4.0 * L / U
        assert time >= wanted or time == page["TIMES"][-1]
        assert all(shorter < wanted for shorter in page["TIMES"] if shorter < time)


@pytest.mark.slow
def test_a_chosen_time_stays_and_ends_at_the_shortest_and_the_longest(page):
    times, turned = page["TIMES"], page["turned"]
    k, expected = times.index(page["begun"][-1]), []
    for way in page["asked"]["turns"]:
        k = min(max(k + way, 0), len(times) - 1)
        expected.append(times[k])
    assert turned == expected
    assert page["after"] == turned[-1]  # another ship does not change what was chosen
    assert dict(zip(times, page["texts"], strict=True))[6] == "6 s"
    assert dict(zip(times, page["texts"], strict=True))[360] == "6 min"


@pytest.mark.slow
def test_a_vector_ends_where_a_ship_of_constant_velocity_is(page):
    for ((x, y, psi, u, v, _), t), end in zip(page["asked"]["poses"], page["reached"], strict=True):
        way = complex(u, v) * t * complex(math.cos(psi), math.sin(psi))  # north + i east
        assert complex(*end) == pytest.approx(complex(x, y) + way)


@pytest.mark.long
@pytest.mark.skipif(CHROMIUM is None, reason="no browser on this machine")
def test_the_page_has_one_time_for_all_ships_and_the_menu_and_the_key_set_it(tmp_path):
    pytest.importorskip("fastapi")
    (tmp_path / "out").mkdir()
    running = Running(tmp_path / "out", "--other", "mariner@3000,2000,270", ship="kvlcc2")
    try:
        with Browser(tmp_path / "browser") as browser:
            browser.open(f"http://127.0.0.1:{running.port}/")
            browser.until("globalThis.seatrial?.drawn > 3")
            told = "[seatrial.chart.vectors.time, document.getElementById('vectors').value]"
            assert browser.says(told) == [180, "180"]
            browser.key("v", 86)
            assert browser.says(told) == [360, "360"]
            browser.key("w", 87)
            browser.key("w", 87)
            assert browser.says(told) == [120, "120"]
            browser.says("document.getElementById('vectors').value = '900'")
            assert browser.says("seatrial.chart.vectors.time") == 900
            assert browser.errors == []
    finally:
        running.close()
