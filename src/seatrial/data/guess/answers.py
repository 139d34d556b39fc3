"""Answers of the guess, with their evidence and their doubts, and how they stand in a mapping file."""

from __future__ import annotations

from collections.abc import Sequence

from ...core.values import dataclass, field
from ..mapping.checked import ASK

DOUBT = "DOUBT:"
"""Begins every doubt in the comments of a guessed mapping; nothing else there does."""


@dataclass(frozen=True)
class Answer:
    """What was found about one thing.

    Attributes:
        evidence: what in the log shows it.
        doubts: what may be otherwise, and what to write then.
    """

    evidence: str
    doubts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Entry:
    """Lines of a mapping file: a table or a key, with the comment above it.

    Attributes:
        table: name of the table, such as "channels.psi"; empty for keys at the top.
        keys: and their values, as TOML.
        answer: why.
    """

    table: str
    keys: dict[str, str]
    answer: Answer = field(default_factory=lambda: Answer(""))

    @property
    def asked(self) -> tuple[str, ...]:
        """Keys that a person has to answer before the import can run."""
        return tuple(key for key, value in self.keys.items() if quoted(ASK) in value)


def quoted(text: str) -> str:
    """A text as TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t").replace("\n", " ")
    return f'"{escaped}"'


def listed(items: Sequence[str]) -> str:
    """Texts as a list of TOML."""
    return f"[{', '.join(map(quoted, items))}]"


def text_of(head: Sequence[str], entries: Sequence[Entry]) -> str:
    """A mapping file: comments at its head, then each entry under its evidence and doubts."""
    lines = [*(f"# {line}" if line else "" for line in head), ""]
    for entry in sorted(entries, key=lambda one: bool(one.table)):
        if entry.table:
            lines.append("")
        lines += [f"# {entry.answer.evidence}"] * bool(entry.answer.evidence)
        lines += [f"# {DOUBT} {doubt}" for doubt in entry.answer.doubts]
        if entry.table:
            lines.append(f"[{entry.table}]")
        lines += [f"{key} = {value}" for key, value in entry.keys.items()]
    return "\n".join(lines) + "\n"
