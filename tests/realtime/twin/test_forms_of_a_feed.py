"""A twin fed as devices feed it: fixes told twice, two gyros, a magnetic compass alone; as good as by a clean feed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from seatrial.data.formats import nmea
from seatrial.data.geodesy import Datum
from seatrial.data.nmea.framing import Tag, tag_block
from seatrial.data.nmea.ship import Fittings, lines
from seatrial.manoeuvres.pseudo_random import PseudoRandom
from seatrial.realtime.twin.live import Live
from seatrial.realtime.twin.settings import NOISE, usual
from seatrial.realtime.twin.sources import Ear, Row, channels_of, noise_of, rows_of
from seatrial.ships.files import load
from seatrial.simulate.run import simulate

SHIP = load("suzaku")
ABOARD = Fittings(datum=Datum(35.0, 139.5), epoch=1_800_000_000.0, variation=math.radians(-7.0))
PLAIN = ("RMC", "HDT", "ROT", "RSA", "RPM", "VBW")
Said = Sequence[tuple[float, list[bytes]]]


@cache
def voyage() -> tuple[tuple[float, dict[str, float]], ...]:
    """What the instruments read each second of a manoeuvre of five minutes."""
    run = simulate(SHIP, PseudoRandom(1.9875, 0.35), duration=300.0, dt=0.5, every=2)
    hand, out = np.random.default_rng(4), []
    for k, t in enumerate(run.t.tolist()):
        x, y, psi, u, v, r = (float(run[name][k]) for name in ("x", "y", "psi", "u", "v_m", "r"))
        latitude, longitude = ABOARD.datum.place(x + hand.normal(0, 0.5), y + hand.normal(0, 0.5))
        out.append((t, {
            "t": t, "psi": (psi + hand.normal(0.0, 0.002)) % math.tau, "r": r + hand.normal(0.0, 2e-4),
            "latitude": latitude, "longitude": longitude, "U": math.hypot(u, v),
            "chi": (psi + math.atan2(v, u)) % math.tau,
            "delta": float(run["delta"][k]), "n_P": float(run["n_P"][k]), "u_w": u + hand.normal(0.0, 0.05), "v_w": v,
        }))  # fmt: skip
    return tuple(out)


def spoken(*kinds: str) -> Said:
    return [(t, [line for kind in kinds for line in lines(kind, ABOARD, said)]) for t, said in voyage()]


def two_gyros() -> Said:
    """A second gyro of the same talker, 2 deg off, told apart by TAG blocks as on a network of IEC 61162-450."""
    out = []
    for t, said in voyage():
        other = lines("HDT", ABOARD, {**said, "psi": (said["psi"] + math.radians(2.0)) % math.tau})
        rest = [line for kind in PLAIN if kind != "HDT" for line in lines(kind, ABOARD, said)]
        first = [tag_block(Tag("HE0001")) + line for line in lines("HDT", ABOARD, said)]
        out.append((t, [*first, *(tag_block(Tag("HE0002")) + line for line in other), *rest]))
    return out


FORMS: dict[str, Callable[[], Said]] = {
    "clean": lambda: spoken(*PLAIN),
    "fixes and headings told twice": lambda: spoken("RMC", "GGA", "GLL", "HDT", "THS", "ROT", "RSA", "RPM", "VBW"),
    "two gyros": two_gyros,
    "a compass alone": lambda: spoken("RMC", "HDG", "ROT", "RSA", "RPM", "VBW"),
}


def by_wire(form: str, _: Path) -> tuple[Live, Iterator[Row]]:
    ear, said = Ear(), FORMS[form]()

    def rows() -> Iterator[Row]:
        for t, sentences in said:
            for one in sentences:
                ear.hear(one, t)
            yield t, ear.row()

    channels = (*NOISE, "y", "v_east", *SHIP.model.controls)
    return Live(SHIP, usual(SHIP, channels), channels), rows()


def by_file(form: str, folder: Path) -> tuple[Live, Iterator[Row]]:
    path = folder / "log.nmea"
    path.write_bytes(b"".join(one for _, some in FORMS[form]() for one in some))
    trial = nmea.read(path)
    channels = channels_of(trial, SHIP.model.controls)
    return Live(SHIP, usual(SHIP, channels, noise=noise_of(trial)), channels), rows_of(trial)


Way = Callable[[str, Path], tuple[Live, Iterator[Row]]]


@cache
def forecasts(form: str, way: Way, folder: Path) -> tuple[float, float, int]:
    """Error of forecasts over 30 s [m], the share of readings in their bands, and the number of alarms."""
    live, rows = way(form, folder)
    live.trust.every = 10.0
    for t, values in rows:
        live.feed(t, values)
    score = live.trust.scores[30.0]
    assert score.count > 15
    return score.rms, score.held, len(live.alarms)


@pytest.mark.slow
@pytest.mark.parametrize("way", [by_wire, by_file])
@pytest.mark.parametrize("form", [name for name in FORMS if name != "clean"])
def test_a_forecast_is_as_good_as_by_a_clean_feed(
    form: str, way: Way, tmp_path_factory: pytest.TempPathFactory
) -> None:
    clean = forecasts("clean", way, tmp_path_factory.getbasetemp())
    found = forecasts(form, way, tmp_path_factory.getbasetemp())
    assert found[0] == pytest.approx(clean[0], rel=1e-6)
    assert found[1:] == clean[1:]
    assert clean[0] < 2.0
    assert clean[1] > 0.8
