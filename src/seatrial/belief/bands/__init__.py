"""Bands of predictions that hold: what a model lacks, learned from trials that its fits left out."""
