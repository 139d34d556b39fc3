"""The exported C of a ship: time of one Runge-Kutta step, of every ship in the library."""

from __future__ import annotations

import math
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from timing import publish

from seatrial.exchange import Equations, equations_of, save_c
from seatrial.models import Sampled
from seatrial.ships.files import library, load

BAR = 5.0
"""Microseconds a step."""

MAIN = """
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <time.h>
#include "{name}.h"
int main(void)
{{
    double best = 1e9;
    int round, i, k;
    for (round = 0; round < 15; round++) {{
        double x[{upper}_NX] = {{0.0, 0.0, 0.3, {speed!r}, 0.0, 0.0}}, u[{upper}_NU], e[{upper}_NE] = {{0.0}}, s;
        struct timespec a, b;
        for (i = 0; i < {upper}_NU; i++) u[i] = 0.2;
        clock_gettime(CLOCK_MONOTONIC, &a);
        for (k = 0; k < 20000; k++) {{ u[0] = 0.2 + 1e-6 * k; {name}_step(x, u, e, {dt!r}, x); }}
        clock_gettime(CLOCK_MONOTONIC, &b);
        s = (double)(b.tv_sec - a.tv_sec) + 1e-9 * (double)(b.tv_nsec - a.tv_nsec);
        if (s < best && x[0] == x[0]) best = s;
    }}
    printf("%.6f\\n", best / 20000 * 1e6);
    return 0;
}}
"""


def microseconds(made: Equations, speed: float, L_pp: float) -> float:
    """Shortest mean time of a step over 15 rounds of 20000, compiled by -O2."""
    with tempfile.TemporaryDirectory() as folder:
        _, source = save_c(made, folder)
        driver, program = Path(folder) / "main.c", Path(folder) / "main"
        dt = 0.01 * L_pp / max(speed, math.sqrt(L_pp))
        driver.write_text(MAIN.format(name=made.name, upper=made.name.upper(), speed=speed, dt=dt))
        strict = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-pedantic"]
        subprocess.run(["gcc", *strict, str(driver), str(source), "-o", str(program), "-lm"], check=True)
        return float(subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout)


def main() -> None:
    """Measure and publish."""
    if shutil.which("gcc") is None:
        raise SystemExit("no gcc")
    ships = [ship for ship in map(load, library()) if not isinstance(ship.model, Sampled)]
    times = {ship.name: microseconds(equations_of(ship), ship.speed, ship.L_pp) for ship in ships}
    slowest = max(times, key=lambda name: times[name])
    told = {f"slowest of {len(times)} ships, {slowest}": slowest} | {name: name for name in ("qiuxin5", "kvlcc2")}
    rows: list[dict[str, Any]] = [
        {"what": f"exported C, one step, {what}", "value": times[name], "unit": "us", "bar": f"< {BAR:g} us"}
        for what, name in told.items()
    ]
    publish("export", rows)


if __name__ == "__main__":
    main()
