"""Equations of a module with the lines that implement them, read from its source."""

from __future__ import annotations

import ast
import inspect
import io
import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from types import ModuleType

from latex import UnwrittenError, equation, name

# What the fields of a returned tuple are called.
_RETURNED = {"Force": ("X", "Y", "N"), "Slipstream": ("u_P", "K_T_nD2")}


@dataclass(frozen=True)
class Line:
    """An equation: its LaTeX, the number of its line, and the comment at its end, which is its source."""

    latex: str
    number: int
    comment: str


@dataclass(frozen=True)
class Function:
    """Equations of one function or method."""

    title: str
    about: str
    lines: tuple[Line, ...]


def equations(module: ModuleType, only: Sequence[str] = ()) -> tuple[Function, ...]:
    """Every function and method of a module that holds equations, in the order of the source; `only` these methods."""
    source = inspect.getsource(module)
    comments = _comments(source)
    found: list[Function] = []
    for title, node in _functions(ast.parse(source)):
        if only and node.name not in only:
            continue
        lines = tuple(_lines(node, comments))
        if lines:
            about = (ast.get_docstring(node) or "").partition("\n\n")[0]
            found.append(Function(title, " ".join(about.split()), lines))
    return tuple(found)


def _comments(source: str) -> dict[int, str]:
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    text = {token.start[0]: token.string.lstrip("# ") for token in tokens if token.type == tokenize.COMMENT}
    return {line: said for line, said in text.items() if not said.startswith(("fmt:", "type:", "noqa", "pyright:"))}


def _functions(tree: ast.Module) -> Iterator[tuple[str, ast.FunctionDef]]:
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.ClassDef):
            yield from ((f"{node.name}.{one.name}", one) for one in node.body if isinstance(one, ast.FunctionDef))


def _lines(function: ast.FunctionDef, comments: dict[int, str]) -> Iterator[Line]:
    for node in function.body:
        for left, right in _sides(node, function):
            if isinstance(right, ast.Name | ast.Attribute | ast.Constant):
                continue  # another name for the same thing
            try:
                text = f"{left} = {equation(right)}" if left else equation(right)
            except UnwrittenError:
                continue
            last = right.end_lineno or right.lineno
            said = comments.get(last, comments.get(right.lineno, ""))
            yield Line(text, right.lineno, said)


def _sides(node: ast.stmt, function: ast.FunctionDef) -> Iterator[tuple[str, ast.expr]]:
    """Left side in LaTeX and right side of each equation that a statement holds."""
    match node:
        case ast.Assign(targets=[ast.Name(id=target)], value=value):
            yield name(target), value
        case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)) if len(targets) == len(values):
            yield from ((name(one.id), value) for one, value in zip(targets, values, strict=True)
                        if isinstance(one, ast.Name))  # fmt: skip
        case ast.Return(value=ast.Call(func=ast.Attribute(attr="rates"), args=[ast.Tuple(elts=values)])):
            rates = zip(("u_r", "v_r", "r"), values, strict=False)
            yield from ((rf"\dot{{{name(symbol)}}}", one) for symbol, one in rates)
        case ast.Return(value=ast.Call(func=ast.Name(id=made), args=args)) if made in _RETURNED and len(
            _RETURNED[made]
        ) == len(args):
            yield from ((name(symbol), one) for symbol, one in zip(_RETURNED[made], args, strict=True))
        case ast.Return(value=ast.Tuple(elts=values)):
            yield from (("", value) for value in values if not _trivial(value))
        case ast.Return(value=value) if value is not None and not _trivial(value):
            yield _left(function), value
        case _:
            return


def _left(function: ast.FunctionDef) -> str:
    taken = [one.arg for one in function.args.args if one.arg not in ("self", "cls", "flow")]
    return rf"{name(function.name)}\left({', '.join(map(name, taken))}\right)" if taken else name(function.name)


def _trivial(value: ast.expr) -> bool:
    return isinstance(value, ast.Name | ast.Constant | ast.Attribute | ast.Lambda)


def written(functions: Sequence[Function], path: str) -> str:
    """Equations in Markdown, each with its line and source."""
    parts: list[str] = []
    for function in functions:
        parts.append(f"\n**`{function.title}`**" + (f" {literal(function.about)}" if function.about else "") + "\n")
        for line in function.lines:
            source = f", {literal(line.comment)}" if line.comment else ""
            parts.append(f"\n$$\n{line.latex}\n$$\n\n{{.line}}\n`{path}:{line.number}`{source}\n")
    return "".join(parts)


def literal(text: str) -> str:
    """Text of a docstring in Markdown: what would be markup is escaped outside code."""
    parts = text.replace("``", "`").split("`")
    for k in range(0, len(parts), 2):
        for mark in ("\\", "*", "<", "[", "$"):
            parts[k] = parts[k].replace(mark, f"\\{mark}")
    return "`".join(parts)
