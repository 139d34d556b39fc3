"""Encounters of ships: their tracks, and the rules of the road as checks on them."""

from .tracks import Tracks as Tracks
