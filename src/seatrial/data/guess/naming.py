"""Names of columns: what a name may mean, by a table of the field's usual names in several languages.

`words.toml` holds the names; a new language is more words there.  A name never decides alone where a measurement can:
what it says is where the tests of the values begin.
"""

from __future__ import annotations

import re
import tomllib
import unicodedata
from collections.abc import Mapping
from functools import cache
from pathlib import Path

from ...core.values import dataclass, replace

_UNIT = re.compile(r"^(?P<name>.*?)\s*[\[(<{（](?P<unit>[^\])>}）]*)[\])>}）]\s*$")
_SHORT = 2
"""Letters of a name that counts only where it is the whole name."""


@dataclass(frozen=True)
class Meaning:
    """What the name of a column may mean.

    Attributes:
        role: the quantity, a key of [roles].
        score: how much of the name says so; at most 1 and a little for a longer word.
        words: modifiers in the name, such as "command", "port", "towards".
        number: the number of a shaft, rudder or thruster in the name; 0 without one.
    """

    role: str
    score: float
    words: frozenset[str]
    number: int = 0


@dataclass(frozen=True)
class _Tables:
    roles: Mapping[str, tuple[tuple[str, ...], ...]]
    modifiers: Mapping[str, frozenset[str]]
    units: Mapping[str, str]
    written: Mapping[str, str]


@cache
def _tables() -> _Tables:
    said = tomllib.loads(Path(__file__).with_name("words.toml").read_text(encoding="utf-8"))
    roles = {role: tuple(tuple(name.split()) for name in names) for role, names in said["roles"].items()}
    modifiers = {kind: frozenset(words) for kind, words in said["modifiers"].items()}
    units = {word: unit for unit, words in said["units"].items() for word in words}
    written = {word: said_so for said_so, words in said["written"].items() for word in words}
    return _Tables(roles, modifiers, units, dict(sorted(written.items(), key=lambda pair: -len(pair[0]))))


def in_letters(text: str) -> str:
    """A text with words of names in Chinese, Japanese and Korean characters put into English ones."""
    if text.isascii():
        return text
    text = text.lower() if _CYRILLIC.search(text) else text
    for word, said in _tables().written.items():
        text = text.replace(word, f" {said} ") if word in text else text
    return text


_CYRILLIC = re.compile("[А-яΆ-ώ]")


def written(text: str) -> bool:
    """Whether a text has such a word; of letters in few of them any text of another encoding may have."""
    small = text.lower()
    return any(word in small for word in _tables().written if len(word) > 3 or not _CYRILLIC.search(word))


def parted(head: str) -> tuple[str, str]:
    """A head as its name and what it says of a unit: ``"RUD [deg]"``, ``"Kurs (Grad)"``, ``"speed, kn"``."""
    found = _UNIT.match(head.strip())
    if found and found["name"]:
        # "SPD(GND)" and "Rudder [port]" are names, "RUD(deg)" has a unit, "Compass [streck]" one that is not known
        named = re.fullmatch(r"[A-Za-z ]{1,12}", found["unit"]) and not unit_of(found["unit"])
        named = named and ("[" not in head or words_of_names(found["unit"]))
        named = named or found["unit"].startswith(":,")  # a column of a matrix
        return (head.strip(), "") if named else (found["name"].strip(), found["unit"].strip())
    if re.fullmatch(r"\S.*[\s_]%", head.strip()):
        return head.strip()[:-1].rstrip(" _"), "%"
    name, comma, last = head.strip().rpartition(",")
    if comma and unit_of(last):
        return name.strip(), last.strip()
    return head.strip(), ""


def unit_of(text: str) -> str:
    """The unit's symbol that a text means; empty where it means none."""
    plain = re.sub(r"\s+", " ", _plain(in_letters(text).strip().strip("[]()<>{}").lower().replace("º", "°"))).strip()
    plain = re.sub(r"\s*/\s*", "/", plain)
    return _tables().units.get(plain, "") if plain else ""


_SIGNAL_K = re.compile(r"(?:navigation|steering|environment|propulsion)\.[a-z]")
_OF_SIGNAL_K = (("rateOfTurn", "rad/s"), ("revolutions", "1/s"), ("[sS]peed", "m/s"), ("depth", "m"),
                ("heading|course|[aA]ngle|direction|attitude|Variation", "rad"))  # fmt: skip


def unit_in_name(name: str) -> str:
    """A unit as the last word of a name, ``"hdg_deg"`` or ``"speed kn"``, or a name that is one, ``"rpm"``.

    Paths of Signal K are in SI by its specification.
    """
    if _SIGNAL_K.match(name):
        return next((unit for words, unit in _OF_SIGNAL_K if re.search(words, name)), "")
    words = tokens(name)
    for count in (2, 1):
        tail = "/".join(words[-count:])
        # Single letters are as often an axis as a unit, and "second of day" is in seconds.
        if len(words) >= count and len(tail) > 1 and words[-count - 1 : -count] != ["of"] and tail in _tables().units:
            return _tables().units[tail]
    return ""


def tokens(name: str) -> list[str]:
    """Words of a name in lower case without accents: ``"rudderAngle_PS"`` is rudder, angle, ps."""
    split = re.sub(r"(?<=[a-z0-9])(?=[A-Z][a-z]|[A-Z]{2,})|(?<=[A-Za-z]{2})(?=\d)", " ", in_letters(name))
    plain = _plain(split)
    return re.findall(r"[a-z]+\d*|\d+", plain.lower())


def words_of_names(text: str) -> bool:
    """Whether a text has a word that names of columns have: of a side, an order, a source."""
    return any(set(tokens(text)) & known for known in _tables().modifiers.values())


_MAGNETIC = frozenset((
    "mag", "magn", "magnetic", "magnetisk", "magnetisch", "magnetico", "magnetique", "missvisende", "missweisend",
    "compass", "kompass", "kompasskurs", "kompas", "kompassi", "compas", "bussola", "jikirashin", "hdm", "hdgm",
    "magheading", "maghdg", "hdgmag", "mhdg",
))  # fmt: skip


def magnetic(name: str) -> bool:
    """Whether the name of a heading says that it is that of a magnetic compass, unless it says a gyro too."""
    words = tokens(name)
    if {"gyro", "true", "gyrokompass", "hdt"} & set(words):
        return False
    said = bool(_MAGNETIC & set(words)) or any(word.startswith("magnet") for word in words)
    return said or (len(words) > 1 and words[-1] == "m" and words[0] in ("hdg", "heading", "head"))


def _plain(text: str) -> str:
    for accented, letters in (("ø", "o"), ("Ø", "O"), ("æ", "ae"), ("Æ", "Ae"), ("ß", "ss"), ("œ", "oe"), ("å", "a"),
                              ("Å", "A"), ("ł", "l"), ("Ł", "L"), ("ı", "i"), ("đ", "d"), ("ð", "g"),
                              ("þ", "s")):  # fmt: skip
        text = text.replace(accented, letters)
    bare = unicodedata.normalize("NFKD", text)
    return "".join(one for one in bare if not unicodedata.combining(one))


_UNSAID = 0.45
_OTHERS = frozenset(("target", "waypoint", "wp", "wpt", "home", "goal", "ais", "other", "ref", "desired", "setpoint",
                     "nav", "mission", "dest", "destination", "beacon", "obstacle", "wind", "sp", "cmd"))  # fmt: skip
"""Words of messages whose fields are not of the ship itself, or not measured."""


def meanings(name: str, around: str = "") -> list[Meaning]:
    """What the name of a column may mean, best first.

    Args:
        name: without its unit.
        around: path of the file or topic, which says what a column called "data" is.
    """
    found = _meanings(tokens(name))
    message, dot, field = name.rpartition(".")
    if dot and not _OTHERS & set(tokens(message)) and (not found or found[0].score < _UNSAID):
        found += [replace(one, score=0.85 * one.score) for one in _meanings(tokens(field))]
    if around and (not found or found[0].score < 0.5):
        stem = around.rpartition("/")[2]
        for context, share in ((stem, 0.9), (around, 0.8)):
            found += [replace(one, score=share * one.score) for one in _meanings([*tokens(context), *tokens(name)])]
    number = next((int(word) for word in tokens(around) if word.isdigit() and len(word) == 1), 0)
    best: dict[str, Meaning] = {}
    for one in sorted(found, key=lambda m: -m.score):
        best.setdefault(one.role, replace(one, number=one.number or number))
    return list(best.values())


_LINEAR = ("u", "v", "vx", "vy", "v_north", "v_east", "x", "y", "sog", "stw", "speed")
"""What "angular velocity x" is none of."""


def _meanings(words: list[str]) -> list[Meaning]:
    tables = _tables()
    said = frozenset(kind for kind, known in tables.modifiers.items() if kind != "neutral" and known & set(words))
    number = next((int(word) for word in words if word.isdigit() and len(word) == 1), 0)
    found: list[Meaning] = []
    never = _LINEAR if {"angular", "acceleration", "accel", "covariance"} & set(words) else ()
    for role, names in tables.roles.items():
        if role in never:
            continue
        score = max((_score(words, name) for name in names), default=0.0)
        if score > 0.0:
            found.append(Meaning(role, score, said, number))
    return sorted(found, key=lambda m: -m.score)


def _score(words: list[str], name: tuple[str, ...]) -> float:
    """How much of a column's words a name accounts for; 0 where it is not in them."""
    count = len(name)
    at = next((k for k in range(len(words) - count + 1) if tuple(words[k : k + count]) == name), None)
    if at is None:
        return 0.0
    modifiers = _tables().modifiers
    rest = words[:at] + words[at + count :]
    known = set().union(*modifiers.values())
    strange = sum(1 for word in rest if word not in known and not unit_of(word) and not word.isdigit())
    if strange and sum(map(len, name)) <= _SHORT:
        return 0.0
    weight = sum(map(len, name))
    return (1.0 + 0.01 * weight) / (1.0 + 0.7 * strange) - 0.05 * len(rest)
