"""The run of a study of shooting with a rival: what `identify` does where the truth is virtual."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import __version__
from ..identify import StudyError
from ..study.study import Study
from .page import Watch
from .support import claimed, emit, figure, fitting, note, say, show_table

PAGE = "report.html"


def is_shot(study: Study) -> bool:
    """Whether the study is one of this kind: made trials, a rival, and trials that are kept back."""
    return study.virtual is not None and bool(study.rival)


def shoot(study: Study, out: Path, as_json: bool, watch: Watch) -> None:
    """Lint, fit the model and its rival in every weather, save the model, report; a finished run is only told about."""
    from ..identify.lint import lines, lint, raise_on_errors
    from ..identify.posterior.verdicts import overruled
    from ..report.shooting import write
    from ..study.store import kept, save_fit
    from ..validate.shooting_cases import shot

    if study.virtual is None or not study.test:
        raise StudyError(f"{study.path}: [rival] is judged on trials kept back, of a truth that is known; name some in "
                         "data.test, of [virtual]")  # fmt: skip
    issues = lint(study.problem, study.test, study.estimator)
    raise_on_errors(issues)
    for line in (*study.notes, *lines(issues)):
        note(line)
    fresh, done = claimed(out, PAGE, study.digest, study.name)
    if not done:
        with kept(out, fresh), fitting(study.path, ""):
            note(f"fitting {len(study.problem.free)} parameters")
            fit = overruled(study.estimator.fit(study.problem, progress=watch.alone(study, None)), study.unidentified)
            watch.found(fit)
            note(f"{fit.status}; the rival, and both in other weathers")
            found = shot(study, fit, study.virtual)
        save_fit(fit, out, study.problem, study=study.name, text=study.path.read_text(encoding="utf-8"))
        write(out / PAGE, found, provenance={
            "study": str(study.path), "digest": study.digest, "version": f"seatrial {__version__}",
            "truth": f"{study.virtual.ship.name}, seed {study.virtual.seed}",
            "command": f"seatrial identify {study.path} -o {out}",
        })  # fmt: skip
    _tell(json.loads((out / PAGE).with_suffix(".json").read_text(encoding="utf-8")), out, as_json)


def _tell(found: Mapping[str, Any], out: Path, as_json: bool) -> None:
    if as_json:
        emit({**found, "run": str(out)})
        return
    rows: list[tuple[str, ...]] = []
    for name, case in found["cases"].items():
        off = max(abs(z) for z in case["sigmas_off"].values())
        for who, score in case["scores"].items():
            errors = (_percent(score["relative"][v]) for v in ("u", "v_m", "r"))
            beyond = max(case["model_over_truth"].values()) if who == "full" else None
            rows.append((name, _who(case, who), *errors, "" if beyond is None else figure(beyond),
                         figure(off) if who == "full" else ""))  # fmt: skip
    head = ("weather", "model", "surge", "sway", "yaw", "50 steps / truth", "sigma off at most")
    show_table(head, rows, right=(2, 3, 4, 5, 6))
    for name, servo in found["servos"].items():
        say(f"{name}: {figure(servo['rate'], 5)} rad/s +- {figure(servo['sigma']['rate'], 2)}\n")
    say(f"wrote {out}/model.toml, {out}/{PAGE}\n")


def _who(case: Mapping[str, Any], who: str) -> str:
    return f"{len(case['fits'][who]['parameters'])} parameters" if who in case["fits"] else who


def _percent(share: float | None) -> str:
    return "blows up" if share is None else f"{figure(100.0 * share)} %"
