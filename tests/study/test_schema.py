"""A misspelt key or a value of another type is told in one line, wherever in a document it stands."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

import pytest

from seatrial.campaign.schema import CampaignFile
from seatrial.core.records import filled
from seatrial.identify import StudyError
from seatrial.realtime.range.schema import ScenarioFile
from seatrial.study.schema import Published, SeriesFile, StudyFile

FILES = (StudyFile, SeriesFile, Published, CampaignFile, ScenarioFile)
WRONG = "no key of any table"


def _with_wrong_keys(kind: Any) -> Iterator[Any]:
    """Values of a type that are right but for one unknown key, for each table below it and each way there."""
    if is_dataclass(kind):
        yield {WRONG: 1}
        hints = get_type_hints(kind)
        for one in fields(kind):
            key = one.metadata.get("key", one.name)
            yield from ({key: below} for below in _with_wrong_keys(hints[one.name]))
        return
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        for one in inner:
            yield from _with_wrong_keys(one)
    elif origin in (list, tuple):
        yield from ([below] for below in _with_wrong_keys(inner[0]))
    elif origin is dict:
        yield from ({"some": below} for below in _with_wrong_keys(inner[1]))


def _keys(document: Any) -> Iterator[str]:
    """The keys and places that lead to the wrong one."""
    while document != 1:
        step = 0 if isinstance(document, list) else next(iter(document))
        yield str(step)
        document = document[step]


@pytest.mark.parametrize("schema", FILES)
def test_an_unknown_key_is_named_with_its_place_in_every_table(schema: type[Any]) -> None:
    documents = list(_with_wrong_keys(schema))
    assert documents
    for document in documents:
        with pytest.raises(StudyError) as caught:
            filled(schema, document, "a.toml", StudyError)
        text = str(caught.value)
        place = ".".join(_keys(document))
        assert text.startswith(f"a.toml: {place}: no key '{WRONG}'; known: "), text
        assert "\n" not in text


@pytest.mark.parametrize(("document", "told"), [
    ({"manoeuvre": {"kind": "turn", "rudr": 3}}, "manoeuvre.rudr: no key 'rudr'; near: rudder"),
    ({"manoeuvre": [{"kind": "turn"}, {"kind": "turn", "rudr": 3}]}, "manoeuvre.1.rudr: no key 'rudr'; near: rudder"),
    ({"manoeuvre": [{"rudder": 3}]}, "manoeuvre.0.kind is missing"),
    ({"manoeuvre": {"rudder": 3}}, "manoeuvre.kind is missing"),
    ({"manoeuvre": [{"kind": "turn", "rudder": "x"}]}, "manoeuvre.0.rudder is 'x'; it must be a finite number above 0"),
    ({"manoeuvre": 3}, "manoeuvre is 3; it must be a table or a list"),
    ({"manoeuvre": {"kind": "turn"}, "inputs": {"U_T": {"within": [1, 2, 3]}}},
     "inputs.U_T.within is [1, 2, 3]; it must be a list of 2"),
])  # fmt: skip
def test_of_several_kinds_of_table_the_one_that_stands_there_is_judged(document: dict[str, Any], told: str) -> None:
    with pytest.raises(StudyError) as caught:
        filled(CampaignFile, {"ships": ["kvlcc2"], "runs": 1, **document}, "a.toml", StudyError)
    assert told in str(caught.value)


def test_what_a_message_repeats_of_a_document_is_one_short_line() -> None:
    for document in ({"a\nb" + 300 * "c": 1}, {"title": ["\n" * 5000]}):
        with pytest.raises(StudyError) as caught:
            filled(CampaignFile, document, "a.toml", StudyError)
        text = str(caught.value)
        assert "\n" not in text
        assert len(text) < 600
