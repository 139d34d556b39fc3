"""FMUs of FMI 2.0 for co-simulation, written in C for a test: what others would put beside a ship."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import pytest

_CODE = r'''
#include <math.h>
#include <stdlib.h>
typedef void *C; typedef int S; typedef unsigned R; typedef double D;
#define TELL(name) S name(void) { return 0; }
#define PI 3.14159265358979
typedef struct { D v[64]; D kept[8]; } M;
BODY
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
C fmi2Instantiate(const char *n, int t, const char *g, const char *r, C f, int v, int l) {
  M *m = calloc(1, sizeof(M)); STARTS
  return m;
}
void fmi2FreeInstance(C c) { free(c); }
S fmi2SetupExperiment(C c, int d, D t, D s, int e, D p) { ((M *)c)->kept[7] = s; return 0; }
S fmi2EnterInitializationMode(C c) { return 0; }
S fmi2ExitInitializationMode(C c) { M *m = c; begin(m, m->v); return 0; }
S fmi2SetReal(C c, const R *r, size_t n, const D *v) {
  for (size_t k = 0; k < n; k++) ((M *)c)->v[r[k]] = v[k];
  return 0;
}
S fmi2GetReal(C c, const R *r, size_t n, D *v) {
  for (size_t k = 0; k < n; k++) v[k] = ((M *)c)->v[r[k]];
  return 0;
}
S fmi2DoStep(C c, D t, D dt, int p) { M *m = c; return step(m, m->v, t, dt); }
''' + "\n".join(f"TELL(fmi2{name})" for name in (
    "SetDebugLogging", "Terminate", "Reset", "GetInteger", "GetBoolean", "GetString", "SetInteger", "SetBoolean",
    "SetString", "GetFMUstate", "SetFMUstate", "FreeFMUstate", "SerializedFMUstateSize", "SerializeFMUstate",
    "DeSerializeFMUstate", "GetDirectionalDerivative", "SetRealInputDerivatives", "GetRealOutputDerivatives",
    "CancelStep", "GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus",
))  # fmt: skip


class Real(NamedTuple):
    """A real variable: its name, place in v[], causality, unit and start."""

    name: str
    at: int
    causality: str = "input"
    unit: str = ""
    start: float = 0.0


def fmu(folder: Path, stem: str, body: str, reals: Sequence[Real]) -> Path:
    """An FMU `stem`.fmu of C functions `begin(M *m, D *v)` and `step(M *m, D *v, D t, D dt)`, both static;

    `m->kept[7]` holds the time of the start.
    """
    pytest.importorskip("fmpy")
    gcc = shutil.which("gcc") or pytest.skip("no C compiler")
    starts = " ".join(f"m->v[{one.at}] = {one.start!r};" for one in reals)
    code = folder / f"{stem}.c"
    code.write_text(_CODE.replace("BODY", body).replace("STARTS", starts), encoding="utf-8")
    subprocess.run([gcc, "-shared", "-fPIC", "-O1", "-w", "-o", code.with_suffix(".so"), code, "-lm"], check=True)
    rows = "".join(
        f'<ScalarVariable name="{one.name}" valueReference="{one.at}" causality="{one.causality}"'
        + (' variability="fixed"' if one.causality == "parameter" else "") + "><Real"
        + (f' unit="{one.unit}"' if one.unit else "")
        + (f' start="{one.start!r}"' if one.causality != "output" else "") + "/></ScalarVariable>" for one in reals
    )  # fmt: skip
    units = "".join(f'<Unit name="{one}"/>' for one in sorted({one.unit for one in reals} - {""}))
    outputs = "".join(f'<Unknown index="{k}"/>' for k, one in enumerate(reals, 1) if one.causality == "output")
    text = (f'<?xml version="1.0"?><fmiModelDescription fmiVersion="2.0" modelName="{stem}" guid="g">'
            f'<CoSimulation modelIdentifier="{stem}"/>'
            + (f"<UnitDefinitions>{units}</UnitDefinitions>" if units else "")
            + f"<ModelVariables>{rows}</ModelVariables><ModelStructure><Outputs>{outputs}</Outputs></ModelStructure>"
            "</fmiModelDescription>")  # fmt: skip
    with zipfile.ZipFile(folder / f"{stem}.fmu", "w") as packed:
        packed.writestr("modelDescription.xml", text)
        packed.write(code.with_suffix(".so"), f"binaries/linux64/{stem}.so")
    return folder / f"{stem}.fmu"
