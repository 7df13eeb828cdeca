"""Tables of masts as spreadsheets and survey offices write them: each is read rightly or refused clearly."""

import tomllib
import warnings
from pathlib import Path

import pytest

from panto_env import InputError
from panto_env.base.errors import UnusualWarning
from panto_env.catalog.loader import parse_catenary
from panto_env.catalog.masts import line_from_masts

GERMAN = {
    "position": "Kilometrierung",
    "contact_height": "Fahrdrahthöhe",
    "messenger_height": "Tragseilhöhe",
    "mast": "Mast-Nr.",
    "stagger": "Seitenlage",
    "radius": "Halbmesser",
}
EXCEL = """Oberleitungsplan Strecke 5520;;;;;
Stand:;12.03.2021;;;;
;;;;;
Mast-Nr.;Kilometrierung [km];Fahrdrahthöhe [m];Tragseilhöhe [m];Seitenlage [mm];Halbmesser [m]
17-1;17,3000;5,30;7,10;300;
17-3;17,3650;5,30;7,10;-300;
17-5;17,4250;5,28;7,08;300;1200
17-7;17,4800;5,25;6,85;-300;1200
;;;;;
17-9;17,5450;5,30;7,10;;
"""
HEADINGS = "mast,position (m),contact height (m),encumbrance (m)"


def line_of(tmp_path, content, headings=None, units=None):
    path = tmp_path / "masts.csv"
    path.write_bytes(content)
    text = line_from_masts("re250", path, units, headings)
    return parse_catenary(tomllib.loads(text), Path("mine.toml"))


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-8", "utf-8-sig"])
def test_a_german_spreadsheet_is_read_in_every_encoding(encoding, tmp_path):
    """Preamble, comma decimals, umlauts, an empty row, headings of its own, empty cells."""
    line = line_of(tmp_path, EXCEL.replace("\n", "\r\n").encode(encoding), GERMAN)
    layout = line.layout()
    spans, heights, encumbrances = layout.spans, layout.contact_heights, layout.encumbrances
    assert [span.span_length for span in spans] == pytest.approx([65, 60, 55, 65])
    assert heights == pytest.approx((0, 0, -0.02, -0.05, 0))
    assert encumbrances == pytest.approx((1.8, 1.8, 1.8, 1.6, 1.8))
    assert [mast.name for mast in line.masts] == ["17-1", "17-3", "17-5", "17-7", "17-9"]
    assert [mast.chainage for mast in line.masts] == [17300, 17365, 17425, 17480, 17545]
    assert [mast.stagger for mast in line.masts] == [0.3, -0.3, 0.3, -0.3, None]
    assert [mast.radius for mast in line.masts] == [None, None, 1200, 1200, None]
    layout = line.alignment()
    assert layout.span_name(2) == "2 (17-3, 17+365.0)"
    assert layout.span_name(9) == "9"  # beyond the surveyed ones


READ = {
    "kilometres and metres": (
        "Mast;Chainage;Encumbrance (m)\n"
        "M1;km 12+300.0;1.8\nM2;12+365.5;1.8\nM3;12+420.0;1.8\nM4;12+480;1.8\n",
        [65.5, 54.5, 60.0], [12300, 12365.5, 12420, 12480],
    ),
    "kilometres and metres with commas": (
        "mast;position;encumbrance (m)\nA;12,3+00,0;1,8\nB;12,3+65,5;1,8\nC;12,4+20;1,8\nD;12,4+80;1,8\n"
        .replace(";", "\t"),
        [65.5, 54.5, 60.0], [12300, 12365.5, 12420, 12480],
    ),
    "surveyed against the travel": (
        f"{HEADINGS}\nM4,845.0,5.3,1.8\nM3,780.0,5.3,1.8\nM2,720.5,5.3,1.8\nM1,660.5,5.3,1.8\n",
        [65.0, 59.5, 60.0], [845, 780, 720.5, 660.5],
    ),
    "millimetres in a row of units": (
        "mast,position,contact_height,messenger_height,stagger\n,mm,mm,mm,mm\n"
        "1,100000,5300,7100,200\n2,165000,5300,7100,-200\n3,230000,5300,7100,200\n4,290000,5300,7100,-200\n",
        [65.0, 65.0, 60.0], [100, 165, 230, 290],
    ),
}  # fmt: skip
"""Content, lengths of spans (m) and chainages (m)."""


@pytest.mark.parametrize("name", READ)
def test_files_that_are_read(name, tmp_path):
    content, lengths, chainages = READ[name]
    line = line_of(tmp_path, content.encode())
    assert line.alignment().lengths == pytest.approx(lengths)
    assert [mast.chainage for mast in line.masts] == chainages
    assert line.masts[0].name


ROWS = "M1,0,5.3,1.8\nM2,65,5.3,1.8\nM3,130,5.3,1.8\nM4,190,5.3,1.8\n"
REFUSED = {
    "millimetres without a unit": (
        f"{HEADINGS.replace('encumbrance (m)', 'encumbrance')}\n{ROWS.replace('1.8', '1800')}",
        r"^Mast 1 of .*masts\.csv \(line 2, M1\), .*unit: key 'encumbrance' must be a number from 0.05 to 10",
    ),
    "a height of another mast": (
        f"{HEADINGS}\n{ROWS.replace('M3,130,5.3', 'M3,130,53')}",
        r"^Mast 3 of .*\(line 4, M3\).* key 'contact_height' must be a number from -2 to 2 m \(given: 47.7\)",
    ),
    "an empty cell": (f"{HEADINGS}\n{ROWS.replace('65,5.3', '65,')}", "^Line 3 of .*contact_height is empty"),
    "chainage that turns": (
        f"{HEADINGS}\n{ROWS.replace('130', '30')}",
        r"^Mast 3 of .* \(line 4, M3\) stands no farther than the one before; sort them",
    ),
    "a sum below": (f"{HEADINGS}\n{ROWS}Total,,,\n", "^Line 6 of .*: column position is empty"),
    "a stagger in centimetres": (
        f"{HEADINGS},stagger\n" + ROWS.replace("1.8", "1.8,30"),
        r"^Mast 1 of .*\(line 2, M1\): key 'stagger' must be a number from -1 to 1 m \(given: 30.0\)",
    ),
    "headings that nobody named": (
        EXCEL, r"needs either a column position .* give --column position=HEADING\.$"
    ),
    "a workbook": ("PK\3\4\x14\0\6\0\x08", "it is not text; give a CSV file"),
    "nothing": ("", "is empty; give a CSV file with a header"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_files_that_are_refused(name, tmp_path):
    content, message = REFUSED[name]
    with pytest.raises(InputError, match=message) as caught:
        line_of(tmp_path, content.encode())
    assert "mine.toml" not in str(caught.value)  # not the file that would be written


def test_what_is_ignored_is_said_and_what_is_unknown_refused(tmp_path):
    with pytest.warns(UnusualWarning, match=r"masts\.csv that are ignored: remark\.$"):
        line_of(tmp_path, f"{HEADINGS},remark\n{ROWS.replace('1.8', '1.8,signal')}".encode())
    with warnings.catch_warnings(action="error"):
        line_of(tmp_path, f"{HEADINGS}\n{ROWS}".encode())
    with pytest.raises(InputError, match=r"has no column contact_height \(its header: Mast-Nr\."):
        line_of(tmp_path, EXCEL.encode("cp1252"), GERMAN | {"contact_height": "Höhe"})
    with pytest.raises(InputError, match="Heading of unknown column 'height': did you mean"):
        line_of(tmp_path, EXCEL.encode("cp1252"), {"height": "Fahrdrahthöhe"})
