"""The documentation site: equations typeset from the source, pages for all that the package offers."""

from __future__ import annotations

import ast
import importlib
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from house import REPOSITORY

SITE = REPOSITORY / "docs" / "site"


@pytest.fixture(autouse=True)
def tools(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(SITE))


@pytest.mark.parametrize(
    ("code", "latex"),
    [
        ("a * a * b", r"a^{2}\, b"),
        ("(a + b) * c", r"\left(a + b\right)\, c"),
        ("a - (b - c)", r"a - \left(b - c\right)"),
        ("-(1.0 - t_R) * F_N", r"-\left(1 - t_{R}\right)\, F_{N}"),
        ("a / (b * c)", r"\frac{a}{b\, c}"),
        ("self.gamma_Rp * flow.u", r"\gamma_{\mathrm{Rp}}\, u"),
        ("root(magnitude(x))", r"\sqrt{\left|x\right|}"),
        ("(a / b) ** 2", r"\left(\frac{a}{b}\right)^{2}"),
        ("where(u < 0, -a, a)", r"\begin{cases} -a & u < 0 \\ a & \text{otherwise} \end{cases}"),
        ("speed(u, v_m)", r"\sqrt{u^2 + v_{m}^2}"),
        ("1e-6 * delta", r"10^{-6}\, \delta"),
    ],
)
def test_code_is_typeset_as_the_arithmetic_that_it_is(code: str, latex: str) -> None:
    written = importlib.import_module("latex").equation(ast.parse(code, mode="eval").body)
    assert written == latex


@pytest.mark.parametrize("code", ["[x for x in y]", "f(*args)", "f(x=1)", "'text'", "len(y)", "Case(x).of(y)[k]"])
def test_what_is_no_arithmetic_is_left_out(code: str) -> None:
    latex = importlib.import_module("latex")
    with pytest.raises(latex.UnwrittenError):
        latex.equation(ast.parse(code, mode="eval").body)


def test_an_equation_stands_beside_its_line_and_its_source() -> None:
    found = importlib.import_module("equations").equations(importlib.import_module("seatrial.forces.rudder"))
    (line,) = (line for one in found if one.title == "on_hull" for line in one.lines if line.latex.startswith("Y ="))
    source = (REPOSITORY / "src/seatrial/forces/rudder.py").read_text(encoding="utf-8").splitlines()
    assert line.latex == r"Y = -\left(1 + a_{H}\right)\, \mathrm{across}"
    assert source[line.number - 1].strip().startswith("-(1.0 + a_H) * across")
    assert line.comment == "Sawada 2024 (49), misprint corrected"


@pytest.mark.slow
def test_every_force_and_family_has_a_page_with_equations(tmp_path: Path) -> None:
    parts = importlib.import_module("parts")
    without: list[str] = []
    for room in parts.ROOMS:
        folder = tmp_path / room.name
        folder.mkdir()
        for name in parts.write(room, folder):
            if room.name == "forces" and "$$" not in (folder / f"{name}.md").read_text(encoding="utf-8"):
                without.append(name)
    assert without == ["rudder_neutral"]  # an angle added to another rudder's


def test_every_command_has_a_page_with_its_options(tmp_path: Path) -> None:
    names = importlib.import_module("commands").write(tmp_path)
    assert {"identify", "campaign", "doctor"} <= set(names)
    text = (tmp_path / "simulate.md").read_text(encoding="utf-8")
    assert "`--wind`" in text
    assert "| `SHIP` | Name a ship" in text
    pages = {name: (tmp_path / f"{name}.md").read_text(encoding="utf-8") for name in names}
    assert [name for name, page in pages.items() if re.search("(?i)unset|sentinel|<[a-z]+ object", page)] == []
    assert re.search(r"\| `--rate` \|.*\| `10.0` \|", pages["twin"])


def test_every_command_has_a_manual_page_with_its_options(tmp_path: Path) -> None:
    """Hyphens of options are minus signs, as they are typed; nothing of a help begins a request of troff."""
    commands = importlib.import_module("seatrial.cli.app").app.whole()
    importlib.import_module("man").write(tmp_path)
    whole = (tmp_path / "seatrial.1").read_text(encoding="utf-8")
    for name, command in commands.items():
        assert f"seatrial\\-{name}".replace("-map", "\\-map") in whole
        page = (tmp_path / f"seatrial-{name}.1").read_text(encoding="utf-8")
        assert all(one.replace("-", "\\-") in page for option in command.params for one in option.opts if "-" in one)
        requests = {line.partition(" ")[0] for line in page.splitlines() if line.startswith((".", "'"))}
        assert requests <= {".TH", ".SH", ".TP"}


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("groff") is None, reason="groff is not installed")
def test_manual_pages_are_typeset_without_a_warning(tmp_path: Path) -> None:
    man = importlib.import_module("man")
    pages = [str(one) for one in man.write(tmp_path)]
    done = subprocess.run(["groff", "-man", "-ww", "-K", "utf8", "-T", "utf8", *pages], capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    plain = re.sub("\x1b\\[[0-9;]*m|.\b", "", done.stdout)
    assert "--mapping PATH" in plain
    assert "-o, --out PATH" in plain
    assert man.roff(".a\\b-c\n'd") == "\\&.a\\eb\\-c\n\\&'d"


def test_dead_links_and_requests_to_elsewhere_are_found(tmp_path: Path) -> None:
    links = importlib.import_module("links")
    (tmp_path / "a.html").write_text(
        '<p id="here"><a href="b.html#there">x</a><a href="#here">x</a><a href="c.html">x</a>'
        '<script src="https://elsewhere.example/x.js"></script><a href="https://elsewhere.example">x</a></p>',
        encoding="utf-8",
    )
    (tmp_path / "b.html").write_text("<p>", encoding="utf-8")
    assert list(links.faults(tmp_path)) == [
        "a.html: asks https://elsewhere.example/x.js", "a.html: b.html#there: no such place on the page",
        "a.html: c.html: no such file",
    ]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("name", "commands", "held"), [
    ("kvlcc2_l7", ["turning --rudder 35", "zigzag --rudder 10 --heading 10"],
     "advance, turning rudder 35, side starboard"),
    ("otter", ["turning --steer 50", "zigzag --heading 10 --steer 30"], "final speed, acceleration rps 16.54"),
    ("mariner_nomoto", ["turning --rudder 35", "zigzag --rudder 10 --heading 10"], ""),
])  # fmt: skip
def test_the_page_of_a_ship_has_the_commands_of_its_figures_and_what_they_are_held_against(
    tmp_path: Path, name: str, commands: list[str], held: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Run as printed, the command gives the advance of the page; each published figure stands beside the model's."""
    from seatrial.cli.app import main

    ships, generate = (importlib.import_module(one) for one in ("ships", "generate"))
    page = ships.page(name, ships._runs(name), tmp_path)
    found = re.findall(rf"`(seatrial simulate {name} [^`]+)`", page)
    assert found == [f"seatrial simulate {name} {one}" for one in commands]
    assert generate._command(page) == f"`{found[0]}`"
    assert main([*found[0].split()[1:], "--json"]) == 0
    advance = json.loads(capsys.readouterr().out)["indices"]["advance"]["value"]
    assert f"| advance | {advance:.4g} | m |" in page
    assert ("unverified" in page) == (not held)
    row = r"^\| (.*) \| (?:code|trial|model test) \| ([\d.]+) \S+ \| ([\d.]+) \S+ \| ([\d.]+) % \|$"
    rows = re.findall(row, page, re.MULTILINE)
    assert any(one[0] == held for one in rows) == bool(held)
    for what, said, ours, within in rows:
        assert float(ours) == pytest.approx(float(said), rel=1.01 * float(within) / 100.0), what


def test_versions_are_the_tags_of_releases_the_newest_first() -> None:
    released = importlib.import_module("whole").released
    assert released("v0.9.2\nv0.10.0\nnightly v1.0 v0.2.0rc1\nv0.3.0") == ["0.10.0", "0.9.2", "0.3.0"]


def test_pages_are_printed_in_the_order_in_which_they_follow_each_other(tmp_path: Path) -> None:
    whole = importlib.import_module("whole")
    (tmp_path / "b").mkdir()
    for name, after in (("index.html", "b/one.html"), ("b/one.html", "../two.html"), ("two.html", "b/one.html")):
        (tmp_path / name).write_text(
            f'<title>About {name[0]} &amp; so \N{EM DASH} site</title><link rel="next" title="x" href="{after}" />')
    pages = whole.following(tmp_path)
    assert pages == [tmp_path.resolve() / name for name in ("index.html", "b/one.html", "two.html")]
    assert whole.title(pages[0]) == "About i & so"


def test_each_page_links_to_the_other_versions_from_where_it_lies() -> None:
    template = pytest.importorskip("jinja2").Template((SITE / "versions.html").read_text(encoding="utf-8"))
    page = template.render(versions=["latest", "0.3.0", "0.2.0"], content_root="../")
    assert re.findall(r'href="([^"]+)"', page) == ["../../0.3.0/index.html", "../../0.2.0/index.html"]
    assert re.search("<summary>(.*)</summary>", page)[1] == "latest"


def test_tools_of_the_site_shadow_no_module() -> None:
    assert not {path.stem for path in SITE.glob("*.py")} & set(sys.stdlib_module_names)
