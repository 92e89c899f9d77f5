"""The report: one page that needs nothing else, and tells what happened."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

from clients.simulator.encounter import Encounter, Verdict
from clients.simulator.report import ALL_SHOWN, WORST, EpisodeRecord, write_json, write_report


class Page(HTMLParser):
    """Collects what a browser would fetch, the text, and unclosed elements."""

    VOID = frozenset({"meta", "img", "br", "link", "input", "hr", "circle", "line", "path", "rect"})

    def __init__(self, html: str) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.links: list[str] = []
        self.ids: list[str] = []
        self.text = ""
        self.open: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        for name, value in attrs:
            if name in {"src", "srcset", "data", "action", "poster"} or (tag, name) == ("link", "href"):
                self.sources.append(value or "")
            elif name == "href":
                self.links.append(value or "")
            elif name == "id":
                self.ids.append(value or "")

    def handle_endtag(self, tag: str) -> None:
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_the_report_is_one_page_that_fetches_nothing(record: EpisodeRecord, tmp_path: Path) -> None:
    path = tmp_path / "out" / "report.html"
    write_report(record, path)
    html = path.read_text()
    page = Page(html)
    assert page.open == []
    assert page.sources
    assert all(source.startswith("data:image/jpeg;base64,") for source in page.sources)
    assert all(link.startswith("#") and link[1:] in page.ids for link in page.links)
    assert not re.search(r"url\(|@import|https?://|<script", html)


def test_the_report_shows_every_encounter_with_its_pictures(record: EpisodeRecord, tmp_path: Path) -> None:
    path = tmp_path / "report.html"
    write_report(record, path)
    page = Page(path.read_text())
    text = " ".join(page.text.split())
    assert [each for each in page.ids if each.startswith("encounter")] == ["encounter-1", "encounter-2", "encounter-3"]
    for index, encounter in enumerate(record.encounters):
        pictures = record.pictures[index]
        assert encounter.name in text
        assert (pictures.correspondences is None) == (encounter.verdict is not Verdict.RECOGNISED)
        assert (pictures.scanned is None) == (encounter.learnt is None)
    assert "false novel: its category was in the memory" in text
    assert "recognised as car" in text
    assert "centre is off is said of the object itself, not of the box" in text


def test_a_long_episode_shows_its_charts_and_what_went_worst(record: EpisodeRecord, tmp_path: Path) -> None:
    many = [replace(record.encounters[0], number=number) for number in range(1, ALL_SHOWN + 1)]
    wrong = replace(next(each for each in record.encounters if each.verdict is Verdict.FALSE_NOVEL), number=ALL_SHOWN + 1)
    encounters = [*many, wrong]
    pictures = dict.fromkeys(range(len(encounters)), record.pictures[0])
    write_report(replace(record, encounters=encounters, pictures=pictures), tmp_path / "report.html")
    page = Page((tmp_path / "report.html").read_text())
    shown = [each for each in page.ids if each.startswith("encounter")]
    assert len(shown) == WORST
    assert shown[0] == f"encounter-{ALL_SHOWN + 1}"
    for chart in ("Taken for what", "against the threshold", "Rotation errors", "Time of an answer"):
        assert chart in page.text


def test_failures_and_foreign_text_are_shown_as_text(record: EpisodeRecord, tmp_path: Path) -> None:
    failed: list[Encounter] = [replace(each, failure="<b>no pose</b>") for each in record.encounters]
    write_report(replace(record, encounters=failed), tmp_path / "report.html")
    assert "&lt;b&gt;no pose&lt;/b&gt;" in (tmp_path / "report.html").read_text()


def test_the_json_has_the_summary_and_a_row_an_encounter(record: EpisodeRecord, tmp_path: Path) -> None:
    write_json(record, tmp_path / "episode.json")
    written = json.loads((tmp_path / "episode.json").read_text())
    assert written["summary"]["objects"] == len(written["rows"]) == 3
    recognised = next(row for row in written["rows"] if row["outcome"] == "known")
    assert recognised["error"]["rotation_deg"] < 10
    assert written["meta"]["seed"] == 1
