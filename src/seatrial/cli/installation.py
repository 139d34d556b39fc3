"""Commands about the installation itself."""

from __future__ import annotations

from ..report.blocks import table
from .outcome import FAILED
from .render import emit, say_lines, show


def doctor(json: bool = False) -> None:
    """Check this installation: compiler, cache, extras, GPU, data."""
    from click.exceptions import Exit

    from ..workflow.installation import examine

    found = examine()
    wrong = [one for one in found if one.state == "error"]
    if json:
        emit({"ok": not wrong, "findings": [{"area": one.area, "what": one.what, "state": one.state,
              "found": one.found, "remedy": one.remedy} for one in found]})  # fmt: skip
    else:
        show(table(("area", "what", "", "found"), [(one.area, one.what, one.state, one.found) for one in found],
                   words=(1, 2, 3)))  # fmt: skip
        say_lines(*(f"{one.what}: {one.remedy}" for one in found if one.remedy))
    if wrong:
        raise Exit(FAILED)
