"""Work of the bridge page for one picture with twenty other ships, by the browser's own clock.

    python benchmarks/bridge_frames.py [-o results/bridge_frames.json]

Fifty pictures a second leave 20 ms for each.  The least of thirty means of ten is reported: everything else that the
machine does only adds to it.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

TESTS = Path(__file__).parents[1] / "tests"
OTHERS = [word for k in range(20) for word in ("--other", f"kvlcc2_l7@{60 + 25 * k},{-200 + 20 * k},{18 * k}")]
WORK = """(() => {
    const { chart, link } = seatrial; let best = Infinity;
    for (let k = 0; k < 30; k += 1) {
        const state = link.between(performance.now()), begun = performance.now();
        for (let n = 0; n < 10; n += 1) chart.draw(state, link.last.range);
        best = Math.min(best, (performance.now() - begun) / 10);
    }
    return best;
})()"""


def main() -> None:
    """Measure at three sizes of the window."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args()
    sys.path[:0] = [str(TESTS), str(TESTS / "realtime" / "bridge")]
    from bridges import Running

    from browser import CHROMIUM, Browser

    if CHROMIUM is None:
        sys.exit("no browser on this machine")
    found: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        running = Running(Path(folder), *OTHERS)
        try:
            with Browser(Path(folder, "browser")) as browser:
                for width, height in ((390, 844), (1280, 800), (3840, 2160)):
                    browser.size(width, height)
                    browser.open(f"http://127.0.0.1:{running.port}/")
                    browser.until("globalThis.seatrial?.drawn > 3 && seatrial.link.commands")
                    found[f"{width}x{height}"] = round(browser.says(WORK), 3)
        finally:
            running.close()
    print(json.dumps({"ships": 21, "ms_a_picture": found}, indent=1))
    if given.out:
        given.out.write_text(json.dumps({"ships": 21, "ms_a_picture": found}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
