"""Which C compiler is taken, with which options; and that two families agree."""

from __future__ import annotations

import importlib.util
import platform
import shutil
import stat
import sys
from pathlib import Path

import numpy as np
import pytest

from seatrial.core.errors import CompilerError
from seatrial.engine import compilers
from seatrial.engine.compilers import Compiler, compiler, no_compiler
from seatrial.engine.rollout import simulator
from seatrial.ships.files import load
from seatrial.simulate.run import open_loop, open_loop_parameters


def program(folder: Path, name: str, says: str) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(f"#!/bin/sh\necho '{says}'\n", encoding="utf-8")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture
def bare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A path on which nothing is, and no package that brings a compiler."""
    monkeypatch.setenv("PATH", str(tmp_path / "bin"))
    monkeypatch.delenv("SEATRIAL_CC", raising=False)
    monkeypatch.setattr(sys, "path", [str(tmp_path / "packages")])
    monkeypatch.delitem(sys.modules, "ziglang", raising=False)
    importlib.invalidate_caches()
    return tmp_path


def test_gcc_comes_before_clang_and_clang_before_the_package(bare: Path) -> None:
    assert "seatrial[compiler]" in no_compiler()
    package = bare / "packages" / "ziglang"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    zig = program(package, "zig", "clang version 22")
    importlib.invalidate_caches()
    assert compiler() == Compiler((str(zig), "cc"))
    assert compiler().name == "zig cc"
    for name in ("clang", "cc", "gcc"):
        found = program(bare / "bin", name, "gcc 14")
        assert compiler() == Compiler((str(found),))
    assert no_compiler() == ""


def test_a_package_without_its_program_is_no_compiler(bare: Path) -> None:
    (bare / "packages" / "ziglang").mkdir(parents=True)
    (bare / "packages" / "ziglang" / "__init__.py").touch()
    importlib.invalidate_caches()
    with pytest.raises(CompilerError, match="no C compiler"):
        compiler()


def test_the_one_that_is_named_is_taken_or_refused(bare: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = program(bare / "own", "mycc", "clang version 15")
    program(bare / "bin", "gcc", "gcc 14")
    monkeypatch.setenv("SEATRIAL_CC", str(own))
    assert compiler().command == (str(own),)
    monkeypatch.setenv("SEATRIAL_CC", "absent")
    with pytest.raises(CompilerError, match="absent"):
        compiler()


FAMILIES = {"gcc 14": ("-fno-builtin", "-fveclib=libmvec"), "clang version 22": ("-fveclib=libmvec", "-fno-builtin")}


@pytest.mark.parametrize("says", FAMILIES)
def test_each_family_is_told_in_its_own_words_where_vector_functions_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, says: str
) -> None:
    monkeypatch.setattr(compilers.platform, "machine", lambda: "x86_64")
    flags = Compiler((str(program(tmp_path, says.split()[0], says)),)).flags
    option, other = FAMILIES[says]
    assert option in flags
    assert other not in flags


def others() -> list[str]:
    """Compilers of this machine besides gcc."""
    packaged = compilers.packaged()
    return [*filter(None, [shutil.which("clang"), " ".join(packaged.command) if packaged else None])]


@pytest.mark.long
@pytest.mark.skipif(not others(), reason="no compiler here but gcc")
@pytest.mark.parametrize("named", others())
def test_kernels_of_another_compiler_are_the_same_to_rounding(
    named: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A turn of a tanker on 20 lanes: all lanes bit-equal, and equal to gcc's within what rounding grows to."""
    ship = load("kvlcc2_l7")
    state = np.tile(np.array([0.0, 0.0, 0.0, 1.179, 0.0, 0.0]), (20, 1))
    series = np.zeros((20, 1, len(open_loop(ship).series)))
    series[:, :, :2] = [np.deg2rad(20.0), 10.0]
    runs = []
    for word in ("gcc", named):
        monkeypatch.setenv("SEATRIAL_CC", word)
        monkeypatch.setenv("SEATRIAL_CACHE", str(tmp_path))
        made = simulator(open_loop(ship), back_end="simd")
        runs.append(made.run(state, series, open_loop_parameters(ship), dt=0.1, steps=601).values)
    assert len(list((tmp_path / "kernels").glob("*.so"))) == 2, "the second kernel is not the second compiler's"
    ours, theirs = runs
    assert np.abs(ours[0, -1, :2]).max() > 10.0
    assert (theirs == theirs[:1]).all()
    np.testing.assert_allclose(theirs, ours, rtol=1e-10, atol=1e-10)


def test_zig_links_the_vector_functions_that_run_and_does_without_where_there_are_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A system without a compiler has no development files, and one with musl has no vector functions."""
    zig = Compiler((str(program(tmp_path, "zig", "clang version 20")), "cc"))
    for found, libraries in (("/lib64/libmvec.so.1", ("/lib64/libmvec.so.1", "-lm")), ("", ("-lm",))):
        monkeypatch.setattr(compilers, "_vector_library", lambda found=found: found)
        assert zig.libraries == libraries
        assert ("-fveclib=libmvec" in zig.flags) == (bool(found) and platform.machine() == "x86_64")
    assert Compiler(("/usr/bin/gcc",)).libraries == ("-lmvec", "-lm")
