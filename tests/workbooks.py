"""Workbooks in the manner of USV-ASW, made by hand so that no writer is needed."""

from __future__ import annotations

import datetime
import zipfile
from pathlib import Path

import numpy as np

HEADS = ("DateTime", "t", "Longitude", "Latitude", "x", "y", "Heading", "course", "Speed", "HeadingSet", "SpeedSet",
         "Voltage", "PWM_L", "PWM_R")  # fmt: skip
_PARTS = {
    "[Content_Types].xml": '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-'
    'types"><Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Override PartName="/xl/workbook.xml" ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.'
    'sheet.main+xml"/><Override PartName="/xl/worksheets/sheet1.xml" ContentType="application/vnd.openxmlformats-'
    'officedocument.spreadsheetml.worksheet+xml"/></Types>',
    "_rels/.rels": '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/'
    'relationships"><Relationship Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/'
    'officeDocument" Target="xl/workbook.xml"/></Relationships>',
    "xl/workbook.xml": '<?xml version="1.0"?><workbook xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/'
    'main" xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships"><sheets><sheet name="Sheet1" '
    'sheetId="1" r:id="r1"/></sheets></workbook>',
    "xl/_rels/workbook.xml.rels": '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/'
    'package/2006/relationships"><Relationship Id="r1" Type="http://schemas.openxmlformats.org/officeDocument/2006/'
    'relationships/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
}  # fmt: skip


def write_workbook(path: Path, rows: list[list[str]]) -> Path:
    """A workbook of one sheet of text cells, the first row its heads."""
    return write_sheets(path, {"Sheet1": rows})


def write_sheets(path: Path, sheets: dict[str, list[list[str]]]) -> Path:
    """A workbook of sheets of text cells."""
    parts = dict(_PARTS)
    book, links = _PARTS["xl/workbook.xml"], _PARTS["xl/_rels/workbook.xml.rels"]
    kinds = _PARTS["[Content_Types].xml"]
    for one in range(2, len(sheets) + 1):
        links = links.replace("</Relationships>", f"{_LINK.format(one)}</Relationships>")
        kinds = kinds.replace("</Types>", f"{_KIND.format(one)}</Types>")
    named = "".join(f'<sheet name="{name}" sheetId="{k}" r:id="r{k}"/>' for k, name in enumerate(sheets, start=1))
    parts |= {"xl/workbook.xml": book.replace('<sheet name="Sheet1" sheetId="1" r:id="r1"/>', named)}
    parts |= {"xl/_rels/workbook.xml.rels": links, "[Content_Types].xml": kinds}
    parts |= {f"xl/worksheets/sheet{k}.xml": _sheet(rows) for k, rows in enumerate(sheets.values(), start=1)}
    with zipfile.ZipFile(path, "w") as made:
        for name, text in parts.items():
            made.writestr(name, text)
    return path


_LINK = ('<Relationship Id="r{0}" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/worksheet" '
         'Target="worksheets/sheet{0}.xml"/>')  # fmt: skip
_KIND = ('<Override PartName="/xl/worksheets/sheet{0}.xml" ContentType="application/vnd.openxmlformats-officedocument.'
         'spreadsheetml.worksheet+xml"/>')  # fmt: skip


def _sheet(rows: list[list[str]]) -> str:
    cells = "".join(
        f'<row r="{k}">' + "".join(
            f'<c r="{chr(65 + j)}{k}" t="inlineStr"><is><t>{text}</t></is></c>' for j, text in enumerate(row) if text
        ) + "</row>"
        for k, row in enumerate(rows, start=1)
    )  # fmt: skip
    return ('<?xml version="1.0"?><worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
            f"<sheetData>{cells}</sheetData></worksheet>")  # fmt: skip


_STYLES = {
    "[Content_Types].xml": _PARTS["[Content_Types].xml"].replace("</Types>", (
        '<Override PartName="/xl/styles.xml" ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.'
        'styles+xml"/></Types>')),
    "xl/_rels/workbook.xml.rels": _PARTS["xl/_rels/workbook.xml.rels"].replace("</Relationships>", (
        '<Relationship Id="r2" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/styles" '
        'Target="styles.xml"/></Relationships>')),
    "xl/styles.xml": '<?xml version="1.0"?><styleSheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
    '<numFmts count="1"><numFmt numFmtId="164" formatCode="yyyy\\-mm\\-dd hh:mm:ss.000"/></numFmts><cellXfs count="2">'
    '<xf numFmtId="0"/><xf numFmtId="164" applyNumberFormat="1"/></cellXfs></styleSheet>',
}  # fmt: skip
"""What a workbook with cells of dates has beside `_PARTS`."""


def write_dates(path: Path, columns: dict[str, list[float]], rows: int) -> Path:
    """A workbook of columns of dates, and of a heading HDG [deg] of 1, 2 ..."""
    heads = [*columns, "HDG"]
    first = "".join(f'<c r="{chr(65 + j)}1" t="inlineStr"><is><t>{head}</t></is></c>' for j, head in enumerate(heads))
    sheet = f'<row r="1">{first}</row>'
    for k in range(rows):
        dates = "".join(f'<c r="{chr(65 + j)}{k + 2}" s="1"><v>{values[k]!r}</v></c>'
                        for j, values in enumerate(columns.values()))  # fmt: skip
        sheet += f'<row r="{k + 2}">{dates}<c r="{chr(65 + len(columns))}{k + 2}"><v>{k + 1}</v></c></row>'
    book = ('<?xml version="1.0"?><worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main">'
            f"<sheetData>{sheet}</sheetData></worksheet>")  # fmt: skip
    with zipfile.ZipFile(path, "w") as made:
        for name, text in {**_PARTS, **_STYLES, "xl/worksheets/sheet1.xml": book}.items():
            made.writestr(name, text)
    return path


def voyage(*, swapped: bool = False, stretch: float = 1.1117, rows: int = 400) -> list[list[str]]:
    """Rows of a boat on a bend at 0.8 m/s, with 4 degrees of drift to and fro, a fix at every second row."""
    t = 0.11 * np.arange(rows)
    course = 0.3 + 0.02 * t
    heading = course + np.radians(4.0) * np.sin(0.5 * t)
    x = np.concatenate([[0.0], np.cumsum(0.8 * 0.11 * np.cos(0.5 * (course[1:] + course[:-1])))])
    y = np.concatenate([[0.0], np.cumsum(0.8 * 0.11 * np.sin(0.5 * (course[1:] + course[:-1])))])
    latitude = 38.9 + np.degrees(x / 6360590.0)
    longitude = 121.5 + np.degrees(y / (6386580.0 * np.cos(np.radians(38.9))))
    names = ("course", "Heading") if swapped else ("Heading", "course")
    start = datetime.datetime(2025, 7, 24, 15, 45, 54, 179000)
    out = [list(HEADS)]
    for k in range(rows):
        j = k - k % 2
        cells = {
            "DateTime": (start + datetime.timedelta(seconds=float(t[k]))).isoformat(" ", "milliseconds"),
            "t": f"{0.1 * k:.1f}", "Longitude": f"{longitude[j]:.12f}", "Latitude": f"{latitude[j]:.12f}",
            "x": f"{stretch * x[j] + 5.0:.9f}", "y": f"{stretch * y[j] - 2.0:.9f}",
            names[0]: f"{np.degrees(heading[j]):.6f}", names[1]: f"{np.degrees(course[j]):.6f}", "Speed": "0.8",
            "HeadingSet": "20", "SpeedSet": "1", "Voltage": "23.5", "PWM_L": "1750", "PWM_R": "1400",
        }  # fmt: skip
        out.append([cells[name] for name in HEADS])
    return out
