"""A study written for a ship and a folder of trials.

`held_out` chooses whole recordings that no fit sees, `draft` what is free and how errors are weighed, `text` writes it
down with the reasons.
"""
