"""The judge of `seatrial requirements` on ships drawn by a seed, good and wrong, before anyone looked at one.

Wrong ships must be told with a word of the culprit's physics, good ones must be told nothing
(tests/validate/requirements/drawn_gallery.py; `--kept` takes the two galleries that are written down).

    python benchmarks/first_sight.py SEED... [--kept]

Writes results/first_sight.json after every ship; ships that are in it are not judged again.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from timing import machine

from seatrial.core.files import write_whole

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "benchmarks" / "results" / "first_sight.json"
sys.path.insert(0, str(ROOT / "tests" / "validate" / "requirements"))

import drawn_gallery  # noqa: E402  tests are no package
import gallery  # noqa: E402
import second_gallery  # noqa: E402
from gallery import Entry  # noqa: E402

Ships = tuple[str, bool, Iterable[Entry]]


def main() -> None:
    """Judge what is asked for and not in the results yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("seeds", type=int, nargs="*")
    parser.add_argument("--kept", action="store_true", help="judge the galleries that are written down too")
    asked = parser.parse_args()
    found: dict[str, Any] = json.loads(RESULTS.read_text()) if RESULTS.exists() else {"sets": {}}
    found |= {"what": "ships of a set, those judged rightly, and what was said of the others", "machine": machine()}
    for name, wrong, ships in (*(_kept() if asked.kept else ()), *_drawn(asked.seeds)):
        one = found["sets"].setdefault(name, {"judged": [], "right": 0, "others": {}, "seconds": 0.0})
        for entry in ships:
            if entry.name in one["judged"]:
                continue
            begun = time.process_time()
            said = _told(entry, wrong)
            one["judged"].append(entry.name)
            one["seconds"] = round(one["seconds"] + time.process_time() - begun, 1)
            if said is None:
                one["right"] += 1
            else:
                one["others"][entry.name] = said
            write_whole(RESULTS, json.dumps(found, indent=1) + "\n")
        print(f"{name}: {one['right']} of {len(one['judged'])}, {one['seconds']:.0f} s of processor time")


def _drawn(seeds: Iterable[int]) -> Iterator[Ships]:
    for seed in seeds:
        yield f"drawn by seed {seed}, wrong", True, drawn_gallery.wrong(seed)
        yield f"drawn by seed {seed}, good", False, drawn_gallery.right(seed)


def _kept() -> Iterator[Ships]:
    yield "gallery, wrong", True, gallery.wrong()
    yield "gallery, good", False, gallery.right()
    yield "second gallery, wrong", True, second_gallery.wrong()
    yield "second gallery, good", False, second_gallery.right()


def _told(entry: Entry, wrong: bool) -> list[str] | None:
    """None where the ship is judged rightly, else what was said."""
    if not wrong:
        return second_gallery.new(entry) or None
    said: list[str] = []
    for words in gallery.new(entry):
        said.append(words)
        if any(word in words for word in entry.words):
            return None
    return said


if __name__ == "__main__":
    main()
