"""Every link and picture of README and docs leads somewhere, and README leads to every page."""

import re
import sys
from itertools import pairwise
from pathlib import Path

import pytest
from markdown_it import MarkdownIt
from markdown_it.token import Token

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.documented.clone import ROOT, pages

PAGES = pages()


def tokens(page: Path) -> list[Token]:
    return MarkdownIt("commonmark").enable("table").parse(page.read_text(encoding="utf-8"))


def links(page: Path) -> set[str]:
    """Where a page's links and pictures lead, but those to other sites."""
    inner = [child for token in tokens(page) for child in token.children or []]
    found = {str(child.attrs.get("href") or child.attrs.get("src") or "") for child in inner}
    return {link for link in found if link and not re.match(r"\w+:", link)}


def anchors(page: Path) -> set[str]:
    """The names by which GitHub links to a page's headings."""
    read = tokens(page)
    titles = [text.content for head, text in pairwise(read) if head.type == "heading_open"]
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def broken(page: Path) -> list[str]:
    """The links of a page that lead nowhere."""
    found = []
    for link in sorted(links(page)):
        name, _, anchor = link.partition("#")
        there = page.parent / name if name else page
        if not there.exists() or (anchor and anchor not in anchors(there)):
            found.append(link)
    return found


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_every_link_leads_somewhere(page: Path) -> None:
    assert broken(page) == []


def test_every_page_is_reached_from_the_readme() -> None:
    reached, ahead = set(), [ROOT / "README.md"]
    while ahead:
        page = ahead.pop().resolve()
        if page not in reached:
            reached.add(page)
            names = {link.partition("#")[0] for link in links(page)}
            ahead += [page.parent / name for name in names if name.endswith(".md")]
    assert {page.resolve() for page in PAGES} <= reached


def test_a_link_to_nowhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "there.md").write_text("# It's a `page`, of one_kind\n")
    (tmp_path / "page.md").write_text(
        "[a](there.md#its-a-page-of-one_kind) [b](there.md#page) [c](gone.md) ![d](gone.png) <https://e.org/x> [f](#g)"
    )
    assert broken(tmp_path / "page.md") == ["#g", "gone.md", "gone.png", "there.md#page"]


def test_every_picture_of_the_docs_is_shown() -> None:
    shown = {(page.parent / link).resolve() for page in PAGES for link in links(page)}
    assert {picture.resolve() for picture in (ROOT / "docs" / "pictures").rglob("*.png")} <= shown
