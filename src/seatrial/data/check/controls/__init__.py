"""Checks of controls against the motion: rudders, azimuths, shafts."""
