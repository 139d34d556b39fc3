"""Sentences that a ship sends: from its motion, or from the readings of its instruments, to NMEA 0183.

| sentence | its unit | its sign | here |
|---|---|---|---|
| HDT, THS | deg true, 0 to 360 | clockwise from north | psi [rad] |
| ROT | deg per **minute** | - when the bow turns to port | r [rad/s] |
| VBW | knots | - astern, - to port | u, v_m [m/s] at the log |
| HDG | deg magnetic | variation east positive: true is magnetic plus variation | psi [rad] |
| VHW | knots, km/h through the water; deg | - astern | u_w [m/s] at the log, psi |
| GLL | deg and minutes | north, east | latitude, longitude of the antenna |
| TTM | nautical miles, knots, minutes | bearing and course true; - after the passing | `Contact` |
| VTG, RMC | knots, deg true | course towards | U_G [m/s], gamma_G [rad] at the antenna |
| RSA, ROR | deg | - turns to port; the first field is the starboard or only rudder | delta [rad] |
| RPM, PRC, TRC | rev/min | - astern, whatever the hand of the propeller | n_P [1/s] |
| MWV R | m/s, knots or km/h; deg from the bow, 0 to 360 | where it comes from | U_A, gamma_A |
| MWV T | the same, as if the ship stood still | where it comes from | U_T, gamma_T - psi |
| DPT | m below the transducer | offset + up to the waterline | depth [m] |

`reading` is the inverse.  VDO and VDM hold reports of transponders, see `ais`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from types import MappingProxyType

from ...core.constants import KNOT
from ...core.values import dataclass
from ..geodesy import Datum
from . import ais
from .sentences import Sentence, Value, encode

_DEGREE = 180.0 / math.pi

Fields = Mapping[str, Value]

Measured = Mapping[str, float]
"""Readings of the instruments, SI and radians, by these names; one without an instrument is left out.

t; psi; r; latitude, longitude [deg], chi, U of the antenna; u_w, v_w, u, v_m of the log; v_w_stern, v_stern;
U_A, gamma_A; U_T, gamma_T_bow; transducer [m], its depth, and below, from it to the ground; the controls.
"""

NULL_ISLAND = Datum(0.0, 0.0)
"""Zero latitude, zero longitude: what a receiver without a fix may send, and never a place of a trial."""


@dataclass(frozen=True)
class Fittings:
    """Where things are aboard; lengths in m from midship.

    Attributes:
        datum: where x and y are zero.
        epoch: seconds since 1970, UTC, at t = 0.
        antenna: of the GNSS receiver, forward and to starboard.
        log: of the speed log, forward.
        stern: where the transverse speed of the stern is measured, forward (so below zero).
        transducer: of the echo sounder, below the waterline.
        rudders: controls that are rudders, port to starboard.
        shafts: controls that are propellers, port to starboard.
        variation: of the magnetic compass, east positive [rad]; None where the ship has no magnetic compass.
        mmsi: of the transponder; 0 for none.
        kind, status: type of the ship and what it is doing, for the transponder.
        name, length, breadth, draught: of the ship, for the transponder [m].
        simulator: whether sentences are marked as those of a simulator; listeners then take no position, as RMC is
            void in every mode but those of a true receiver.
    """

    datum: Datum = NULL_ISLAND
    epoch: float = 1_800_000_000.0
    antenna: tuple[float, float] = (0.0, 0.0)
    log: float = 0.0
    stern: float = 0.0
    transducer: float = 0.0
    rudders: tuple[str, ...] = ("delta",)
    shafts: tuple[str, ...] = ("n_P",)
    variation: float | None = None
    mmsi: int = 0
    kind: ais.Type | None = None
    status: ais.Status = "under way"
    name: str = ""
    length: float = 0.0
    breadth: float = 0.0
    draught: float = 0.0
    simulator: bool = False

    @property
    def mode(self) -> str:
        """Mode indicator of the sentences: A, autonomous, or S, simulator."""
        return "S" if self.simulator else "A"

    @property
    def transponder(self) -> ais.Transponder:
        """The transponder of the ship."""
        return ais.Transponder(self.mmsi, self.name, self.length, self.breadth, self.draught, self.antenna,
                               kind=self.kind, status=self.status)  # fmt: skip

    @property
    def numbers(self) -> Mapping[str, int]:
        """Number of each shaft: 0 alone or amidships, odd to starboard, even to port."""
        half, odd = divmod(len(self.shafts), 2)
        port = {name: 2 * (half - k) for k, name in enumerate(self.shafts[:half])}
        middle = {self.shafts[half]: 0} if odd else {}
        return {**port, **middle, **{name: 2 * k + 1 for k, name in enumerate(self.shafts[half + odd :])}}


def compass(angle: float) -> float:
    """A direction in degrees, 0 to 360."""
    return math.degrees(angle) % 360.0


def _scaled(m: Measured, name: str, factor: float) -> float | None:
    return m[name] * factor if name in m else None


def _status(m: Measured, name: str) -> str:
    return "A" if name in m else "V"


def _speeds(_: Fittings, m: Measured) -> list[Fields]:
    per = 1.0 / KNOT
    return [{
        "longwaterspd": _scaled(m, "u_w", per), "transwaterspd": _scaled(m, "v_w", per),
        "waterspdstatus": _status(m, "u_w"), "longgroundspd": _scaled(m, "u", per),
        "transgroundspd": _scaled(m, "v_m", per), "groundspdstatus": _status(m, "u"),
        "sterntranswaterspd": _scaled(m, "v_w_stern", per), "sternwaterspdstatus": _status(m, "v_w_stern"),
        "sterntransgroundspd": _scaled(m, "v_stern", per), "sterngroundspdstatus": _status(m, "v_stern"),
    }]  # fmt: skip


def _magnetic(fit: Fittings, angle: float) -> float | None:
    """A magnetic direction in degrees; None without a magnetic compass."""
    return None if fit.variation is None else compass(angle - fit.variation)


def _compass_heading(fit: Fittings, m: Measured) -> list[Fields]:
    variation = math.degrees(fit.variation or 0.0)
    return [{"headingM": _magnetic(fit, m["psi"]), "deviation": None, "deviationEW": None,
             "variation": abs(variation), "variationEW": "W" if variation < 0.0 else "E"}]  # fmt: skip


def _through_water(fit: Fittings, m: Measured) -> list[Fields]:
    psi = m.get("psi")
    return [{
        "hdgT": None if psi is None else compass(psi), "hgdTu": "T",
        "hdgM": None if psi is None else _magnetic(fit, psi), "hgdMu": "M",
        "spdN": m["u_w"] / KNOT, "spdNu": "N", "spdK": 3.6 * m["u_w"], "spdKu": "K",
    }]  # fmt: skip


def _minimum(fit: Fittings, m: Measured) -> list[Fields]:
    moment = clock(fit, m)  # with positions to 7 decimals the 82 characters have no room for the variation: see HDG
    return [{
        "time": _of_day(moment), "status": "V" if fit.simulator else "A", "lat": m["latitude"], "lon": m["longitude"],
        "spd": m["U"] / KNOT, "cog": compass(m["chi"]), "date": moment.date(), "mv": None, "mvEW": None,
        "posMode": fit.mode, "navStatus": "V",
    }]  # fmt: skip


def _date(fit: Fittings, m: Measured) -> list[Fields]:
    moment = clock(fit, m)
    return [{"time": _of_day(moment), "day": moment.day, "month": moment.month, "year": moment.year,
             "ltzh": "00", "ltzn": "00"}]  # fmt: skip


def _rudders(fit: Fittings, m: Measured) -> list[Fields]:
    """The outer two rudders; a single one is in the starboard field."""
    starboard, port = "".join(fit.rudders[-1:]), fit.rudders[0] if len(fit.rudders) > 1 else ""
    return [{
        "stbdangle": _scaled(m, starboard, _DEGREE), "stbdstatus": _status(m, starboard),
        "portangle": _scaled(m, port, _DEGREE), "portstatus": _status(m, port),
    }] if starboard in m or port in m else []  # fmt: skip


def _wind(_: Fittings, m: Measured) -> list[Fields]:
    known = (("R", "U_A", "gamma_A"), ("T", "U_T", "gamma_T_bow"))
    return [{"angle": compass(m[angle]), "reference": reference, "speed": m[speed], "speedu": "M", "status": "A"}
            for reference, speed, angle in known if speed in m]  # fmt: skip


SPOKEN: Mapping[str, tuple[str, Callable[[Fittings, Measured], list[Fields]]]] = MappingProxyType({
    "HDT": ("HE", lambda _, m: [{"headingT": compass(m["psi"]), "headingTu": "T"}]),
    "THS": ("HE", lambda fit, m: [{"headt": compass(m["psi"]), "mi": fit.mode}]),
    "ROT": ("TI", lambda _, m: [{"rot": math.degrees(m["r"]) * 60.0, "valid": "A"}]),
    "VBW": ("VD", _speeds),
    "VTG": ("GP", lambda fit, m: [{
        "cogt": compass(m["chi"]), "cogtUnit": "T", "cogm": _magnetic(fit, m["chi"]), "cogmUnit": "M",
        "sogn": m["U"] / KNOT, "sognUnit": "N", "sogk": 3.6 * m["U"], "sogkUnit": "K", "posMode": fit.mode}]),
    "RMC": ("GP", _minimum),
    "GGA": ("GP", lambda fit, m: [{
        "time": _of_day(clock(fit, m)), "lat": m["latitude"], "lon": m["longitude"],
        "quality": 8 if fit.simulator else 1, "numSV": 12, "HDOP": 1.0, "alt": 0.0, "altUnit": "M",
        "sep": 0.0, "sepUnit": "M", "diffAge": None, "diffStation": None}]),
    "GLL": ("GP", lambda fit, m: [{
        "lat": m["latitude"], "lon": m["longitude"], "time": _of_day(clock(fit, m)),
        "status": "V" if fit.simulator else "A", "posMode": fit.mode}]),
    "HDG": ("HC", _compass_heading),
    "VHW": ("VW", _through_water),
    "ZDA": ("GP", _date),
    "RSA": ("RC", _rudders),
    "RPM": ("RC", lambda fit, m: [
        {"source": "S", "engineshaftnum": number, "rpm": 60.0 * m[name], "pitch": None, "status": "A"}
        for name, number in fit.numbers.items() if name in m]),
    "MWV": ("WI", _wind),
    "DPT": ("SD", lambda _, m: [{"depth": m.get("below"), "offset": m["transducer"], "rangescale": None}]),
})  # fmt: skip
"""By kind of the sentences that a ship sends: the talker, and the fields of each from fittings and readings."""


def lines(kind: str, fit: Fittings, m: Measured) -> list[bytes]:
    """The sentences of a kind as they go on the wire; also VDO, the position report, where pyais is installed.

    The static data go before a position report where `m` has "static".
    """
    if kind == "VDO":
        by = fit.transponder
        return [*(ais.static(by, kind) if "static" in m else ()), *ais.position(by, m, clock(fit, m).second, kind)]
    talker, fields_of = SPOKEN[kind]
    return [encode(Sentence(talker, kind, fields)) for fields in fields_of(fit, m)]


def clock(fit: Fittings, m: Measured) -> datetime:
    """Date and time of day of the readings, to a hundredth of a second."""
    return datetime.fromtimestamp(round((fit.epoch + m["t"]) * 100.0) / 100.0, UTC)


def _of_day(moment: datetime) -> float:
    return moment.hour * 3600.0 + moment.minute * 60.0 + moment.second + moment.microsecond * 1e-6
