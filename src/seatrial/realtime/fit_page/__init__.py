"""The live page of a running fit, served by `realtime.pages`.

Contract: a fit writes its progress to a `board.Board` and never waits; the page reads from the board what it has not
shown yet.  Nothing here changes a fit.
"""
