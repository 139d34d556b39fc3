"""The face for scripts and notebooks: the values of the house with verbs and pictures, behind `import seatrial as st`.

Contract: a `Ship`, `Trial`, `Problem` and `Fit` of this room *is* the value of the same name of its own room (a
subclass without state of its own, or with one more field), so every function of the package takes it; a method only
calls a function of a room to the left.  Angles are in degrees where a name ends in `_deg`, else everything is SI and
radians.  What is a table prints as one, shows as one in a notebook, and is handed to any library of data frames
(`tables.Tabular`); what is drawn is drawn on axes of the caller, or on new ones (`plots`).

Import the names from `seatrial` itself, which loads each when it is first asked for.
"""
