"""What can go wrong, how it shows, and which of it is named."""
