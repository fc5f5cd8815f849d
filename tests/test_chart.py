"""Histograms as SVG."""

import math
from xml.etree import ElementTree

import pytest
from trabecula.pictures.chart import Chart, svg, ticks

SVG = "{http://www.w3.org/2000/svg}"


def chart(share, **more):
    """A histogram with bars of 0.25 mm."""
    edges = [0.25 * i for i in range(len(share) + 1)]
    given = {"marks": [("mean", 0.375)], **more}
    return Chart("Title", "facts", "thickness, mm", "share, %", edges, share, **given)


def drawn(*charts):
    """The parts of a drawing by tag."""
    tree = ElementTree.fromstring(svg(charts))
    return {tag: list(tree.iter(SVG + tag)) for tag in ("rect", "text", "path", "title")}


def test_bars_are_as_high_as_their_shares():
    share = [0.0, 0.125, 0.5, 0.375]
    bars = drawn(chart(share))["rect"][1:]
    heights = [float(b.get("height")) for b in bars]
    assert heights == pytest.approx([h / 0.5 * heights[2] for h in share], abs=0.011)  # two digits are written
    assert all(float(b.get("y")) + float(b.get("height")) == pytest.approx(324, abs=0.011) for b in bars)
    ends = [float(b.get("x")) + float(b.get("width")) for b in bars[:-1]]
    assert ends == pytest.approx([float(b.get("x")) for b in bars[1:]], abs=0.011)


def test_text_stays_text():
    """Titles, axes with units, marks and figures of each bar; what would be markup is escaped."""
    found = drawn(chart([0.25, 0.75]), chart([1.0], marks=[("<b>", 0.1)]))
    texts = [t.text for t in found["text"]]
    assert {"Title", "facts", "thickness, mm", "share, %", "mean", "<b>", "0", "80"} <= set(texts)
    assert [t.text for t in found["title"]] == ["0 to 0.25: 25 %", "0.25 to 0.5: 75 %", "0 to 0.25: 100 %"]


def test_what_is_asked_for_is_a_line_across_its_bar():
    plain = len(drawn(chart([0.5, 0.5]))["path"])
    with_lines = drawn(chart([0.5, 0.5], asked=[0.25, math.nan]))["path"]
    (line,) = [p for p in with_lines if p.get("stroke-width")]
    assert len(with_lines) == plain + 1 and line.get("d").startswith("M76.00 ")


@pytest.mark.parametrize("share", [[0.0], [1e-30], [0.5, 0.5]])
def test_odd_figures_are_drawn(share):
    text = svg([chart(share, marks=[("far", math.inf), ("far", 1e300)])])
    ElementTree.fromstring(text)
    assert "nan" not in text and "inf" not in text


def test_ticks_are_round():
    assert ticks(0, 1.3, 8) == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4]
    assert ticks(0, 0.3, 3) == [0.0, 0.1, 0.2, 0.3]
    assert ticks(0, 47, 4) == [0.0, 20.0, 40.0, 60.0]
    assert ticks(-0.25, 0.31, 6) == [-0.3, -0.2, -0.1, 0.0, 0.1, 0.2, 0.3, 0.4]
    assert ticks(3, 3)[0] < 3 < ticks(3, 3)[-1]
