"""A garden of strangers: ships that no library has, known to the product by bare particulars and an ordinary log.

`ships` has forms and particulars, `logs` the trials of a day as a bridge's logger writes them, `run` does what a new
user does with three commands, nothing edited, and judges the result by the truth.  Motions are those of the independent
simulator of `garden`.
"""
