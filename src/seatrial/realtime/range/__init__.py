"""The test range: a scenario with traffic, weather over time, faults, alarms and criteria, around a ship of a loop.

Contract: a `scenario.Scenario` is the value of a file (`schema` has its keys); `stage.Stage` puts it into a loop with
the own ship "own".  Each part acts once a tick and is saved, restored and reset with the loop: `sky` is the weather,
`pilots` steer the others, and the own ship where nobody else does, `faults` come between orders and gear and between
instruments and their readers, `contacts` are bearing, distance and nearest approach of the others, `wakes` the tracks
of all, `alerts` what is to be acknowledged, `handover` who steers, `judge` the indices and criteria of the run.
`reports` sends contacts and alarms as sentences.  `encounter` makes a scenario of a meeting of ships.
"""
