"""NMEA 0183 (IEC 61162-1): sentences, frames, and what they say of a ship."""
