"""A damaged checkpoint is set aside with a word, and the fit begins anew."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from seatrial.identify.networks.training import Stand
from seatrial.identify.population.evolution import Record
from seatrial.identify.resume import Resume
from seatrial.identify.trajectory.gauss_newton import State


def resume(path: Path) -> bytes:
    kept = Resume(path, "me", 0.0)
    kept.states[0] = State(np.ones(2), np.zeros(0), 1.0, 1e-3, 1, 1, "")
    kept.write()
    return path.read_bytes()


def stand(path: Path) -> bytes:
    Stand().write(path, "me")
    return path.read_bytes()


@pytest.mark.parametrize(
    ("write", "read"),
    [(resume, lambda path: Resume.open(path, "me", 0.0).states), (stand, lambda path: Stand.read(path, "me").seed)],
    ids=["fit", "training"],
)  # fmt: skip
def test_a_damaged_checkpoint_is_set_aside(
    write: Callable[[Path], bytes], read: Callable[[Path], object], tmp_path: Path
) -> None:
    path = tmp_path / "checkpoint.npz"
    whole = write(path)
    middle = len(whole) // 3
    for content in (b"", b"\x00" * 64, whole[:100], whole[:-30], whole[:middle] + b"\xff\xff" + whole[middle + 2 :]):
        path.write_bytes(content)
        with pytest.warns(UserWarning, match=r"checkpoint\.npz: is damaged; set aside as checkpoint\.npz\.damaged"):
            assert not read(path)
        assert [p.name for p in tmp_path.iterdir()] == ["checkpoint.npz.damaged"]
    path.write_bytes(whole)
    read(path)


def test_a_damaged_record_of_generations_is_set_aside(tmp_path: Path) -> None:
    path = tmp_path / "checkpoint.bin"
    path.write_bytes(b"\xff" * 200)
    with pytest.warns(UserWarning, match="is damaged"), Record.open(path, "me") as record:
        assert record.old.size == 0
    assert path.read_bytes() == b'{"digest": "me"}\n'
