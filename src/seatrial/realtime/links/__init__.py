"""Live links of a stage beside NMEA 0183: Signal K and rosbridge at the server of the page, NMEA 2000 on a CAN bus.

Contract: a link tells what the instruments of the own ship say, never more; orders of a link become sentences of
NMEA 0183 (`orders`) and pass the command of the wire like any other, so one commander, one lease and one handover are
valid for all.
"""

__all__: list[str] = []
