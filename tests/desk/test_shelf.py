"""What a folder holds, and names that lead out of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from seatrial.core.errors import RequestError
from seatrial.data.guess.guessing import Reader
from seatrial.desk.shelf import Item, inside, place_of, shelf


def kinds(folder: Path) -> dict[str, str]:
    return {one.path: one.kind for one in shelf(folder)}


def test_files_are_told_by_what_is_in_them(tmp_path: Path) -> None:
    files = {
        "a.toml": 'schema = "seatrial-ship/1"', "b.toml": '# of the yard\n\nschema="seatrial-study/1"\n',
        "c.toml": 'schema = "seatrial-nmea/1"', "d.toml": "[odd", "e.toml": "x = 1", "page.HTML": "<p>",
        "day.nmea": "$GPRMC", "notes.md": "text", ".hidden.csv": "", "photo.JPG": "", "plot.py": "",
        "n2k.json": "{}", "steps.toml": 'schema = "seatrial-steps/1"',
    }  # fmt: skip
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    assert kinds(tmp_path) == {"a.toml": "ship", "b.toml": "study", "c.toml": "mapping", "page.HTML": "page",
                               "day.nmea": "log", "n2k.json": "log", "steps.toml": "steps"}  # fmt: skip


def test_a_folder_is_trials_by_its_sidecars_else_logs_and_a_run_by_its_fit(tmp_path: Path) -> None:
    for name in ("logs/1.csv", "logs/2.csv", "trials/a.csv", "trials/a.yaml", "trials/b.csv", "run/fit.json",
                 "run/model.toml", "run/report.html", "empty/.keep"):  # fmt: skip
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text('schema = "seatrial-ship/1"' if name.endswith("toml") else "")
    found = shelf(tmp_path)
    assert [(one.path, one.kind) for one in found] == [
        ("logs", "logs"), ("trials", "trials"), ("run/model.toml", "ship"), ("run", "run"), ("run/report.html", "page"),
    ]  # fmt: skip
    assert found[0].size == 2
    assert found[1] == Item("trials", "trials", 1, ("a",))


def test_files_of_a_fit_are_no_logs(tmp_path: Path) -> None:
    for name in ("history.csv", "report.json", "fit.npz", "report.html", "day.csv"):
        (tmp_path / name).write_text("")
    assert kinds(tmp_path) == {"history.csv": "log", "report.json": "log", "day.csv": "log", "report.html": "page"}
    (tmp_path / "fit.json").write_text("{}")
    assert kinds(tmp_path) == {"day.csv": "log", "report.html": "page"}


def test_logs_say_the_format_that_needs_no_mapping(tmp_path: Path) -> None:
    """Of tables, and of what no reader takes, they say none."""
    (tmp_path / "spoken").mkdir()
    (tmp_path / "spoken" / "a.log").write_text("$HEHDT,10.0,T\r\n$HEROT,1.0,A\r\n" * 9)
    (tmp_path / "table").mkdir()
    (tmp_path / "table" / "a.csv").write_text("t,psi\n" + "".join(f"{k},{k}\n" for k in range(9)))
    (tmp_path / "frames.txt").write_text("(0.000) can0 09F8017F#50C3A2D2B8A9A900\n" * 9)
    (tmp_path / "part.tdms").write_bytes(b"TDSm" + bytes(90))
    assert {one.path: one.format for one in shelf(tmp_path)} == {
        "spoken": "nmea", "table": "", "frames.txt": "n2k", "part.tdms": ""}  # fmt: skip


def test_tables_whose_columns_are_known_go_by_a_guess_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.csv").write_text("t,psi\n0,1\n")
    for tabular, told in ((True, ""), (False, "moos")):
        monkeypatch.setattr("seatrial.desk.shelf.reader_of", lambda _, tabular=tabular: Reader("moos", "", tabular))
        assert [one.format for one in shelf(tmp_path)] == [told]


def test_a_link_to_nowhere_and_a_binary_file_do_no_harm(tmp_path: Path) -> None:
    (tmp_path / "gone").symlink_to(tmp_path / "nowhere")
    (tmp_path / "x.toml").write_bytes(bytes(range(256)) * 40)
    (tmp_path / "log.bin").write_bytes(b"\xff\xfe")
    assert kinds(tmp_path) == {"log.bin": "log"}


@pytest.mark.parametrize("name", [
    "", ".", "..", "../x", "a/../../x", "/etc/passwd", "a//b", "-o", "a/-o", ".seatrial", "a/.b", "~/x", "C:\\x", "c:x",
    "a\nb", "a\x00b", "\\\\host\\x",
])  # fmt: skip
def test_names_that_lead_out_or_would_be_options_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(RequestError):
        inside(tmp_path, name)


def test_a_link_that_leads_out_is_refused(tmp_path: Path) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "out").symlink_to(tmp_path)
    assert inside(tmp_path / "here", "run 1/model.toml") == tmp_path / "here" / "run 1" / "model.toml"
    with pytest.raises(RequestError, match="outside"):
        inside(tmp_path / "here", "out/secret")


def test_what_is_dropped_is_a_log_unless_a_command_has_made_it() -> None:
    assert place_of("day 1.nmea") == "logs/day 1.nmea"
    assert place_of("ship.toml") == "ship.toml"
    assert place_of("a.CSV") == "logs/a.CSV"
