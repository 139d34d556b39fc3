"""Commands about the installation itself."""

from __future__ import annotations

from ..report.blocks import bullets, fields, table
from .outcome import FAILED
from .render import answer


def doctor(json: bool = False) -> None:
    """Check this installation: compiler, cache, extras, GPU, data."""
    from click.exceptions import Exit

    from ..workflow.installation import examine

    found = examine()
    wrong = [one for one in found if one.state == "error"]
    rows = [(one.area, one.what, one.state, one.found) for one in found]
    answer(fields({"ok": not wrong, "findings": list(map(vars, found))},
                  table(("area", "what", "", "found"), rows, words=(1, 2, 3))
                  + bullets(f"{one.what}: {one.remedy}" for one in found if one.remedy)), json)  # fmt: skip
    if wrong:
        raise Exit(FAILED)
