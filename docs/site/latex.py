"""LaTeX of the lines of code that are equations: what the reference typesets is the source itself."""

from __future__ import annotations

import ast
from collections.abc import Callable

GREEK = (
    "alpha", "beta", "gamma", "delta", "epsilon", "zeta", "eta", "theta", "kappa", "lambda", "mu", "nu", "xi", "rho",
    "sigma", "tau", "phi", "chi", "psi", "omega", "Gamma", "Delta", "Theta", "Lambda", "Sigma", "Phi", "Psi", "Omega",
)  # fmt: skip
_SUM, _PRODUCT, _SIGN, _POWER, _ATOM = range(5)
_COMPARED = {ast.Lt: "<", ast.LtE: r"\le", ast.Gt: ">", ast.GtE: r"\ge", ast.Eq: "=", ast.NotEq: r"\ne"}
_PLAIN = {"sin", "cos", "exp", "log", "tanh"}
_NO_ARITHMETIC = {"len", "tuple", "range", "isinstance", "any", "map", "zip", "dict", "list", "super", "type", "cls"}


class UnwrittenError(Exception):
    """Code that is no equation of scalars."""


def name(text: str) -> str:
    """A name of the code as a symbol: `gamma_Rp` with its subscript, `wake_factor` upright."""
    text = text.strip("_")
    base, _, below = text.partition("_")
    root = base.rstrip("0123456789")
    if len(root) > 1 and root not in GREEK and below.isalpha() and len(below) > 1:  # words, such as signed_root
        return rf"\mathrm{{{text.replace('_', '~')}}}"
    digits = base[len(root):]
    head = _letter(root)
    subscript = ",".join(part for part in (digits, *below.split("_")) if part)
    return head + (rf"_{{{_upright(subscript)}}}" if subscript else "")


def _letter(text: str) -> str:
    if text in GREEK:
        return f"\\{text}"
    return text if len(text) == 1 else rf"\mathrm{{{text}}}"


def _upright(text: str) -> str:
    parts = [f"\\{one}" if one in GREEK else rf"\mathrm{{{one}}}" if one.isalpha() and len(one) > 1 else one
             for one in text.split(",")]  # fmt: skip
    return r",".join(parts)


def equation(node: ast.expr) -> str:
    """An expression as LaTeX.

    Raises:
        UnwrittenError: it holds what is no arithmetic of scalars.
    """
    return _written(node)[0]


def _written(node: ast.expr) -> tuple[str, int]:
    """LaTeX, and how tightly it binds."""
    for kind, write in _KINDS.items():
        if isinstance(node, kind):
            return write(node)
    raise UnwrittenError(type(node).__name__)


def _in(node: ast.expr, least: int) -> str:
    """LaTeX in brackets where it binds less than what is around it."""
    text, bond = _written(node)
    return text if bond >= least else rf"\left({text}\right)"


def _constant(node: ast.Constant) -> tuple[str, int]:
    if isinstance(node.value, bool) or not isinstance(node.value, int | float):
        raise UnwrittenError("constant")
    text = f"{node.value:g}"
    if "e" in text:
        digits, _, power = text.partition("e")
        return (rf"10^{{{int(power)}}}" if digits == "1" else rf"{digits}\cdot 10^{{{int(power)}}}"), _PRODUCT
    return text, _ATOM


def _attribute(node: ast.Attribute) -> tuple[str, int]:
    """Without its owner: `flow.u` is u."""
    return name(node.attr), _ATOM


def _subscripted(node: ast.Subscript) -> tuple[str, int]:
    if isinstance(node.slice, ast.Constant) and isinstance(node.slice.value, int):
        return rf"{{{_in(node.value, _ATOM)}}}_{{[{node.slice.value}]}}", _ATOM
    raise UnwrittenError("subscript")


def _factors(node: ast.expr) -> list[ast.expr]:
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
        return [*_factors(node.left), *_factors(node.right)]
    return [node]


def _product(node: ast.BinOp) -> tuple[str, int]:
    """Equal factors that follow each other become a power."""
    parts: list[list[ast.expr]] = []
    for factor in _factors(node):
        if parts and ast.dump(parts[-1][0]) == ast.dump(factor):
            parts[-1].append(factor)
        else:
            parts.append([factor])
    texts = [_in(same[0], _PRODUCT) if len(same) == 1 else f"{_in(same[0], _ATOM)}^{{{len(same)}}}" for same in parts]
    out = texts[0]
    for text in texts[1:]:
        out += (r" \cdot " if text[0].isdigit() or text.startswith(r"\left(-") else r"\, ") + text
    return out, _PRODUCT


def _binary(node: ast.BinOp) -> tuple[str, int]:
    match node.op:
        case ast.Add():
            return f"{_in(node.left, _SUM)} + {_in(node.right, _SUM)}", _SUM
        case ast.Sub():
            return f"{_in(node.left, _SUM)} - {_in(node.right, _PRODUCT)}", _SUM
        case ast.Mult():
            return _product(node)
        case ast.Div():
            return rf"\frac{{{equation(node.left)}}}{{{equation(node.right)}}}", _PRODUCT
        case ast.Pow():
            return f"{_in(node.left, _ATOM)}^{{{equation(node.right)}}}", _POWER
        case _:
            raise UnwrittenError("operator")


def _unary(node: ast.UnaryOp) -> tuple[str, int]:
    if isinstance(node.op, ast.USub):
        return f"-{_in(node.operand, _PRODUCT)}", _SIGN if isinstance(node.operand, ast.Name) else _PRODUCT
    if isinstance(node.op, ast.Not):
        return rf"\neg {_in(node.operand, _ATOM)}", _PRODUCT
    raise UnwrittenError("operator")


def _comparison(node: ast.Compare) -> tuple[str, int]:
    out = _in(node.left, _SUM)
    for op, right in zip(node.ops, node.comparators, strict=True):
        out += f" {_COMPARED[type(op)]} {_in(right, _SUM)}" if type(op) in _COMPARED else _no("comparison")
    return out, _SUM


def _no(what: str) -> str:
    raise UnwrittenError(what)


def _choice(yes: ast.expr, condition: ast.expr, no: ast.expr) -> tuple[str, int]:
    return (rf"\begin{{cases}} {equation(yes)} & {equation(condition)} \\ {equation(no)} & \text{{otherwise}} "
            r"\end{cases}"), _ATOM  # fmt: skip


def _call(node: ast.Call) -> tuple[str, int]:
    called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    owner = node.func.value if isinstance(node.func, ast.Attribute) else None
    made = isinstance(owner, ast.Name) and owner.id[0].isupper()
    strange = node.keywords or any(isinstance(one, ast.Starred) for one in node.args)
    if made or strange or not called or called in _NO_ARITHMETIC:
        raise UnwrittenError("call")
    shaped = _SHAPES.get(called)
    if shaped:
        return shaped(*node.args)
    return _applied(name(called), node.args)


def _applied(symbol: str, args: list[ast.expr]) -> tuple[str, int]:
    return rf"{symbol}\left({', '.join(equation(one) for one in args)}\right)", _ATOM


def _named(symbol: str) -> Callable[..., tuple[str, int]]:
    return lambda *args: _applied(symbol, list(args))


_SHAPES: dict[str, Callable[..., tuple[str, int]]] = {
    **{one: _named(f"\\{one}") for one in _PLAIN},
    "atan2": _named(r"\mathrm{atan2}"), "sign": _named(r"\mathrm{sgn}"),
    "larger": _named(r"\max"), "smaller": _named(r"\min"), "float": lambda x: _written(x),
    "magnitude": lambda x: (rf"\left|{equation(x)}\right|", _ATOM),
    "abs": lambda x: (rf"\left|{equation(x)}\right|", _ATOM),
    "root": lambda x: (rf"\sqrt{{{equation(x)}}}", _ATOM), "sqrt": lambda x: (rf"\sqrt{{{equation(x)}}}", _ATOM),
    "speed": lambda u, v: (rf"\sqrt{{{_in(u, _ATOM)}^2 + {_in(v, _ATOM)}^2}}", _ATOM),
    "where": lambda condition, yes, no: _choice(yes, condition, no),
    "both": lambda a, b: (rf"{_in(a, _ATOM)} \wedge {_in(b, _ATOM)}", _SUM),
    "negated": lambda a: (rf"\neg {_in(a, _ATOM)}", _PRODUCT),
    "clip": lambda x, low, high: (rf"\left[{equation(x)}\right]_{{{equation(low)}}}^{{{equation(high)}}}", _ATOM),
    "power": lambda x, p: (rf"{_in(x, _ATOM)}^{{{equation(p)}}}", _POWER),
    "radians": lambda x: (rf"{_in(x, _PRODUCT)}\,\frac{{\pi}}{{180}}", _PRODUCT),
}  # fmt: skip
_KINDS: dict[type[ast.expr], Callable[..., tuple[str, int]]] = {
    ast.Name: lambda node: (r"\pi" if node.id == "pi" else name(node.id), _ATOM), ast.Constant: _constant,
    ast.Attribute: _attribute, ast.Subscript: _subscripted, ast.BinOp: _binary, ast.UnaryOp: _unary,
    ast.Compare: _comparison, ast.Call: _call, ast.IfExp: lambda node: _choice(node.body, node.test, node.orelse),
    ast.BoolOp: lambda node: ((r" \wedge " if isinstance(node.op, ast.And) else r" \vee ").join(
        _in(one, _ATOM) for one in node.values), _SUM),
}  # fmt: skip
