"""Report of a table of fits: the page, the publication beside it, and errors over the seconds of training."""

from .judged import covered as covered
from .judged import page as page
from .judged import seeds as seeds
from .judged import validation as validation
