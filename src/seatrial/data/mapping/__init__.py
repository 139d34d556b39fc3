"""Any table as trials, by a mapping file: which column is what, in which unit, by which clock.

Contract: `checked.read_mapping` gives a `schema.Mapping`, checked before any log is read; `reading.read` gives the
trials of one recording by it, `recordings.recordings` the recordings below a folder.  `tables` opens a file as named
columns, `numbers` makes numbers of them and `clocks` times; `joining` puts series with times of their own on common
rows; `places` makes positions, speeds, wind and heading out of what instruments give.  Every error says in one line
which file, column and row is wrong.
"""
