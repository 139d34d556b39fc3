"""Logs of robots: MCAP files and bags of ROS 2.

Contract: `files.opened` gives the messages of a file and what seatrial noted in it, `write_mcap` and `write_bag` write
messages; `trial.read` makes a `Trial` of them, by the `Topics` of a mapping file where the log leaves a choice.
`messages` has the standard messages and the change of axes.  All of it needs the extra ``log``, and without it raises
`DataError`.
"""
