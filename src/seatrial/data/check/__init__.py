"""Faults of trials: findings with numbers, and a remedy for each.

Contract: `check(trial)` gives every `Finding` of one trial, `check_set(train, test)` the recordings that two sets
share.  A finding has its severity, kind, trials and channels as fields; its sentences are for people.  Each check is a
function of a trial that yields `Fault`.  Thresholds are set such that the 35 files of FRT-DS-ESSO and the SIMMAN 2008
files, read rightly, give no error, and each known fault of a public log does (tests/data/test_check.py).
"""

from .findings import Finding, Severity, check, check_folder, check_set
from .sensors import Fault, Kind

__all__ = ["Fault", "Finding", "Kind", "Severity", "check", "check_folder", "check_set"]
