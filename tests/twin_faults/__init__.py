"""Faults of instruments, gear and surroundings, planted in logs of an independent simulator, for the live twin.

`python -m twin_faults.run` prints the table; the truth is of `garden` and `strangers`, integrated in `passage`.
"""
