"""A page on this machine for a folder of logs: what is in it, and the commands that take it to a model (extra `web`).

The files on the disk are the state.  Each action runs one command of the command line in the folder, in a process of
its own, and shows that command, so that what was done by mouse can be done again by a shell; nothing is computed here
and nothing is kept in the page.
"""
