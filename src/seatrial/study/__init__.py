"""Studies: TOML files that name ship, data, free parameters and estimator, and the folders of their runs.

Contract: `study.read_study` returns a frozen `Study` (a `Problem`, an `Estimator`, the trials kept back), and
`series.read_series` a frozen `Series` of models on the same tests.  Both are tables of cells (`cells.Cell`), a study of
one: a fit in a folder of its own, which says whether it is done.  `store` saves a fit and reads what it saved; nothing
here fits.
"""

MODEL, SUMMARY = "model.toml", "fit.json"
"""Files of a fit: the ship, and what is told of it; named here, as who only asks for them needs no more."""
