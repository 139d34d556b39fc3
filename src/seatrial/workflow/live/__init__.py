"""Commands that follow a ship while it sails."""
