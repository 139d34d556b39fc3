"""Reports: self-contained pages and the same numbers as JSON."""
