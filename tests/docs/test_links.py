"""Links of built pages: those that lead nowhere are found, good ones are not."""

from pathlib import Path

import pytest

from docs.machine.links import main, problems


def written(folder: Path, body: str, name: str = "a.html") -> list[str]:
    (folder / name).write_text(f"<html><body>{body}</body></html>", "utf-8")
    return [*problems(folder)]


def test_links_within_and_out_of_the_pages_hold(tmp_path: Path) -> None:
    (tmp_path / "b.html").write_text("<p id='here'>x</p>", "utf-8")
    (tmp_path / "a picture.png").write_bytes(b"")
    good = (
        '<h1 id="top">x</h1><a href="#top">1</a><a href="b.html#here">2</a><a href="b.html">3</a>'
        '<a href="https://docs.python.org/3/">4</a><a href="mailto:a@b.c">5</a>'
        '<img src="data:image/png,"><img src="a%20picture.png">'
    )
    assert written(tmp_path, good) == []
    assert main(tmp_path) == 0


@pytest.mark.parametrize(
    ("link", "trouble"),
    [
        ('<a href="c.html">', "no such file"),
        ('<a href="#nowhere">', "no such place"),
        ('<a href="b.html#nowhere">', "no such place"),
        ('<a href="https://nonsense">', "no well-formed address"),
        ('<a href="ftp://a.b/">', "no well-formed address"),
        ('<img src="gone.png">', "no such file"),
        ('<script src="https://cdn.example.org/x.js">', "loaded from the network"),
        ('<link rel="stylesheet" href="//fonts.example.org/x.css">', "loaded from the network"),
    ],
)
def test_links_that_lead_nowhere_are_found(tmp_path: Path, link: str, trouble: str) -> None:
    (tmp_path / "b.html").write_text("<p id='here'>x</p>", "utf-8")
    (found,) = written(tmp_path, link)
    assert found.startswith("a.html: ") and trouble in found
    assert main(tmp_path) == 1


def test_styles_that_load_fonts_from_the_network_are_found(tmp_path: Path) -> None:
    (tmp_path / "x.css").write_text("@font-face { src: url('https://a.b/font.woff2') }", "utf-8")
    (found,) = written(tmp_path, "")
    assert "x.css" in found and "loaded from the network" in found


def test_no_pages_are_no_success(tmp_path: Path) -> None:
    assert main(tmp_path) == 1
