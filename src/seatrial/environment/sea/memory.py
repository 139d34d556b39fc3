"""Memory of the waves that a moving hull leaves: a state space for added mass and damping that vary with frequency.

Cummins (1962): (M + A_inf) x'' + int K(t - s) x'(s) ds + C x = F, whose memory is, by Ogilvie (1964),

    K(i omega) = B(omega) + i omega (A(omega) - A_inf).

It is fitted as K(s) = s T(s), T(s) = sum_k (c_k s + d_k) / (s^2 + 2 a_k s + w_k^2): zero at s = 0 and, with
sum c_k = 0, of relative degree one, as it must be (Perez and Fossen 2008).  Motions that are coupled share the
denominators, found by vector fitting (Gustavsen and Semlyen 1999); the numerators are a least-squares problem under
linear conditions that keep the real part of K positive, added where it is not until it is: the memory never gives more
energy than it got.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...core.errors import WeatherError
from ...core.values import dataclass
from ...data import Array
from .hydrodynamics import Hydrodynamics
from .rao import MODES, Complex

LONGITUDINAL, LATERAL = (0, 2, 4), (1, 3, 5)
"""Motions that a hull with two equal sides couples: surge, heave, pitch; sway, roll, yaw."""

# Beyond eight sections fits follow the wiggles of irregular frequencies.
_MOST = 8
# Misfit at which no section is added, the accuracy of panel methods; and above which no memory is handed over.
_GOOD, _BAD = 0.01, 0.10
# Least damping over the greatest, where passivity is enforced: above the rounding of the eigenvalues.
_MARGIN = 1e-5
# Frequencies at which passivity is looked at: half a per cent apart over the seven or so decades.
_GRID = 4000
_FADING = 0.05
"""Least damping of a section over the critical one."""
# Poles of vector fitting settle in a few rounds; cutting planes end by themselves where nothing is cut any more.
_ROUNDS, _CUTS = 14, 80


class Misfit(NamedTuple):
    """How far a memory is from its data.

    Attributes:
        added_mass: greatest difference over the range of the added mass of the motions.
        damping: greatest difference over the greatest damping.
        retardation: difference of the retardation functions, root of its mean square over that of the function.
    """

    added_mass: float
    damping: float
    retardation: float


@dataclass(frozen=True)
class Memory:
    """Fitted memory of three coupled motions, k sections.

    Attributes:
        modes: the motions, numbers in `rao.MODES`.
        a, w: of the denominators s^2 + 2 a s + w^2 [1/s, rad/s], shape (k,).
        c, d: of the numerators c s + d, shape (k, 3, 3); zero for motions without data.
        A_inf: added mass at infinite frequency, shape (3, 3).
        misfit: against the data.
    """

    modes: tuple[int, ...]
    a: Array
    w: Array
    c: Array
    d: Array
    A_inf: Array
    misfit: Misfit

    def frequency(self, omega: Array) -> Complex:
        """T = A - A_inf + B / (i omega), shape (n, 3, 3)."""
        s = 1j * omega[:, None]
        under = 1.0 / (s * s + 2.0 * self.a * s + self.w**2)
        return np.einsum("nk,kij->nij", s * under, self.c) + np.einsum("nk,kij->nij", under, self.d)

    def added_mass(self, omega: Array) -> Array:
        """Shape (n, 3, 3)."""
        return self.A_inf + self.frequency(omega).real

    def damping(self, omega: Array) -> Array:
        """Shape (n, 3, 3)."""
        return -omega[:, None, None] * self.frequency(omega).imag

    def retardation(self, t: Array) -> Array:
        """K(t), shape (n, 3, 3)."""
        b = np.sqrt((self.w**2 - self.a**2).astype(np.complex128) + 1e-30)
        falling = np.exp(-self.a * t[:, None])
        cosine, sine = falling * np.cos(b * t[:, None]), falling * np.sin(b * t[:, None]) / b
        P = self.d - 2.0 * self.a[:, None, None] * self.c
        Q = -((self.w**2)[:, None, None]) * self.c - self.a[:, None, None] * P
        return (np.einsum("nk,kij->nij", cosine, P) + np.einsum("nk,kij->nij", sine, Q)).real


def fitted(data: Hydrodynamics, modes: tuple[int, ...], most: int = _MOST) -> Memory:
    """Memory of coupled motions with the fewest sections that come within a hundredth, `most` at most.

    Raises:
        WeatherError: too few frequencies, or none with `most` sections within a tenth.
    """
    there = tuple(k for k, mode in enumerate(modes) if mode in data.modes and data.B[:, mode, mode].max() > 0.0)
    if not there:
        raise WeatherError(f"{data.name}: no damping of {', '.join(MODES[k] for k in modes)}; compute these motions")
    best: Memory | None = None
    for sections in range(1, min(most, (data.omega.size - 2) // 2) + 1):
        one = _with(data, modes, there, sections)
        if best is None or max(one.misfit[:2]) < 0.8 * max(best.misfit[:2]):
            best = one
        if max(best.misfit[:2]) <= _GOOD:
            break
    if best is None:
        raise WeatherError(f"{data.name}: {data.omega.size} frequencies; give 8 or more")
    if max(best.misfit[:2]) > _BAD:
        off = best.misfit
        raise WeatherError(
            f"{data.name}: a memory of {', '.join(MODES[modes[k]] for k in there)} gives added mass within "
            f"{off.added_mass:.0%} and damping within {off.damping:.0%} only; remove irregular frequencies, add others"
        )
    return best


class _Problem(NamedTuple):
    """Data of coupled motions, scaled: pairs (i <= j), T of shape (n, pairs) and the weights of its two parts."""

    omega: Array
    pairs: tuple[tuple[int, int], ...]
    T: Complex
    real: Array
    imaginary: Array
    far: Array | None
    size: Array


def _posed(data: Hydrodynamics, modes: tuple[int, ...], there: tuple[int, ...]) -> _Problem:
    own = [modes[k] for k in there]
    block = np.ix_(own, own)
    A, B = (0.5 * (m + m.transpose(0, 2, 1))[:, block[0], block[1]] for m in (data.A, data.B))
    far = None if data.A_inf is None else data.A_inf[block]
    pairs = tuple((i, j) for i in range(len(own)) for j in range(i, len(own)))
    seen = A if far is None else np.concatenate([A, 0.5 * (far + far.T)[None]])
    spread = np.sqrt(np.einsum("nii->ni", np.ptp(seen, axis=0)[None])[0])
    most = np.sqrt(np.einsum("nii->ni", B).max(axis=0))
    T = np.stack([A[:, i, j] + B[:, i, j] / (1j * data.omega) for i, j in pairs], axis=-1)
    real = np.array([1.0 / max(spread[i] * spread[j], 1e-300) for i, j in pairs])
    imaginary = data.omega[:, None] / np.array([most[i] * most[j] for i, j in pairs])
    known = None if far is None else np.array([0.5 * (far[i, j] + far[j, i]) for i, j in pairs])
    return _Problem(data.omega, pairs, T, real, imaginary, known, most)


def _with(data: Hydrodynamics, modes: tuple[int, ...], there: tuple[int, ...], sections: int) -> Memory:
    problem = _posed(data, modes, there)
    a, w = _denominators(_poles(problem, 2 * sections))
    c, d, far = _numerators(problem, a, w)
    full: list[Array] = []
    for one in (c, d, far[None]):
        out = np.zeros((len(one), 3, 3))
        for e, (i, j) in enumerate(problem.pairs):
            out[:, there[i], there[j]] = out[:, there[j], there[i]] = one[:, e]
        full.append(out)
    memory = Memory(modes, a, w, full[0], full[1], full[2][0], Misfit(0.0, 0.0, 0.0))
    T = memory.frequency(problem.omega)
    found = np.stack([T[:, there[i], there[j]] for i, j in problem.pairs], axis=-1) + far
    off = problem.T - found
    misfit = Misfit(float(np.abs(off.real * problem.real).max()), float(np.abs(off.imag * problem.imaginary).max()),
                    _apart(memory, data, there))  # fmt: skip
    return Memory(modes, a, w, full[0], full[1], full[2][0], misfit)


def _apart(memory: Memory, data: Hydrodynamics, there: tuple[int, ...]) -> float:
    """Root of the mean square of the difference to (2/pi) int B cos(omega t) d omega over that, the worst motion's.

    The integral ends where the data end; what the fit has beyond is taken out of it as well.
    """
    omega = np.linspace(0.0, data.omega[-1], 1500)
    t = np.linspace(0.0, 6.0 * 2.0 * np.pi / float(memory.w.min()), 400)
    kernel = 2.0 / np.pi * (omega[1] - omega[0]) * np.cos(np.outer(t, omega))
    kernel[:, [0, -1]] *= 0.5
    own = memory.damping(omega)
    worst = 0.0
    for k in there:
        mode = memory.modes[k]
        given = np.interp(omega, np.r_[0.0, data.omega], np.r_[0.0, data.B[:, mode, mode]])
        K = kernel @ given
        worst = max(worst, float(np.linalg.norm(kernel @ own[:, k, k] - K) / np.linalg.norm(K)))
    return worst


def _basis(s: Complex, poles: Complex) -> Complex:
    """Partial fractions with real coefficients, shape (n, poles); `poles` has pairs side by side, upper half first."""
    out = np.empty((s.size, poles.size), dtype=np.complex128)
    k = 0
    while k < poles.size:
        one = 1.0 / (s - poles[k])
        if poles[k].imag == 0.0:
            out[:, k] = one
            k += 1
        else:
            other = 1.0 / (s - poles[k].conj())
            out[:, k], out[:, k + 1] = one + other, 1j * (one - other)
            k += 2
    return out


def _poles(problem: _Problem, order: int) -> Complex:
    """Common poles by vector fitting, all to the left."""
    s = (1j * problem.omega).astype(np.complex128)
    start = np.geomspace(problem.omega[0] * 1.5, problem.omega[-1] * 0.8, order // 2)
    if order == 2:
        start = np.array([np.sqrt(problem.omega[0] * problem.omega[-1])])
    poles = np.stack([-0.2 * start + 1j * start, -0.2 * start - 1j * start], axis=-1).ravel()
    count = len(problem.pairs)
    for _ in range(_ROUNDS):
        phi = _basis(s, poles)
        rows: list[Array] = []
        right: list[Array] = []
        for e in range(count):
            block = np.zeros((s.size, count * (order + 1) + order), dtype=np.complex128)
            block[:, e * (order + 1) : (e + 1) * (order + 1)] = np.column_stack([phi, np.ones_like(s)])
            block[:, count * (order + 1) :] = -phi * problem.T[:, e : e + 1]
            for part, weight in ((np.real, problem.real[e]), (np.imag, problem.imaginary[:, e : e + 1])):
                rows.append(part(block) * weight)
                right.append(part(problem.T[:, e]) * np.ravel(weight))
        matrix = np.vstack(rows)
        scale = np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        weights = np.linalg.lstsq(matrix / scale, np.concatenate(right), rcond=1e-13)[0] / scale
        poles = _moved(poles, weights[count * (order + 1) :])
    return poles


def _moved(poles: Complex, residues: Array) -> Complex:
    """Zeros of 1 + sum residues / (s - poles), mirrored to the left half plane."""
    order = poles.size
    matrix, column = np.zeros((order, order)), np.zeros(order)
    k = 0
    while k < order:
        if poles[k].imag == 0.0:
            matrix[k, k], column[k] = poles[k].real, 1.0
            k += 1
        else:
            a, b = poles[k].real, poles[k].imag
            matrix[k : k + 2, k : k + 2] = [[a, b], [-b, a]]
            column[k] = 2.0
            k += 2
    found = np.linalg.eigvals(matrix - np.outer(column, residues))
    # memory fades: what rings longer is an irregular frequency of the code, not a wave
    found = -np.maximum(np.abs(found.real), _FADING * np.abs(found)) + 1j * found.imag
    upper = sorted((p for p in found if p.imag > 1e-9 * abs(p)), key=abs)
    real = sorted((complex(min(p.real, -1e-9)) for p in found if abs(p.imag) <= 1e-9 * abs(p)), key=abs)
    pairs = [q for p in upper for q in (p, p.conjugate())]
    return np.array([*pairs, *real][:order], dtype=np.complex128)


def _denominators(poles: Complex) -> tuple[Array, Array]:
    """A and w of sections, in the order of w; real poles go together two by two."""
    upper = [p for p in poles if p.imag > 0.0]
    real = [p.real for p in poles if p.imag == 0.0]
    both = [(-p.real, abs(p)) for p in upper]
    both += [(-0.5 * (p + q), (p * q) ** 0.5) for p, q in zip(real[::2], real[1::2], strict=True)]
    both.sort(key=lambda pair: pair[1])
    return np.array([a for a, _ in both]), np.array([w for _, w in both])


def _numerators(problem: _Problem, a: Array, w: Array) -> tuple[Array, Array, Array]:
    """c, d of shape (sections, pairs) and A_inf (pairs,), by least squares with a passive result."""
    n, count = a.size, len(problem.pairs)
    size = 2 * n

    def columns(omega: Array) -> Complex:
        s = 1j * omega[:, None]
        under = 1.0 / (s * s + 2.0 * a * s + w**2)
        # sum c = 0: each c but the last is taken off the last one
        return np.concatenate([s * under[:, :-1] - s * under[:, -1:], under], axis=1)

    phi = columns(problem.omega)
    scale = np.abs(phi).max(axis=0)
    E = np.zeros((2 * problem.omega.size * count + count, size * count))
    f = np.zeros(len(E))
    for e in range(count):
        r, i = 2 * e * problem.omega.size, (2 * e + 1) * problem.omega.size
        at = slice(e * size, e * size + 2 * n - 1)
        E[r:i, at], f[r:i] = (phi / scale).real, problem.T[:, e].real
        E[r:i, e * size + 2 * n - 1] = 1.0
        weight = problem.imaginary[:, e] / problem.real[e]
        E[i : i + problem.omega.size, at] = (phi / scale).imag * weight[:, None]
        f[i : i + problem.omega.size] = problem.T[:, e].imag * weight
        E[r : i + problem.omega.size] *= problem.real[e]
        f[r : i + problem.omega.size] *= problem.real[e]
        if problem.far is not None:  # one more frequency, whose mesh is as coarse as that of the others
            E[e - count, e * size + 2 * n - 1], f[e - count] = problem.real[e], problem.far[e] * problem.real[e]
    wide = np.geomspace(1e-3 * min(problem.omega[0], w.min()), 1e3 * max(problem.omega[-1], w.max()), _GRID)
    test = -(wide[:, None] * columns(wide).imag) / scale
    x = _passive_solution(problem, E, f, wide, test, size, float(np.median(w)))
    c, d, far = np.zeros((n, count)), np.zeros((n, count)), np.zeros(count)
    for e in range(count):
        own = x[e * size : e * size + 2 * n - 1] / scale
        c[:-1, e], c[-1, e], d[:, e] = own[: n - 1], -own[: n - 1].sum(), own[n - 1 :]
        far[e] = x[e * size + 2 * n - 1]
    return c, d, far


def _passive_solution(problem: _Problem, E: Array, f: Array, wide: Array, test: Array, size: int, w: float) -> Array:
    """The least squares of Ex - f with v' B(omega) v >= a margin wherever it is not, by cutting planes."""
    pairs, each = problem.pairs, test.shape[1]
    span = len(problem.size)
    norms = np.maximum(np.linalg.norm(E, axis=0), 1e-300)
    Q, R = np.linalg.qr(np.vstack([E / norms, 1e-7 * np.eye(E.shape[1])]))
    q = Q.T @ np.r_[f, np.zeros(E.shape[1])]
    shape = (1.0 + (wide / w) ** 2) ** 2 / (wide / w) ** 2
    cuts: list[Array] = []
    x = np.linalg.solve(R, q)
    for _ in range(_CUTS):
        B = np.zeros((wide.size, span, span))
        for e, (i, j) in enumerate(pairs):
            own = x[e * size : e * size + each] / norms[e * size : e * size + each]
            B[:, i, j] = B[:, j, i] = test @ own * shape / (problem.size[i] * problem.size[j])
        values, vectors = np.linalg.eigh(B)
        low = values[:, 0]
        bad = np.flatnonzero((low < 0.5 * _MARGIN) & (low <= np.r_[low[1:], np.inf]) & (low <= np.r_[np.inf, low[:-1]]))
        if not bad.size:
            return x / norms
        for k in bad:
            v = vectors[k, :, 0] / problem.size
            cut = np.zeros(E.shape[1])
            for e, (i, j) in enumerate(pairs):
                share = (1.0 if i == j else 2.0) * v[i] * v[j] * shape[k]
                cut[e * size : e * size + each] = share * test[k]
            cuts.append(cut / norms)
        x = _bounded(R, q, np.array(cuts), np.full(len(cuts), _MARGIN))
    return x / norms


def _bounded(R: Array, q: Array, G: Array, h: Array) -> Array:
    """X of least |R x - q| with G x >= h: the least distance problem of Lawson and Hanson (1974), chapter 23."""
    from scipy.optimize import nnls

    tall = np.linalg.solve(R.T, G.T)  # columns: rows of G R^-1
    reach = h - G @ np.linalg.solve(R, q)
    size = np.maximum(np.linalg.norm(tall, axis=0), 1e-300)
    matrix: Any = np.vstack([tall / size, (reach / size)[None]])
    u, _ = nnls(matrix, np.r_[np.zeros(len(tall)), 1.0], maxiter=50 * matrix.shape[1])
    r = matrix @ u - np.r_[np.zeros(len(tall)), 1.0]
    return np.linalg.solve(R, q - r[:-1] / r[-1])
