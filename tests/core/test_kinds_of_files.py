"""A file of one kind that is given to the command of another is told what it is and what takes it."""

from __future__ import annotations

from pathlib import Path

import pytest

from house import REPOSITORY
from seatrial.cli.app import main
from seatrial.core.files import read_toml
from seatrial.core.kinds import KINDS, wrong_kind

COMMANDS: dict[str, tuple[str, ...]] = {
    "seatrial-study": ("identify", "FILE", "-o", "out"), "seatrial-campaign": ("campaign", "FILE", "-o", "out"),
    "seatrial-scenario": ("range", "FILE"), "seatrial-ship": ("simulate", "FILE", "zigzag"),
    "seatrial-particulars": ("estimate", "FILE", "-o", "out.toml"),
    "seatrial-mapping": ("import", "csv", "logs", "--mapping", "FILE", "-o", "out"),
    "seatrial-steps": ("mend", "logs/a.csv", "--by", "FILE", "-o", "out"),
    "seatrial-captive": ("captive", "kvlcc2_l7", "logs/a.csv", "--mapping", "FILE"), "trial": ("check", "FILE"),
}  # fmt: skip


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "a.csv").write_text("t [s],psi [rad]\n0,0\n1,0\n")
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "seatrial-series"])
def test_every_kind_is_told_by_every_command_of_another(
    kind: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "a.toml").write_text(f'schema = "{kind}/1"\n')
    for own, command in COMMANDS.items():
        if own == kind:
            continue
        status = main([word.replace("FILE", "a.toml") for word in command])
        (line,) = capsys.readouterr().err.splitlines()
        assert (status, KINDS[kind][0] in line) == (2, True), (command, line)
        assert KINDS[kind][1].split("{")[0].strip() in line
        assert not (here / "out").exists()


def test_what_a_paper_prints_names_its_study(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("suyama2023", "you2023"):
        printed = REPOSITORY / "studies" / f"{name}_printed.toml"
        assert main(["identify", str(printed), "-o", "out"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "is what a paper prints" in line
        assert f"seatrial identify {printed.with_name(f'{name}.toml')} -o RUN" in line


def test_every_file_of_the_studies_says_what_it_is() -> None:
    """So that none of them is told as a study that lacks its schema."""
    files = list((REPOSITORY / "studies").rglob("*.toml"))
    assert len(files) > 10
    for path in files:
        assert str(read_toml(path)["schema"]).partition("/")[0] in KINDS, path


def test_no_kind_an_unknown_and_a_newer_one_are_told_apart() -> None:
    wanted = "seatrial-study/1"
    assert wrong_kind("a.toml", None, wanted) == f'a.toml: has no schema; a study begins with schema = "{wanted}"'
    assert wrong_kind("a.toml", "seatrial-study/2", wanted).endswith("this version reads 'seatrial-study/1'")
    assert "schema is 'other/1'" in wrong_kind("a.toml", "other/1", wanted)
    assert len(wrong_kind("a.toml", ["x" * 9999], wanted)) < 200
