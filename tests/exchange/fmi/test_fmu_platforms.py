"""One slave for several platforms: what its folders hold, and the library of Windows run under Wine beside Linux's."""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from slaves import AROUND, DT, GCC, GIVEN, STATES, Made, assert_same, flown, orders

from seatrial.cli.app import main
from seatrial.exchange import save_fmu
from seatrial.exchange.fmi import binaries
from seatrial.exchange.fmi.binaries import chosen
from seatrial.exchange.fmi.fmu import slave
from seatrial.manoeuvres.zigzag import Zigzag
from seatrial.ships import ShipError
from seatrial.ships.files import load
from seatrial.simulate.approach import approach

MINGW = shutil.which("x86_64-w64-mingw32-gcc")
WINE = shutil.which("wine") or shutil.which("wine64")
pytestmark = pytest.mark.skipif(GCC is None or sys.platform != "linux", reason="no C compiler")
cross = pytest.mark.skipif(MINGW is None, reason="no compiler for Windows")
HEAD = {"linux64": b"\x7fELF", "win64": b"MZ"}

WINDOWS_HOST = r"""
#include <windows.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#define dlsym(lib, name) (void*)GetProcAddress(lib, name)
#include "fmi2.h"
int main(int argc, char* argv[])
{
    HMODULE lib = LoadLibraryA(argv[1]);
    fmi2Component (*make)(fmi2String, fmi2Type, fmi2String, fmi2String, const fmi2CallbackFunctions*, int, int);
    fmi2Status (*set)(fmi2Component, const fmi2ValueReference[], size_t, const fmi2Real[]);
    fmi2Status (*get)(fmi2Component, const fmi2ValueReference[], size_t, fmi2Real[]);
    fmi2Status (*enter)(fmi2Component), (*leave)(fmi2Component);
    fmi2Status (*step)(fmi2Component, fmi2Real, fmi2Real, fmi2Boolean);
    fmi2CallbackFunctions nothing;
    fmi2ValueReference order[2], at[6] = {0, 1, 2, 3, 4, 5};
    double o[2], x[6], dt = atof(argv[3]);
    int k, bad = 0;
    memset(&nothing, 0, sizeof nothing);
    if (!lib) return 2;
    *(void**)&make = dlsym(lib, "fmi2Instantiate"); *(void**)&set = dlsym(lib, "fmi2SetReal");
    *(void**)&get = dlsym(lib, "fmi2GetReal"); *(void**)&step = dlsym(lib, "fmi2DoStep");
    *(void**)&enter = dlsym(lib, "fmi2EnterInitializationMode");
    *(void**)&leave = dlsym(lib, "fmi2ExitInitializationMode");
    order[0] = atoi(argv[4]); order[1] = atoi(argv[5]);
    fmi2Component ship = make("ship", fmi2CoSimulation, argv[2], NULL, &nothing, 0, 0);
    if (!ship) return 3;
    for (k = 6; k + 1 < argc; k += 2) {
        fmi2ValueReference one = atoi(argv[k]); double v = atof(argv[k + 1]);
        bad += set(ship, &one, 1, &v) != fmi2OK;
    }
    bad += enter(ship) != fmi2OK; bad += leave(ship) != fmi2OK;
    for (k = 0; scanf("%lf %lf", &o[0], &o[1]) == 2; k++) {
        bad += set(ship, order, 2, o) != fmi2OK;
        bad += step(ship, k * dt, dt, 1) != fmi2OK;
        bad += get(ship, at, 6, x) != fmi2OK;
        printf("%.17g %.17g %.17g %.17g %.17g %.17g\n", x[0], x[1], x[2], x[3], x[4], x[5]);
    }
    return bad ? 4 : 0;
}
"""


@cross
def test_one_file_for_linux_and_windows(tmp_path: Path) -> None:
    ship = load("esso_osaka_3m")
    first, _ = save_fmu(ship, tmp_path / "esso.fmu", platforms=("linux64", "win64"))
    alone, _ = save_fmu(ship, tmp_path / "alone.fmu")
    again, _ = save_fmu(ship, tmp_path / "again.fmu", platforms=("x86_64-windows", "linux64", "win64"))
    with zipfile.ZipFile(first) as one, zipfile.ZipFile(again) as other, zipfile.ZipFile(alone) as bare:
        made = {Path(name).parent.name: name for name in one.namelist() if name.startswith("binaries")}
        assert set(made) == set(HEAD)
        for folder, name in made.items():
            assert one.read(name).startswith(HEAD[folder])
            assert one.read(name) == other.read(name), "no time and no path in it"
        assert one.read(made["linux64"]) == bare.read(made["linux64"])
        assert "binaries/win64/esso_osaka_3m.dll" not in bare.namelist()
        library = one.read(made["win64"])
    header = (Path(binaries.__file__).parents[1] / "fmi2" / "fmi2.h").read_text()
    entries = re.findall(r"^ENTRY .*?(fmi2\w+)\(", header, re.MULTILINE)
    assert len(entries) == 34
    assert all(f"{entry}\0".encode() in library for entry in entries)


@cross
@pytest.mark.long
@pytest.mark.skipif(WINE is None, reason="no Wine")
def test_the_library_of_windows_follows_the_engine(tmp_path: Path) -> None:
    ship = load("esso_osaka_3m")
    speed, n_P = approach(ship)
    run = flown(ship, Zigzag(n_P, math.radians(20.0), math.radians(20.0)), STATES, speed, AROUND)
    path, _ = save_fmu(ship, tmp_path / "esso.fmu", dt=DT, platforms=("win64",))
    made = Made(path, slave(ship, dt=DT))
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path)
        guid = ElementTree.fromstring(archive.read("modelDescription.xml")).attrib["guid"]
    (tmp_path / "host.c").write_text(WINDOWS_HOST)
    subprocess.run(
        [str(MINGW), "-std=gnu99", "-I", str(tmp_path / "sources"), "host.c", "-o", "host.exe"],
        cwd=tmp_path, check=True, capture_output=True,
    )  # fmt: skip
    given = [str(part) for name, value in {**GIVEN, **run.start}.items()
             for part in (made.at(name)[0], repr(float(value)))]  # fmt: skip
    done = subprocess.run(
        [str(WINE), "host.exe", "binaries/win64/esso_osaka_3m.dll", guid, repr(DT), *map(str, orders(made)), *given],
        input="\n".join(" ".join(f"{v!r}" for v in row) for row in run.orders.tolist()), cwd=tmp_path,
        env={"WINEPREFIX": str(tmp_path / "wine"), "WINEDEBUG": "-all", "HOME": str(tmp_path), "PATH": "/usr/bin:/bin"},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, (done.returncode, done.stderr)
    rows = np.array([[float(v) for v in line.split()] for line in done.stdout.splitlines()])
    assert_same(rows, run.states[1:])


def test_platforms_have_one_name_in_the_third_version_and_few_in_the_second() -> None:
    assert [one.folder(3) for one in chosen(("win64", "aarch64-linux"), 3)] == ["x86_64-windows", "aarch64-linux"]
    with pytest.raises(ShipError, match=r"no platform 'aarch64-linux' of FMI 2\.0 here; known: linux64"):
        chosen(("aarch64-linux",), 2)


@pytest.mark.slow
def test_a_platform_that_no_compiler_makes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(binaries, "packaged", lambda: None)
    monkeypatch.setattr(binaries, "_MINGW", "no-such-compiler")
    with pytest.raises(ShipError, match=r"no compiler for x86_64-windows; .*seatrial\[compiler\].*MinGW"):
        save_fmu(load("mariner_nomoto"), tmp_path / "a.fmu", platforms=("linux64", "win64"))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("arguments", "told"), [
    (("--platforms", "win64"), "--platforms is of the co-simulation slave: give --fmu FILE.fmu too"),
    (("--fmu", "a.fmu", "--platforms", "win32"), "--platforms: no platform 'win32' of FMI 2.0 here; known: linux64"),
])  # fmt: skip
def test_platforms_that_are_refused(
    arguments: tuple[str, ...], told: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", "mariner_nomoto", *arguments]) == 2
    err = capsys.readouterr().err
    assert told in err
    assert len(err.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
