"""In the harbour: contact with fenders, walls and mooring lines, and the energy of a berthing.

Contract: contact is no force of the flow but a pair of impulses around each step of the motion (`contact.Contact`), and
`energy` is design practice, by hand.
"""
