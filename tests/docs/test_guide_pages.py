"""The built guide opens without a network."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
GALLERY = sorted(
    page.stem for page in (ROOT / "docs" / "gallery").glob("*.md") if page.stem != "index"
)
# Beside what a page names itself: what a script or a style of it would load.
ASKED = re.compile(
    r"""@import|url\(["']?(?:https?:)?//|requirejs|mathjax[./@-]|cdn[.]|unpkg""", re.I
)
LOADED = re.compile(r"""<(?:script|img|iframe|link)[^>]*(?:src|href)=["'](?:https?:)?//""")


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the text of every built page by its name."""
    for name in ("sphinx", "numpydoc", "myst_nb", "pydata_sphinx_theme", "latex2mathml"):
        pytest.importorskip(name, reason="the extra docs is not installed")
    folder = tmp_path_factory.mktemp("guide")
    subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "-q", str(ROOT / "docs"), str(folder)], check=True
    )
    return {page.name: page.read_text(encoding="utf-8") for page in folder.rglob("*.html")}


@pytest.mark.slow
@pytest.mark.xdist_group("guide")
def test_built_pages_load_nothing_from_a_network(pages: dict[str, str]) -> None:
    assert pages
    for name, text in pages.items():
        assert not LOADED.search(text), name
        assert not ASKED.search(text), name


@pytest.mark.slow
@pytest.mark.xdist_group("guide")
@pytest.mark.parametrize("page", ["install", "paper", "design-file", "requirements", "gate"])
def test_the_sidebar_of_a_page_leads_to_all_others(pages: dict[str, str], page: str) -> None:
    (sidebar,) = re.findall(r'<nav class="bd-docs-nav.*?</nav>', pages[f"{page}.html"], re.S)
    for other in ("install", "data-sheet", "study-file", "requirements", "gate", "slewctl"):
        assert f"{other}.html" in sidebar or other == page


@pytest.mark.slow
@pytest.mark.xdist_group("guide")
def test_the_gallery_shows_what_its_notebooks_gave(pages: dict[str, str]) -> None:
    assert len(GALLERY) >= 5
    for name in GALLERY:
        page = pages[f"{name}.html"]
        assert page.count("cell_input") >= 5, name
        assert page.count("cell_output") >= 5, name
        assert "Traceback" not in page, name
        assert re.search(rf'href="[^"]*_downloads/[^"]*{name}.ipynb"', page), name
        pictures = re.findall(r"<(?:img|iframe)[^>]*>", page)
        assert pictures, name
        for picture in pictures:
            assert picture.startswith("<iframe") or ".svg" in picture, (name, picture)
            (told,) = re.findall(r'(?:alt|<iframe title)="([^"]*)"', picture)
            assert len(told) > 20, (name, picture)
            assert "/" not in told, (name, picture)


@pytest.mark.slow
@pytest.mark.xdist_group("guide")
def test_the_five_pictures_are_drawn_in_the_page_and_told(pages: dict[str, str]) -> None:
    figures = re.findall(r"<figure.*?</figure>", pages["idea.html"], re.S)
    assert len(figures) == 5
    for drawn in figures:
        shown = re.findall(r'<svg [^>]*role="img" aria-label="([^"]{40,})"', drawn)
        assert len(shown) == 2
        assert "currentColor" in drawn  # of the page: dark on light, light on dark
        caption = re.sub("<[^>]*>", "", drawn[drawn.index("<figcaption") :])
        assert len(caption) > 200
        assert "{" not in caption
        assert "nan" not in caption


@pytest.mark.slow
@pytest.mark.xdist_group("guide")
def test_nothing_of_the_build_is_left_among_the_pages(pages: dict[str, str]) -> None:
    assert pages
    assert not list((ROOT / "docs").rglob("*.ipynb"))
