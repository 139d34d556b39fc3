"""A page that shows a fit while it runs.

Contract: a fit writes to a `Board` as it goes on, and never waits; a page reads from it what it has not
shown yet.  Nothing here changes a fit.
"""
