"""Tests of a fit by its residuals: noise, instruments, trials against each other; and what the verdicts owe to them."""
