"""Studies: TOML files that name ship, data, free parameters and estimator, and the folders of their runs.

Contract: `study.read_study` returns a frozen `Study` (a `Problem`, an `Estimator`, the trials kept back);
`series.read_series` returns a frozen `Series` of cells, each a problem of its own.  `store` saves a fit and reads what
it saved, `series_run` says which cells are done; nothing here fits.
"""

__all__: list[str] = []
