"""A garden of planted faults: logs of an independent simulator, each folder with one fault whose culprit is known.

`ships` has the equations and the numbers, `motion` integrates manoeuvres, `logs` turns motions into logs with sensor
noise and writes folders, `faults` plants, `run` does what a user does (import, check, identify) and notes what was
said.  Nothing here uses the physics of the package under test: equations and numbers are typed from the papers.
"""
