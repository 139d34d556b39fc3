"""NMEA 2000: `layouts` reads the lines in which loggers write frames, `groups` what the frames say."""
