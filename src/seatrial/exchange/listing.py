"""A CasADi function as statements of another language, single-use terms drawn into the line that uses them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from ..core.symbolic import Function
from ..core.values import dataclass, field
from ..engine.csource import BINARY, CALL, opcodes
from ..ships import ShipError

Place = tuple[int, int]
"""An input or output, and one of its elements."""


_FORMS = {
    "OP_ASSIGN": "{0}", "OP_NEG": "-{0}", "OP_SQ": "{0} * {0}", "OP_TWICE": "2.0 * {0}", "OP_INV": "1.0 / {0}",
    "OP_LT": "{0} < {1}", "OP_LE": "{0} <= {1}", "OP_EQ": "{0} == {1}", "OP_NE": "{0} != {1}",
}  # fmt: skip


@dataclass(frozen=True)
class Language:
    """How one language writes what CasADi computes.

    Attributes:
        forms: text by operation, operands as {0} and {1}; sums, calls and comparisons are the same in all.
        nan, infinity: names of what is no number and of what is beyond all.
        width: the longest term that is drawn into the line that uses it.
    """

    forms: Mapping[str, str]
    nan: str
    infinity: str
    width: int = 88

    def constant(self, value: float) -> str:
        """A number, in parentheses below zero."""
        if math.isnan(value):
            return self.nan
        text = repr(value).replace("inf", self.infinity)
        return text if value >= 0 else f"({text})"

    def form(self, op: str) -> str:
        """The text of an operation.

        Raises:
            ShipError: one that no model has needed yet.
        """
        if op in BINARY:
            return f"{{0}} {BINARY[op]} {{1}}"
        if op in CALL:
            return f"{CALL[op]}({{0}}, {{1}})" if CALL[op] in ("atan2", "pow") else f"{CALL[op]}({{0}})"
        form = _FORMS.get(op) or self.forms.get(op)
        if form is None:
            raise ShipError(f"the model computes {op}, which has no form in the exported language; export it by CasADi")
        return form


@dataclass
class Listing:
    """The statements of a function: (name, expression) in order, and the expression of each output."""

    statements: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    outputs: dict[Place, str] = field(default_factory=dict[Place, str])
    reads: set[Place] = field(default_factory=set[Place])


# How tightly an operation holds its operands together, and what it asks of the left and the right one.
_LOOSE, _SUM, _PRODUCT, _ATOM = range(4)
_HOLDS = {"OP_ADD": _SUM, "OP_SUB": _SUM, "OP_MUL": _PRODUCT, "OP_DIV": _PRODUCT}


@dataclass
class _Node:
    """One value: an operation on others, or a leaf whose text stands."""

    op: str
    of: list[int]
    text: str = ""
    holds: int = _ATOM
    uses: int = 0

    def within(self, asked: int) -> str:
        """The text as an operand; in parentheses where it would fall apart."""
        return self.text if self.holds >= asked else f"({self.text})"


def listing(f: Function, leaf: Callable[[int, int], str], language: Language) -> Listing:
    """The statements of `f`.

    Args:
        f: a CasADi function of scalars (SX).
        leaf: the text of an element of an input.
        language: how to write it.
    """
    found = Listing()
    nodes, outputs = _nodes(f, leaf, language, found)
    for node in nodes:
        if node.of:
            node.text, node.holds = _term(node, nodes, language, found)
    for place, k in outputs:
        found.outputs[place] = nodes[k].text
    return found


def _nodes(
    f: Any, leaf: Callable[[int, int], str], language: Language, found: Listing
) -> tuple[list[_Node], list[tuple[Place, int]]]:
    """Values in the order in which they are computed, each with the number of times it is read."""
    nodes: list[_Node] = []
    at: dict[int, int] = {}
    outputs: list[tuple[Place, int]] = []
    for k in range(f.n_instructions()):
        op, to, of = opcodes()[f.instruction_id(k)], f.instruction_output(k), f.instruction_input(k)
        if op == "OP_OUTPUT":
            outputs.append(((to[0], to[1]), at[of[0]]))
            nodes[at[of[0]]].uses += 1
            continue
        if op == "OP_INPUT":
            found.reads.add((of[0], of[1]))
            nodes.append(_Node(op, [], leaf(of[0], of[1])))
        elif op == "OP_CONST":
            nodes.append(_Node(op, [], language.constant(f.instruction_constant(k))))
        else:
            operands, form = [at[i] for i in of], language.form(op)
            for position, operand in enumerate(operands):
                nodes[operand].uses += form.count(f"{{{position}}}")
            nodes.append(_Node(op, operands))
        at[to[0]] = len(nodes) - 1
    return nodes, outputs


def _term(node: _Node, nodes: list[_Node], language: Language, found: Listing) -> tuple[str, int]:
    """How the value is read, its own term or the name of a statement, and how tightly that holds together."""
    holds = _ATOM if node.op in CALL else _HOLDS.get(node.op, _LOOSE)
    asked = _LOOSE if node.op in CALL else _HOLDS.get(node.op, _ATOM)
    # a - (b - c) and a * (b * c) keep their parentheses: floating-point sums depend on the order.
    operands = [nodes[i].within(asked + (k > 0 and asked in (_SUM, _PRODUCT))) for k, i in enumerate(node.of)]
    text = language.form(node.op).format(*operands)
    if node.uses <= 1 and len(text) <= language.width:
        return text, holds
    name = f"w{len(found.statements)}"
    found.statements.append((name, text))
    return name, _ATOM
