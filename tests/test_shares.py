"""Shares of the unit tier: every module once, none with more than it must have, and a failure anywhere is told."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from shares import dealt, main, modules
from tiers import left_out


def short(*lengths: int) -> dict[Path, str]:
    return {Path(f"test_{k}.py"): "x" * length for k, length in enumerate(lengths)}


SHORT = short(7, 6, 5, 4, 3, 3, 2)


@pytest.mark.parametrize("texts", [SHORT, short(3, 3, 6)])
@pytest.mark.parametrize("processes", [1, 2, 3, 9])
def test_every_module_has_one_process_and_none_has_much_more_than_its_part(
    processes: int, texts: dict[Path, str]
) -> None:
    """The longest first: at most 4/3 of the best there can be (Graham 1969), which no process can be below."""
    shares = dealt(texts, processes)
    assert sorted(path for share in shares for path in share) == sorted(texts)
    lengths = [len(text) for text in texts.values()]
    best = max(math.ceil(sum(lengths) / processes), max(lengths))
    assert max(sum(len(texts[path]) for path in share) for share in shares) <= 4.0 / 3.0 * best
    assert len(shares) == min(processes, len(texts))


def test_modules_that_import_the_same_dear_library_are_dealt_together() -> None:
    dear = {Path(f"test_dear_{k}.py"): text for k, text in enumerate(
        ("import torch\n", "from scipy.stats import chi2\n", "from scipy import optimize, stats\n"))}  # fmt: skip
    (holder,) = [share for share in dealt({**SHORT, **dear}, 3) if set(share) & set(dear)]
    assert set(dear) <= set(holder)


def test_what_no_marks_take_is_dealt_to_nobody(tmp_path: Path) -> None:
    slow, quick = "pytestmark = pytest.mark.slow\n", "def test_a(): pass\n"
    for name, text in (("test_slow.py", slow), ("below/test_quick.py", quick), ("helper.py", quick)):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    assert left_out(slow, "not slow and not long")
    assert [path.name for path in modules("not slow and not long", tmp_path)] == ["test_quick.py"]
    assert [path.name for path in modules("", tmp_path)] == ["test_quick.py", "test_slow.py"]


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [None, "test_first.py", "test_second.py"])
def test_a_failure_in_any_share_is_told_and_fails_the_whole(
    wrong: str | None, tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    (tmp_path / "tests").mkdir()
    for name in ("test_first.py", "test_second.py"):
        (tmp_path / "tests" / name).write_text(f"def test_one():\n    assert len('a') == {1 + (name == wrong)}\n")
    assert main(["--processes", "2"], tmp_path) == (wrong is not None)
    said = capfdbinary.readouterr().out.decode()
    assert said.count("1 passed") == (2 if wrong is None else 1)
    assert said.count("1 failed") == (0 if wrong is None else 2), "at once, and again with the assertion explained"
    assert ("where 1 = len('a')" in said) == (wrong is not None)
    assert wrong is None or f"tests/{wrong}" in said
