"""The live twin: a filter that follows a ship on its own log, forecasts, and names what goes wrong.

Contract: a `live.Live` takes one row of a log after the other, from whatever source; it never waits and never looks
ahead.  `settings` has what it assumes, `follow` the filter, `suspects` what the innovations would look like under each
fault, `alarms` which of them is named, `ahead` the forecasts, `saved` its state and what it has learnt.
"""
