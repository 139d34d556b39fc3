"""Live links of a stage: the wire of NMEA 0183, Signal K and rosbridge at the server of the page, NMEA 2000 on a bus.

Contract: `wiring` is the wire as it is asked for, opened and logged.  The other links tell what the instruments of the
own ship say, never more; their orders become sentences of NMEA 0183 (`orders`) and pass the command of the wire like
any other, so one commander, one lease and one handover are valid for all.
"""
