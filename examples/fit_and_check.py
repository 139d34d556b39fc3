"""Fit a study and read its verdicts; run from the root of the repository."""

import sys

import seatrial as st

study = st.read_study("studies/esso_osaka_mmg.toml")
fit = study.estimator.fit(study.problem)
for verdict in fit.verdicts:
    sys.stdout.write(f"{verdict.subject:20} {verdict.status:16} {verdict.text}\n")
