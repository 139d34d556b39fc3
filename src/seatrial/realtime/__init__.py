"""Real time: a ship that one steers while she sails.

Contract: a `plant.Plant` is ship, actuators and surroundings as one compiled step, the same that `simulate` runs;
whoever has it orders controls by name, steps it and reads any value by name.  `loop.Loop` steps several of them on
a schedule that does not drift, takes orders from any thread, clips and reports them, and counts what comes late.
`recording.Recording` writes what happened as a trial file that is valid at any moment, and the orders beside it, from
which `rerun.rerun` makes the same run bit for bit.
"""
