"""Former place of `rivals`: import from there."""

from .rivals import Rivals, judged

Shot, shot = Rivals, judged
