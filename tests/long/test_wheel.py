"""The wheel in a fresh environment outside the checkout: what a user installs has all that its commands need."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

from house import REPOSITORY
from seatrial.cli.app import app

pytestmark = pytest.mark.long
COMMANDS = sorted(app.whole())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    made = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(REPOSITORY)]
    subprocess.run(made, check=True)
    (found,) = folder.glob("seatrial-*.whl")
    return found


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("fresh")
    venv.create(folder, with_pip=True)
    interpreter = folder / "bin" / "python"
    subprocess.run([interpreter, "-m", "pip", "install", "--quiet", str(wheel)], check=True)
    subprocess.run([interpreter, "-m", "pip", "check"], check=True)
    return interpreter


def run(python: Path, place: Path, *words: str, **extra: str) -> subprocess.CompletedProcess[str]:
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "SEATRIAL"))}
    command = [str(python.parent / "seatrial"), *words]
    return subprocess.run(command, cwd=place, env={**clean, **extra}, capture_output=True, text=True, check=False)


def test_a_wheel_holds_the_package_and_no_measurement(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert "seatrial/ships/kvlcc2.toml" in names
    assert "seatrial/engine/rollout.c" in names
    assert not [name for name in names if name.split("/")[0] not in ("seatrial",) and ".dist-info/" not in name]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_is_there(python: Path, tmp_path: Path, name: str) -> None:
    ran = run(python, tmp_path, name, "--help")
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize("compiler", ["gcc", "none"])
def test_the_first_things_that_a_user_does(python: Path, tmp_path: Path, compiler: str) -> None:
    given = {} if compiler == "gcc" else {"SEATRIAL_CC": "none"}
    ran = run(python, tmp_path, "doctor", "--json", **given)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    found = {one["what"]: one["state"] for one in json.loads(ran.stdout)["findings"]}
    assert found["required"] == "ok"
    assert found["neural"] == "note"
    ran = run(python, tmp_path, "simulate", "kvlcc2_l7", "zigzag", "--json", "-o", "run.csv", **given)
    assert ran.returncode == 0, ran.stderr
    assert 3.0 < json.loads(ran.stdout)["indices"]["first_overshoot"]["value"] < 15.0
    assert len([line for line in ran.stderr.splitlines() if "virtual machine" in line]) == (compiler == "none")
    for words in (("check", "run.csv"), ("export", "kvlcc2_l7", "--c", "plant"), ("trials", ".")):
        ran = run(python, tmp_path, *words, **given)
        assert ran.returncode in (0, 1), ran.stderr
        assert "Traceback" not in ran.stderr


def test_the_demo_and_a_campaign_from_the_wheel(python: Path, tmp_path: Path) -> None:
    ran = run(python, tmp_path, "demo", "-o", "demo")
    assert ran.returncode == 0, ran.stderr
    assert (tmp_path / "demo" / "report.html").stat().st_size > 10_000
    (tmp_path / "c.toml").write_text(
        'schema = "seatrial-campaign/1"\nships = ["kvlcc2_l7"]\nruns = 64\n[manoeuvre]\nkind = "zigzag"\n'
        '[inputs]\n"ship.hull.Y_v" = { uniform = [0.9, 1.1], factor = true }\n',
        encoding="utf-8",
    )
    ran = run(python, tmp_path, "campaign", "c.toml", "-o", "runs")
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize(("words", "extra"), [(("bridge", "kvlcc2", "--port", "0"), "web")])
def test_a_missing_extra_is_named_with_the_command_that_installs_it(
    python: Path, tmp_path: Path, words: tuple[str, ...], extra: str
) -> None:
    ran = run(python, tmp_path, *words)
    assert ran.returncode == 2
    assert f"seatrial[{extra}]" in ran.stderr
    assert len(ran.stderr.splitlines()) == 1
