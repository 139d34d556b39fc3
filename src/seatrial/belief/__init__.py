"""What a fit leaves open: its posterior, one law of draws, and what trials left out of it say."""
