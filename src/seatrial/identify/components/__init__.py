"""Single components from their own tests: servos, thrust maps, first guesses."""
