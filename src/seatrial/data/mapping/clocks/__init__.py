"""Times of rows: the calendar, how times are written, and the stamps of a table by its clock.

Contract: `stamps.stamps` gives the time of each row of a table, `stamps.moment` that of a text a person wrote.
"""

from .stamps import NEVER, Stamps, moment, stamps

__all__ = ["NEVER", "Stamps", "moment", "stamps"]
