"""The bridge: a page on which a ship of the loop is steered by hand.

Contract: `deck.Deck` is the ship's side, without a network: it takes requests of clients by name (`ask`), says what
they see (`hello`, `frame`) and knows nothing of how they came.  `command.Command` says which of them has command,
`drill.Drill` steers a standard manoeuvre tick by tick, `ghost.Ghost` is a measured trial that sails beside.
`server` brings all this to a browser: the only module that needs the extra `web`.  What goes over the wire is SI and
radians; degrees, knots and revolutions a minute are made on the page.
"""
