"""Votes, tables and a reading of the page for the tests of the report."""

from html.parser import HTMLParser

import numpy as np
import pandas as pd
from matplotlib.image import imread

import analysis

PAPER = (1, 10)
PICTURES = ("mos", "votes", "observers", "scale_use", "flagged", "contrasts")
MARK = "SIMULATED VOTES"


def make_votes(contents=("city", "landscape"), methods=("none", "bilinear"), observers=18):
    """Votes of a test like the paper's, with hidden references."""
    random = np.random.default_rng(1)
    rows = []
    for content in contents:
        conditions = [(n, d, 0) for n in ("awgn", "sd") for d in methods] + [("", "", None)]
        for noise, demosaic, level in conditions:
            name = f"{content}__{noise}__{demosaic}" if noise else f"{content}-ref"
            kind = "test" if noise else "reference"
            expected = 7.5 - 2 * (demosaic != "none") if noise else 9.5
            votes = np.clip(np.rint(random.normal(expected, 1.2, observers)), 1, 10)
            rows += [
                (f"s{o}", name, content, noise, demosaic, level, kind, vote)
                for o, vote in enumerate(votes, 1)
            ]
    columns = ["observer", "stimulus", "content", "noise", "demosaic", "level", "kind", "vote"]
    return pd.DataFrame(rows, columns=columns)


def report(folder, votes, scale=PAPER, name="report"):
    file = folder / "votes.csv"
    analysis.write_votes(votes, file)
    analysis.write_report(file, folder / name, scale)
    return folder / name


def page(out):
    return (out / "report.html").read_text()


class Page(HTMLParser):
    """Checks that elements nest, and gathers captions and the text of the remarks."""

    VOID = ("meta", "img", "br")

    def __init__(self, text):
        super().__init__()
        self.open, self.captions, self.shown, self.remarks = [], [], 0, ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in self.VOID:
            self.open.append((tag, dict(attrs).get("class", "")))
        self.shown += tag == "figure" or (tag == "table" and "id" in dict(attrs))
        if tag in ("caption", "figcaption"):
            self.captions.append("")

    def handle_endtag(self, tag):
        assert self.open.pop()[0] == tag

    def handle_data(self, data):
        tags = [tag for tag, _ in self.open]
        if "caption" in tags or "figcaption" in tags:
            self.captions[-1] += data
        if ("section", "remarks") in self.open:
            self.remarks += data


def marks_in_figure(out):
    """Texts of the SVG (matplotlib writes each as a comment), and red pixels of the PNG."""
    svg = (out / "mos.svg").read_text()
    red, green, blue = np.moveaxis(imread(out / "mos.png")[..., :3], -1, 0)
    strong = (red > 0.6) & (green < 0.1) & (blue < 0.2)
    pale = (red > 0.9) & (green > 0.85) & (green < 0.95) & (red - green > 0.05)
    return svg.count(MARK), int(strong.sum()), int(pale.sum())


def table(rows, **columns):
    """Votes from one list per stimulus, in the order of the observers."""
    return pd.DataFrame(
        [(f"o{o}", f"s{s}", vote) for s, row in enumerate(rows) for o, vote in enumerate(row)],
        columns=["observer", "stimulus", "vote"],
    ).assign(**columns)
