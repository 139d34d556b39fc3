"""Write the table of yardstick.md from the results of the yardstick (benchmarks/results/yardstick.json).

A row a method, a column a set: Eq. 25, and the errors of position [m] and heading [deg] at the longest horizon.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PAGE, DATA = HERE / "yardstick.md", HERE.parent / "benchmarks" / "results" / "yardstick.json"
BEGIN, END = "<!-- written by make_yardstick.py: begin -->", "<!-- end -->"
SETS = {"esso_osaka": "Esso Osaka", "blueboat": "BlueBoat", "milliampere": "milliAmpere", "kvlcc2_hsva": "HSVA",
        "kvlcc2_marin": "MARIN", "usv_asw": "catamaran", "virtual_kvlcc2": "simulated"}  # fmt: skip


def page() -> str:
    """The page with its table written anew."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    return f"{before}{BEGIN}\n{table()}{END}{rest.partition(END)[2]}"


def table() -> str:
    """The table: constant velocity first, methods of others as the file has them, studies and ships of ours last."""
    sets = {one["name"]: one for one in json.loads(DATA.read_text(encoding="utf-8"))["sets"]}
    found = {(_named(row["method"]), name): row for name, one in sets.items() for row in one["standings"]}
    rows = sorted(dict.fromkeys(method for method, _ in found), key=lambda method: _PLACE.get(method, 1))
    head = f"| method | {' | '.join(SETS.values())} |\n|{'---|' * (len(SETS) + 1)}\n"
    return head + "".join(
        f"| {method} | {' | '.join(_cell(found.get((method, name))) for name in SETS)} |\n" for method in rows
    )


_PLACE = {"constant velocity": 0, "a study of ours": 2, "`kvlcc2_l7` as it is": 3}


def _named(method: str) -> str:
    stem = Path(method).stem
    if method == "constant velocity":
        return method
    if method.endswith(".toml"):
        return "a study of ours"
    return f"`{stem}`" if method.endswith(".py") else f"`{stem}` as it is"


def _cell(row: dict[str, Any] | None) -> str:
    if row is None:
        return ""
    last = row["ahead"][-1]
    return f"{_short(row['eq25'])}; {_short(last['position'])}, {_short(math.degrees(last['heading']))}"


def _short(value: float | None) -> str:
    """Two digits, or as many as a whole number has."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.2g}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
