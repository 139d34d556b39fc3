"""Small cells of S-57 (ISO 8211) written by hand: each area one closed edge, as the standard's data model has them."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

_UNIT, _END = b"\x1f", b"\x1e"
_PAIRS = ("0001DSID", "DSIDDSSI", "0001DSPM", "0001FRID", "FRIDFOID", "FRIDATTF", "FRIDFSPT", "0001VRID", "VRIDVRPT",
          "VRIDSG2D", "VRIDSG3D")  # fmt: skip
_FIELDS = {
    "DSID": ("1600", "RCNM!RCID!EXPP!INTU!DSNM!EDTN!UPDN!UADT!ISDT!STED!PRSP!PSDN!PRED!PROF!AGEN!COMT",
             "(b11,b14,2b11,3A,2A(8),R(4),b11,2A,b11,b12,A)"),
    "DSSI": ("1600", "DSTR!AALL!NALL!NOMR!NOCR!NOGR!NOLR!NOIN!NOCN!NOED!NOFA", "(3b11,8b14)"),
    "DSPM": ("1600", "RCNM!RCID!HDAT!VDAT!SDAT!CSCL!DUNI!HUNI!PUNI!COUN!COMF!SOMF!COMT",
             "(b11,b14,3b11,b14,4b11,2b14,A)"),
    "FRID": ("1600", "RCNM!RCID!PRIM!GRUP!OBJL!RVER!RUIN", "(b11,b14,2b11,2b12,b11)"),
    "FOID": ("1600", "AGEN!FIDN!FIDS", "(b12,b14,b12)"),
    "ATTF": ("2600", "*ATTL!ATVL", "(b12,A)"),
    "FSPT": ("2600", "*NAME!ORNT!USAG!MASK", "(B(40),3b11)"),
    "VRID": ("1600", "RCNM!RCID!RVER!RUIN", "(b11,b14,b12,b11)"),
    "VRPT": ("2600", "*NAME!ORNT!USAG!TOPI!MASK", "(B(40),4b11)"),
    "SG2D": ("2600", "*YCOO!XCOO", "(2b24)"),
    "SG3D": ("2600", "*YCOO!XCOO!VE3D", "(3b24)"),
}  # fmt: skip
CLASSES = {"DEPARE": 42, "DEPCNT": 43, "COALNE": 30, "LNDARE": 71, "OBSTRN": 86, "WRECKS": 159, "BOYLAT": 17,
           "TSSLPT": 148, "UNSARE": 154, "DRGARE": 46, "RECTRC": 109}  # fmt: skip
ATTRIBUTES = {"DRVAL1": 87, "DRVAL2": 88, "VALDCO": 174, "VALSOU": 179, "WATLEV": 187, "ORIENT": 117, "EXPSOU": 93}
Ring = Sequence[tuple[float, float]]
Part = tuple[bytes, int, int, int]


@dataclass
class Cell:
    """Features in longitude and latitude [deg]."""

    unit: int = 1
    records: list[list[tuple[str, bytes]]] = field(default_factory=list)
    features: list[list[tuple[str, bytes]]] = field(default_factory=list)
    numbers: dict[int, int] = field(default_factory=dict)

    def area(self, name: str, *rings: Ring, **said: float) -> None:
        """A polygon and its holes."""
        ends = [(self._edge([*ring, ring[0]]), 1, 1 if not k else 2, 255) for k, ring in enumerate(rings)]
        self._feature(name, 3, ends, said)

    def line(self, name: str, line: Ring, **said: float) -> None:
        self._feature(name, 2, [(self._edge(line), 1, 255, 255)], said)

    def point(self, name: str, at: tuple[float, float], **said: float) -> None:
        self._feature(name, 1, [(self._node(at, 110), 255, 255, 255)], said)

    def write(self, path: Path) -> Path:
        head = [("DSID", struct.pack("<BIBB", 10, 1, 1, 5) + _UNIT.join((path.name.encode(), b"1", b"0", b""))
                 + b"2026010120260101" + b"03.1" + b"\x01" + _UNIT + b"2.0" + _UNIT + b"\x01" + struct.pack("<H", 550)
                 + _UNIT),
                ("DSSI", struct.pack("<3B8I", 2, 1, 1, *[len(self.features)] * 8))]  # fmt: skip
        frame = [("DSPM", struct.pack("<BI3BI4B2I", 20, 1, 2, 12, 12, 20000, self.unit, 1, 1, 1, 10**7, 10) + _UNIT)]
        records = [head, frame, *self.records, *self.features]
        body = b"".join(_record([("0001", struct.pack("<H", k)), *one]) for k, one in enumerate(records, 1))
        path.write_bytes(_description() + body)
        return path

    def _number(self, kind: int) -> int:
        self.numbers[kind] = self.numbers.get(kind, 0) + 1
        return self.numbers[kind]

    def _vector(self, kind: int, *fields: tuple[str, bytes]) -> bytes:
        number = self._number(kind)
        self.records.append([("VRID", struct.pack("<BIHB", kind, number, 1, 1)), *fields])
        return struct.pack("<BI", kind, number)

    def _node(self, at: tuple[float, float], kind: int = 120) -> bytes:
        return self._vector(kind, ("SG2D", _points([at])))

    def _edge(self, line: Ring) -> bytes:
        first = self._node(line[0])
        last = first if line[-1] == line[0] else self._node(line[-1])
        ends = b"".join(name + struct.pack("<4B", 255, 255, topi, 255) for name, topi in ((first, 1), (last, 2)))
        inner = [("SG2D", _points(line[1:-1]))] if len(line) > 2 else []
        return self._vector(130, ("VRPT", ends), *inner)

    def _feature(self, name: str, shape: int, parts: Sequence[Part], said: Mapping[str, float]) -> None:
        number = self._number(100)
        values = b"".join(struct.pack("<H", ATTRIBUTES[key]) + f"{value:g}".encode() + _UNIT
                          for key, value in said.items())  # fmt: skip
        self.features.append([
            ("FRID", struct.pack("<BIBBHHB", 100, number, shape, 1, CLASSES[name], 1, 1)),
            ("FOID", struct.pack("<HIH", 550, number, 1)), *([("ATTF", values)] if values else []),
            ("FSPT", b"".join(one + struct.pack("<3B", *more) for one, *more in parts)),
        ])  # fmt: skip


def _points(places: Ring) -> bytes:
    return b"".join(struct.pack("<ii", round(lat * 1e7), round(lon * 1e7)) for lon, lat in places)


def _record(fields: Sequence[tuple[str, bytes]], lead: str = " D     ", tail: str = "   ") -> bytes:
    directory, data = b"", b""
    for tag, raw in fields:
        raw += _END
        directory += f"{tag}{len(raw):05d}{len(data):05d}".encode()
        data += raw
    base = 24 + len(directory) + 1
    return f"{base + len(data):05d}{lead}{base:05d}{tail}5504".encode() + directory + _END + data


def _description() -> bytes:
    fields = [("0000", b"0000;&   " + _UNIT + "".join(_PAIRS).encode()),
              ("0001", b"0500;&   ISO 8211 Record Identifier" + _UNIT + _UNIT + b"(b12)")]  # fmt: skip
    for tag, (kind, labels, form) in _FIELDS.items():
        fields.append((tag, f"{kind};&   {tag}".encode() + _UNIT + labels.encode() + _UNIT + form.encode()))
    return _record(fields, "3LE1 09", " ! ")
