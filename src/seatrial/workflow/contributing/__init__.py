"""Whether a contributed ship file is fit for the library."""

from .ship_check import Checked as Checked
from .ship_check import Finding as Finding
from .ship_check import check_ship_file as check_ship_file
