"""Pages that judge: ships by requirements or IMO criteria, models by their use, data by coverage, captive tests."""
