"""The bridge: a page in the browser on which a ship of a loop is steered by hand.

Contract: `deck.Deck` is the ship's side, without a network: it carries out the requests of named clients (`ask`) and
returns what they see (`hello`, `frame`).  `deck.Command` decides which client has command, `drill.Drill` steers a
standard manoeuvre tick by tick, `ghost.Ghost` is a measured trial shown beside the ship.  `server` connects all this
to browsers; it is the only module here that needs the extra `web`.  Data on the wire are SI and radians; the page
converts to degrees, knots and revolutions per minute.
"""
