"""Real-time simulation: ships that are steered while they run.

Contract: a `plant.Plant` is ship, actuators and environment as one compiled step, the same that `simulate` runs; its
controls are ordered by name and any value is read by name.  `loop.Loop` steps several plants on a schedule without
drift, takes orders from any thread, clips and reports them, and counts late ticks.  `recording.Recording` writes a
trial file that is valid at any moment, with the orders in a second file, from which `recording.rerun` reproduces the
run bit for bit.  `afloat.afloat` is the one way to let a `range.scenario.Scenario` run, with a page, a wire, links and
a recording or without.  `on_wire.OnWire` connects a ship to NMEA 0183; `range` has traffic, faults, alarms and
criteria, `links` the wire and other protocols; `bridge`, `fit_page` and `twin.page` are pages, served by `pages`
(extra `web`).
"""
