"""Page of Wakita 2022: the study that follows its protocol, whose report has its Tables 6 to 9 beside ours.

seatrial paper wakita2022 -o PAGE.html
"""

from __future__ import annotations

from pathlib import Path

COST = "25 trainings of hours each on a processor; a killed run goes on. Have a GPU, or see studies/wakita2022.toml"
STUDY = Path(__file__).parents[1] / "wakita2022_printed.toml"
