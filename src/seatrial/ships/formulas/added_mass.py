"""Added masses and moments of inertia."""

from __future__ import annotations

import math

from . import Formula, Particulars


def twentieth(ship: Particulars) -> dict[str, float]:
    """m_x = 0.05 m."""
    return {"body.m_x": 0.05 * ship.m}


def motora(ship: Particulars) -> dict[str, float]:
    """Charts of Motora as fitted by Zhou et al. 1983."""
    C_b, B, d, L, m = ship.C_b, ship.B, ship.d, ship.L_pp, ship.m
    dL = d * L / (B * B)
    sway = (
        0.882 - 0.54 * C_b * (1 - 1.6 * d / B) - 0.156 * (1 - 0.673 * C_b) * L / B
        + 0.826 * dL * (1 - 0.678 * d / B) - 0.638 * C_b * dL * (1 - 0.669 * d / B)
    )  # fmt: skip
    radius = 0.01 * (33 - 76.85 * C_b * (1 - 0.784 * C_b) + 3.43 * L / B * (1 - 0.63 * C_b))
    return {"body.m_y": m * sway, "body.J_z": m * radius * radius}


def soeding(ship: Particulars) -> dict[str, float]:
    """Surge: 2.7 rho volume^(5/3)/L^2 (Soeding 1982)."""
    return {"body.m_x": 2.7 * ship.volume ** (5 / 3) / ship.L_pp**2 / (0.5 * ship.L_pp**2 * ship.d)}


def clarke(ship: Particulars) -> dict[str, float]:
    """Accelerations of Clarke, Gedling and Hine 1983; theirs are over 0.5 rho L^3, ours over 0.5 rho L^2 d."""
    B_L, B_d = ship.B / ship.L_pp, ship.B / ship.d
    scale = 0.5 * math.pi * ship.k  # pi (d/L)^2 L/d
    return {
        "body.m_y": scale * (1 + 0.16 * ship.C_b * B_d - 5.1 * B_L * B_L),
        "body.J_z": scale * (1 / 12 + 0.017 * ship.C_b * B_d - 0.33 * B_L),
    }


FORMULAS = (
    Formula(name="0.05 m", source="a twentieth of the mass, as in MANSIM and mmgdynamics dynamics.py", gives=twentieth),
    Formula(
        name="Motora (Zhou 1983)",
        source="zhou1983 fit of Motora's charts, as in MANSIM and mmgdynamics dynamics.py",
        gives=motora,
    ),
    Formula(name="Soeding 1982", source="soeding1982, as coded in MSS addedMassSurge.m @736a3d1", gives=soeding),
    Formula(name="Clarke 1983", source="clarke1983, as coded in MSS clarke83.m @736a3d1", gives=clarke),
)
"""Formulas for added masses, the first that the particulars allow is used."""
