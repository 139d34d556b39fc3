"""Differences of the first formula of each number from the published sets of KVLCC2 and KCS.

Root mean square of the two differences, in the units of the package's contract; tests/ships/test_estimate.py
computes them anew from tests/golden/regression.toml.  R_0 is compared at the scale of the models, where the
published numbers were measured.  f_alpha is left out: the published ones are Fujii's formula.
"""

from __future__ import annotations

SCATTER = {
    "body.m_x": 0.00556, "body.m_y": 0.000872, "body.J_z": 0.000283, "propeller.t_P": 0.0184,
    "hull.Y_v": 0.0757, "hull.N_v": 0.0131, "hull.N_r": 0.00446, "hull.Y_r": 0.00705, "hull.X_vv": 0.0249,
    "hull.X_vr": 0.0208, "hull.X_rr": 0.0194, "hull.X_vvvv": 0.595, "hull.Y_vvv": 0.0956, "hull.Y_vvr": 0.82,
    "hull.Y_vrr": 0.054, "hull.Y_rrr": 0.0529, "hull.N_vvv": 0.0562, "hull.N_vvr": 0.169, "hull.N_vrr": 0.0367,
    "hull.N_rrr": 0.0059, "propeller.w_P0": 0.0563, "propeller.C_2p": 0.0496, "propeller.C_2n": 0.45,
    "propeller.k_0": 0.0308, "propeller.k_1": 0.0876, "propeller.k_2": 0.051, "rudder.t_R": 0.0934,
    "rudder.epsilon": 0.0107, "rudder.kappa": 0.0348, "rudder.l_R": 0.169, "rudder.gamma_Rp": 0.182,
    "rudder.gamma_Rn": 0.0343, "rudder.a_H": 0.0807, "rudder.x_H": 0.014, "propeller.x_P": 0.0235,
    "hull.R_0": 0.00391,
}  # fmt: skip
