"""The page of a live twin.

Contract: the twin writes pictures to a `screen.Screen` and never waits; `realtime.pages` shows them to browsers.
"""
