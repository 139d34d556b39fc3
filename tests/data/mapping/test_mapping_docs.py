"""The page on data shows every key of a mapping, in examples that can be read."""

from __future__ import annotations

import re
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from seatrial.data.mapping.checked import read_mapping
from seatrial.data.mapping.schema import Mapping

PAGE = (Path(__file__).parents[3] / "docs" / "data.md").read_text(encoding="utf-8")
EXAMPLES = re.findall(r'```toml\n(schema = "seatrial-mapping/1"\n.*?)```', PAGE, re.DOTALL)


def keys(kind: type[Any]) -> set[str]:
    """Every key that the dataclass of a file has, at any depth."""
    found: set[str] = set()
    for one in fields(kind):
        found.add(str(one.metadata.get("key", one.name)))
        hint = get_type_hints(kind)[one.name]
        for part in (hint, *get_args(hint), *(inner for option in get_args(hint) for inner in get_args(option))):
            if is_dataclass(part):
                found |= keys(part)  # type: ignore[arg-type]
    return found


@pytest.mark.parametrize("text", EXAMPLES)
def test_an_example_is_a_mapping(tmp_path: Path, text: str) -> None:
    (tmp_path / "m.toml").write_text(text, encoding="utf-8")
    assert isinstance(read_mapping(tmp_path / "m.toml"), Mapping)


def test_every_key_has_an_example() -> None:
    section = PAGE[PAGE.index("## Any table as trials") : PAGE.index("## Is a trial sound?")]
    absent = [key for key in sorted(keys(Mapping)) if not re.search(rf"\b{key}\b", section)]
    assert not absent


CLOCKS = re.findall(r"^\| `([^`]*=.*?)` \|", PAGE[: PAGE.index("### Positions")], re.MULTILINE)


@pytest.mark.parametrize("cells", CLOCKS)
def test_every_clock_is_one(tmp_path: Path, cells: str) -> None:
    if cells.startswith("time ="):
        return
    (tmp_path / "m.toml").write_text(
        f'schema = "seatrial-mapping/1"\ntime = {{ {cells} }}\n[channels.psi]\ncolumn = "HDG"\nunit = "deg"\n'
    )
    assert read_mapping(tmp_path / "m.toml").time
