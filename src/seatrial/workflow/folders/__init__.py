"""What a folder of recordings is for: a survey of it (`survey`), and a first study (`drafting`)."""
