"""Studies: TOML files that name ship, data, freedom and estimator, and the folders of their runs."""
