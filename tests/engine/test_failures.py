"""Lanes that fail, and machines on which kernels cannot be made or kept."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatrial.engine import EngineNotice, System, cache
from seatrial.engine.cache import CompilerError
from seatrial.engine.rollout import sensitivity, simulator
from seatrial.ships.files import load
from seatrial.simulate.run import open_loop, open_loop_parameters

DECAY = System(states=("a", "b"), series=("c",), parameters=("k",),
               derivative=lambda z, a, p: (p[0] * z[0] * z[0] + a[0], z[0] - z[1]))  # fmt: skip

SCRIPT = """
import sys, warnings
import numpy as np
from seatrial.engine import System
from seatrial.engine.rollout import sensitivity, simulator
warnings.simplefilter("always")
s = System(("a",), ("c",), ("k",), lambda z, a, p: (-p[0] * z[0] + a[0],))
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    for _ in range(3):
        e = simulator(s)
        x = e.run(np.ones((3, 1)), np.zeros((3, 1, 1)), np.array([1.0]), dt=0.1, steps=11).values[0, -1, 0]
print(e.virtual, len(said), repr(float(x)), *[x for w in said[:1] for x in (w.category.__name__, w.message)])
"""


def apart(**environment: str) -> subprocess.Popen[str]:
    """The script above in a process of its own."""
    env = {**os.environ, **environment}
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT], env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def heard(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=60)
    assert process.returncode == 0, err
    return out


@pytest.mark.parametrize("back_end", ["simd", pytest.param("virtual", marks=pytest.mark.slow)])
def test_a_lane_that_blows_up_is_named_and_the_others_go_on(back_end: str) -> None:
    """a' = a^2 from 1 blows up at t = 1; the other lanes decay."""
    z = np.tile([-1.0, 0.5], (20, 1))
    held = np.zeros((20, 1, 1))
    engine = simulator(DECAY, back_end=back_end)
    given: dict[str, Any] = {"dt": 0.05, "steps": 60, "t0": 10.0}
    sound = engine.run(z, held, np.ones(1), **given)
    z[7, 0] = 1.0
    run = engine.run(z, held, np.ones(1), **given)
    assert sound.failures == ()
    assert [f.lane for f in run.failures] == [7]
    failure = run.failures[0]
    assert failure.state in ("a", "b")
    assert 10.9 < failure.time < 11.6
    assert "lane 7" in str(failure)
    assert f"{failure.time:.6g} s" in str(failure)
    others = [i for i in range(20) if i != 7]
    assert np.array_equal(run.values[others], sound.values[others])
    assert np.isnan(run.values[7, run.t >= failure.time]).all()
    assert np.isfinite(run.values[7, run.t < failure.time]).all()


def test_a_lane_that_leaves_its_validity_is_named() -> None:
    z = np.array([[-1.0, 0.5], [0.5, 0.5], [-1.0, 0.6]])
    engine = simulator(DECAY)
    given: dict[str, Any] = {"dt": 0.05, "steps": 30}
    free = engine.run(z, np.zeros((3, 1, 1)), np.ones(1), **given)
    run = engine.run(z, np.zeros((3, 1, 1)), np.ones(1), validity={"a": (-2.0, 0.75)}, **given)
    (failure,) = run.failures
    assert (failure.lane, failure.state) == (1, "a")
    assert failure.value > 0.75
    row = int(np.argmax(free.values[1, :, 0] > 0.75))
    assert failure.time == pytest.approx(run.t[row])
    assert np.isnan(run.values[1, row:]).all()
    assert np.array_equal(run.values[[0, 2]], free.values[[0, 2]])


@pytest.mark.long
def test_a_truncated_kernel_is_compiled_anew(tmp_path: Path) -> None:
    first = heard(apart(SEATRIAL_CACHE=str(tmp_path)))
    (kernel,) = (tmp_path / "kernels").glob("*.so")
    whole = kernel.read_bytes()
    for length in (0, 10, len(whole) // 2, len(whole) - 1):
        kernel.write_bytes(whole[:length])
        assert heard(apart(SEATRIAL_CACHE=str(tmp_path))) == first
        assert len(kernel.read_bytes()) == len(whole)
    assert [p.name for p in (tmp_path / "kernels").iterdir()] == [kernel.name]


@pytest.mark.long
def test_processes_that_start_at_once_share_an_empty_cache(tmp_path: Path) -> None:
    started = [apart(SEATRIAL_CACHE=str(tmp_path)) for _ in range(4)]
    answers = {heard(process) for process in started}
    assert len(answers) == 1
    assert answers.pop().startswith("False 0 ")
    assert len(list((tmp_path / "kernels").iterdir())) == 1


@pytest.mark.long
def test_without_a_compiler_one_notice_and_the_same_numbers(tmp_path: Path) -> None:
    fast = heard(apart(SEATRIAL_CACHE=str(tmp_path))).split()
    for name in ("none", "no-such-compiler"):
        slow = heard(apart(SEATRIAL_CC=name, SEATRIAL_CACHE=str(tmp_path))).split(maxsplit=4)
        assert slow[:2] == ["True", "1"]
        assert slow[3] == "EngineNotice"
        assert name in slow[4]
        assert float(slow[2]) == pytest.approx(float(fast[2]), rel=1e-14)


@pytest.mark.slow
def test_a_cache_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    said = heard(apart(SEATRIAL_CACHE=str(blocked))).split(maxsplit=4)
    assert said[:2] == ["True", "1"]
    assert str(blocked) in said[4]


def planted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The kernel of a source in a cache in `tmp_path`, with the code of another one in its place."""
    monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path))
    cache.library("int answer(void) { return 666; }")
    (other,) = (tmp_path / "kernels").iterdir()
    code = other.read_bytes()
    other.unlink()
    cache.library("int answer(void) { return 42; }")
    (kernel,) = (tmp_path / "kernels").iterdir()
    kernel.unlink()
    kernel.write_bytes(code)
    return kernel


def test_kernels_are_kept_where_nobody_else_can_write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path))
    before = os.umask(0)
    try:
        cache.library("int x;")
    finally:
        os.umask(before)
    (kernel,) = (tmp_path / "kernels").iterdir()
    assert [stat.S_IMODE(one.stat().st_mode) for one in (kernel.parent, kernel)] == [0o700, 0o700]
    kernel.parent.chmod(0o777)  # a cache of an earlier version
    cache.library("int x;")
    assert stat.S_IMODE(kernel.parent.stat().st_mode) == 0o700


@pytest.mark.slow
def test_a_kernel_that_others_can_write_is_compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = planted(tmp_path, monkeypatch)
    kernel.chmod(0o666)
    assert cache.library("int answer(void) { return 42; }").answer() == 42
    assert stat.S_IMODE(kernel.stat().st_mode) == 0o700


@pytest.mark.slow
def test_a_kernel_that_is_a_link_is_compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = planted(tmp_path, monkeypatch)
    elsewhere = kernel.rename(tmp_path / "elsewhere.so")
    elsewhere.chmod(0o700)
    kernel.symlink_to(elsewhere)
    assert cache.library("int answer(void) { return 42; }").answer() == 42
    assert not kernel.is_symlink()


def test_a_cache_of_another_user_is_refused_in_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path))
    (tmp_path / "kernels").mkdir()
    owner = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: owner + 1)
    with pytest.warns(EngineNotice, match=f"kernels: belongs to user {owner}") as said:
        engine = simulator(DECAY)
    assert len(said) == 1
    assert "\n" not in str(said[0].message)
    assert engine.run(np.ones((1, 2)), np.zeros((1, 1, 1)), np.ones(1), dt=0.05, steps=3).failures == ()
    assert list((tmp_path / "kernels").iterdir()) == []


def test_a_cache_in_a_folder_open_to_all_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path / "open"))
    (tmp_path / "open").mkdir()
    (tmp_path / "open").chmod(0o777)
    with pytest.raises(CompilerError, match=r"open: "):
        cache.library("int x;")
    (tmp_path / "open").chmod(0o1777)  # nobody moves what is another's there, as in /tmp
    cache.library("int x;")


def test_asking_for_the_kernel_where_there_is_none_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SEATRIAL_CC", "none")
    with pytest.raises(CompilerError, match="SEATRIAL_CC"):
        simulator(DECAY, back_end="simd")


def test_a_compiler_that_fails_is_quoted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path))
    with pytest.raises(CompilerError, match="failed"):
        cache.library("this is no C")
    monkeypatch.setenv("SEATRIAL_CC", "false")
    with pytest.raises(CompilerError, match="failed"):
        cache.library("int x;")
    assert list((tmp_path / "kernels").iterdir()) == []


def test_series_that_do_not_cover_the_run_are_refused_before_they_are_read():
    case = simulator(open_loop(load("kvlcc2_l7")))
    values = open_loop_parameters(load("kvlcc2_l7"))
    state = np.zeros((3, 6))
    for shape, text in (((3, 5, 10), "3 lanes of 5 steps"), ((2, 9, 10), "2 lanes of 9"), ((3, 9, 4), "4 channels")):
        with pytest.raises(ValueError, match=text):
            case.run(state, np.zeros(shape), values, dt=0.1, steps=9)


def test_what_a_killed_compiler_left_is_swept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    kernels = tmp_path / "kernels"
    for name in ("tmpold", "tmpnew"):
        (kernels / name).mkdir(parents=True)
        (kernels / name / "kernel.c").touch()
    os.utime(kernels / "tmpold", (1e9, 1e9))
    monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path))
    monkeypatch.setenv("SEATRIAL_CC", "false")
    with pytest.raises(CompilerError):
        cache.library("no C")
    assert [p.name for p in kernels.iterdir()] == ["tmpnew"]


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize(("one", "other"), [("simd", "virtual"), ("virtual", "simd")])
def test_series_packed_by_one_back_end_run_on_another(one: str, other: str, held: bool) -> None:
    """A compiler that gives out between two kernels of one fit leaves them on back ends that differ."""
    rng = np.random.default_rng(3)
    z, k, steps = rng.uniform(-1.0, 0.0, (41, 2)), np.array([0.4]), 20
    series = rng.normal(size=(41, 1 if held else steps, 1))
    given: dict[str, Any] = {"dt": 0.05, "steps": steps}
    packed = simulator(DECAY, back_end=one).pack(series)
    ahead = simulator(DECAY, back_end=other)
    assert np.array_equal(ahead.run(z, packed, k, **given).values, ahead.run(z, series, k, **given).values)
    slopes = sensitivity(DECAY, ("k",), back_end=other)
    for got, wanted in zip(slopes.run(z, packed, k, **given), slopes.run(z, series, k, **given), strict=True):
        assert np.array_equal(got, wanted)
