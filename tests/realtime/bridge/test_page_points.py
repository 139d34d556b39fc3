"""The page of the bridge point by point: markup, styles and functions, as docs/range.md has them, without a browser."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import seatrial.realtime.bridge

REALTIME = Path(seatrial.realtime.bridge.__file__).parents[1]
STATIC = REALTIME / "bridge" / "static"
HTML = (STATIC / "index.html").read_text(encoding="utf-8")
CSS = (STATIC / "bridge.css").read_text(encoding="utf-8")
BASE = (REALTIME / "static" / "base.css").read_text(encoding="utf-8")
DOCS = Path(__file__).parents[3] / "docs" / "range.md"
NODE = shutil.which("node")
FINGER = 44.0


def header() -> str:
    return HTML[HTML.index("<header>") : HTML.index("</header>")]


def blocks(css: str, query: str = "") -> list[tuple[str, dict[str, str]]]:
    """Rules outside of media queries, or within those whose condition has `query`: selector and declarations."""
    css = re.sub(r"/\*.*?\*/", "", css, flags=re.DOTALL)
    inside, outer, media = list[str](), "", list[tuple[str, str]]()
    for part in re.split(r"(@media[^{]*\{)", css):
        if part.startswith("@media"):
            inside.append(part)
            continue
        if not inside:
            outer += part
            continue
        depth = 1 + np.cumsum([(c == "{") - (c == "}") for c in part])
        end = int(np.argmax(depth == 0))
        media.append((inside.pop(), part[:end]))
        outer += part[end + 1 :]
    text = outer if not query else "".join(body for about, body in media if query in about)
    return [(one.strip(), dict(tuple(map(str.strip, line.split(":", 1))) for line in body.split(";") if ":" in line))
            for one, body in re.findall(r"([^{}]+)\{([^{}]*)\}", text)]  # fmt: skip


def pixels(size: str) -> float:
    number = float(re.match(r"[\d.]+", size)[0])  # type: ignore[index]
    return number if size.endswith("px") or size == "0" else 16.0 * number


def run(script: str, *given: Any) -> Any:
    if NODE is None:
        pytest.skip("node is not on this machine")
    whole = f"globalThis.document = {{ getElementById: () => ({{}}) }};\n{script}"
    # modules of all pages are served below shared/
    source = (STATIC / "range.js").read_text(encoding="utf-8")
    source = source.replace("./shared/", f"{(REALTIME / 'static').as_uri()}/")
    said = [NODE, "--input-type=module", "-e", f"{source}\n{whole}", *map(json.dumps, given)]
    done = subprocess.run(said, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_alarms_who_steers_and_take_over_are_in_the_header() -> None:
    """With count and worst alarm, and words for a reader of the screen; the list itself may be below the fold."""
    for name in ("badge", "count", "worst", "who", "over"):
        assert f'id="{name}"' in header(), name
    assert re.search(r'<button id="over"[^>]*>Take over</button>', header())
    assert 'id="alarms" role="alert"' in HTML[HTML.index("</header>") :]


def test_the_header_stays_on_screen_at_every_size() -> None:
    """The body is a column as high as the screen whose main part scrolls; on a phone the header sticks."""
    base = dict(blocks(BASE))
    assert base["html, body"]["height"] == "100%"
    assert base["body"]["flex-direction"] == "column"
    assert dict(blocks(CSS))["main"]["min-height"] == "0"
    narrow = dict(blocks(CSS, "max-width: 700px"))
    assert (narrow["header"]["position"], narrow["header"]["top"]) == ("sticky", "0")
    assert narrow[".watch"]["flex"] == "1 0 100%"
    hidden = [one for one, body in blocks(CSS) + blocks(CSS, "max-") if body.get("display") == "none"]
    assert not [one for one in hidden if re.search(r"#(badge|count|worst|who|over)\b|\.watch", one)]


def test_what_is_wrong_and_who_steers_are_read_whole() -> None:
    """In two lines where one is too short, and with room for them; what is of no use then makes room."""
    narrow = {one: body for one, body in blocks(CSS, "max-width: 1150px") if "#who" in one}
    two = narrow["#who, #badge span"]
    assert two["white-space"] == "normal"
    lines = float(two["max-height"].removesuffix("em")) / float(two["line-height"])
    assert 2.0 < lines < 3.0
    assert float(narrow["#who"]["min-width"].removesuffix("rem")) >= 5.0
    gone = [one for one, body in blocks(CSS, "max-width: 1150px") if body.get("display") == "none" and ":has" in one]
    assert all(":disabled" in one for one in gone)  # never what would do something


def test_what_is_touched_is_44_pixels_under_a_finger() -> None:
    """Every rule that makes a button, a choice or a field lower elsewhere is taken back for a coarse pointer."""
    coarse = blocks(CSS, "pointer: coarse")
    assert CSS.rindex("@media") == CSS.index("@media (pointer: coarse)")  # the last word
    high = " ".join(one for one, body in coarse if pixels(body.get("min-height", "0")) >= FINGER)
    wide = " ".join(one for one, body in coarse if pixels(body.get("min-width", "0")) >= FINGER)
    for what in ("button", "select", "summary", "input"):
        assert re.search(rf"(?<![\w.#-]){what}\b", high), what
        assert re.search(rf"(?<![\w.#-]){what}\b", wide), what
    low = [one for css in (BASE, CSS) for query in ("", "max-width", "max-height")
           for one, body in blocks(css, query) if pixels(body.get("min-height", "99px")) < FINGER
           and re.search(r"button|select|input", one)]  # fmt: skip
    assert low
    for one in low:
        place = re.match(r"[#.]?[\w-]+", one)[0]  # type: ignore[index]
        assert place in high, one
    # a mark of a scale is not touched: its bar is
    assert [body for one, body in coarse if one == ".mark"] == [{"pointer-events": "none"}]


def test_nothing_is_shown_as_true_before_the_first_data() -> None:
    assert '<body class="waiting">' in HTML
    rule = next(one for one, body in blocks(CSS) if body.get("visibility") == "hidden")
    assert all(part in rule for part in (".waiting", "main", "#clock", "#watch"))
    assert '<output id="clock" aria-label="simulated time">–</output>' in HTML
    main = (STATIC / "main.js").read_text(encoding="utf-8")
    hello, picture = (main.index(f'addEventListener("{name}"') for name in ("hello", "picture"))
    assert hello < main.index('classList.add("waiting")') < picture < main.index('classList.remove("waiting")')


def test_every_column_of_numbers_has_its_unit() -> None:
    assert re.findall(r"<th[^>]*>([^<]+)</th>", HTML) == [
        "name", "Dist NM", "Brg °T", "SOG kn", "COG °T", "CPA NM", "TCPA min",
    ]  # fmt: skip


ALARMS = [
    [10031, 1, "W", "V", "OFF TRACK", 90.0], [10001, 2, "A", "A", "CPA 02", 95.0], [10001, 1, "A", "V", "CPA 01", 50.0],
    [10001, 3, "A", "V", "CPA 03", 60.0], [10012, 1, "W", "U", "POSITION LOST", 99.0], [1, 1, "C", "V", "DATUM", 99.0],
]  # fmt: skip


@pytest.mark.slow
def test_the_worst_alarm_is_unacknowledged_then_of_highest_priority_then_the_latest() -> None:
    script = "const a = JSON.parse(process.argv[1]), names = urgent(a).map(one => one[4]);"
    found = run(f"{script} console.log(JSON.stringify([names, badge(a), badge([]), a[0][4]]))", ALARMS)
    assert found[0] == ["CPA 03", "CPA 01", "OFF TRACK", "DATUM", "POSITION LOST", "CPA 02"]
    assert found[1] == {"count": 6, "text": "Alarm: CPA 03", "priority": "A", "state": "V"}
    assert found[2] == {"count": 0, "text": "No alarm", "priority": "", "state": ""}
    assert found[3] == "OFF TRACK"  # what came in is left as it is


@pytest.mark.slow
def test_other_ships_come_by_their_danger_then_by_their_nearest_approach_ahead() -> None:
    rows = [["past", 100, 0, 5, 0, 10, -60, False], ["far", 9000, 0, 5, 0, 4000, 600, False],
            ["near", 8000, 0, 5, 0, 300, 900, False], ["danger", 5000, 0, 5, 0, 500, 300, True]]  # fmt: skip
    found = run("console.log(JSON.stringify(nearest(JSON.parse(process.argv[1])).map(one => one[0])))", rows)
    assert found == ["danger", "near", "far", "past"]


def test_old_data_are_grey_and_a_lost_line_is_said_in_words() -> None:
    old = next(body for one, body in blocks(CSS) if ".old main" in one)
    assert "grayscale(1)" in old["filter"]
    assert "No contact for" in (STATIC / "panel.js").read_text(encoding="utf-8")


def test_four_palettes_and_a_dimmer_are_in_the_header() -> None:
    assert 'id="palette"' in header()
    assert 'id="light"' in header()
    themes = {name for one, _ in blocks(BASE) for name in re.findall(r'data-theme="(\w+)"', one)}
    assert themes == {"bright", "day", "dusk", "night"}


def test_what_the_buttons_do_has_a_key() -> None:
    main = (STATIC / "main.js").read_text(encoding="utf-8")
    keys = main[main.index("const KEYS") : main.index("];", main.index("const KEYS"))]
    for key in "TAGHPOCRVWEND":
        assert f'"{key}"' in keys, key


def test_each_point_of_the_table_names_a_test_that_is_here() -> None:
    text = DOCS.read_text(encoding="utf-8")
    table = text[text.index("## The page against IEC 62288 and OpenBridge") :]
    named = set(re.findall(r"`(test_\w+)`", table))
    here = {name for name in globals() if name.startswith("test_")}
    others = {name for path in Path(__file__).parents[1].rglob("test_*.py")
              for name in re.findall(r"^def (test_\w+)", path.read_text(encoding="utf-8"), re.MULTILINE)}  # fmt: skip
    assert len(named) >= 12
    assert named <= here | others
    assert here - {"test_each_point_of_the_table_names_a_test_that_is_here"} <= named
