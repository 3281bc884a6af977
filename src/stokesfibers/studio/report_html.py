"""HTML of the report: escaped pieces, and the page around them, which asks for nothing outside."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Sequence
from html import escape

_POWER = re.compile(r"\^(-?\d+)")

_CSS = """
:root { color-scheme: light dark; --ground: #ffffff; --raised: #f6f7f9; --ink: #1b1e23;
  --soft: #5b626d; --line: #dfe2e7; --link: #0a5c96; --good: #0a6b4c; --bad: #a8430a; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ground: #14171c; --raised: #1d2128; --ink: #e6e6e6; --soft: #a3abb7; --line: #343a44;
    --link: #7cc0f2; --good: #4fd0a5; --bad: #ffa468; } }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; scroll-behavior: smooth; }
body { margin: 0; background: var(--ground); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif; }
main, header, footer { max-width: 66rem; margin: 0 auto; padding: 0 1.5rem; }
header { padding-top: 2.5rem; }
footer { padding-bottom: 3rem; color: var(--soft); font-size: .875rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .4rem; overflow-wrap: anywhere; }
h2 { font-size: 1.25rem; margin: 2.6rem 0 .8rem; padding-bottom: .3rem;
  border-bottom: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.4rem 0 .5rem; }
p { max-width: 46rem; }
a { color: var(--link); }
.lead { color: var(--soft); margin: 0 0 1.2rem; }
nav { margin: 1.2rem 0 0; font-size: .9rem; }
nav a { margin-right: 1.1rem; text-decoration: none; white-space: nowrap; }
nav a:hover, nav a:focus { text-decoration: underline; }
.verdict { border: 1px solid var(--line); border-left: 5px solid var(--soft); border-radius: 4px;
  background: var(--raised); padding: .8rem 1.1rem; margin: 1.2rem 0; }
.verdict p { margin: .3rem 0; }
.verdict.good { border-left-color: var(--good); } .verdict.good strong { color: var(--good); }
.verdict.bad { border-left-color: var(--bad); } .verdict.bad strong { color: var(--bad); }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(9.5rem, 1fr)); gap: .8rem;
  margin: 1.2rem 0; padding: 0; }
.cards div { border: 1px solid var(--line); border-radius: 4px; padding: .6rem .9rem; }
.cards dt { color: var(--soft); font-size: .8rem; }
.cards dd { margin: 0; font-size: 1.2rem; font-variant-numeric: tabular-nums; }
.wide { overflow-x: auto; margin-bottom: 1.3rem; }
table { border-collapse: collapse; width: 100%; font-size: .92rem; }
caption { text-align: left; font-weight: 600; padding: .3rem 0; font-size: .92rem; }
th, td { text-align: left; vertical-align: top; padding: .34rem .8rem .34rem 0;
  border-bottom: 1px solid var(--line); font-variant-numeric: tabular-nums; }
th { font-weight: 600; } thead th { color: var(--soft); font-weight: 500; font-size: .85rem; }
tbody th { font-weight: 500; }
.figures { columns: 2 26rem; column-gap: 2rem; }
figure { margin: 0 0 1.6rem; break-inside: avoid; }
figure.across { column-span: all; }
.case { columns: 2 22rem; column-gap: 2.5rem; }
.case .wide { break-inside: avoid; margin-bottom: 1rem; } .case th { width: 45%; }
figure img { display: block; width: 100%; height: auto; }
figcaption { color: var(--soft); font-size: .88rem; margin-top: .4rem; max-width: 46rem; }
.on-dark { display: none !important; }
@media screen and (prefers-color-scheme: dark) {
  .on-light { display: none !important; } .on-dark { display: block !important; } }
pre { background: var(--raised); border: 1px solid var(--line); border-radius: 4px;
  overflow-x: auto; padding: .8rem 1rem;
  font: .84rem/1.45 ui-monospace, "SF Mono", Menlo, Consolas, monospace; }
code { font: .9em ui-monospace, "SF Mono", Menlo, Consolas, monospace; overflow-wrap: anywhere; }
@media print {
  body { font-size: 10.5pt; } nav { display: none; }
  main, header, footer { max-width: none; padding: 0; }
  pre { white-space: pre-wrap; } h2, h3 { break-after: avoid; } tr { break-inside: avoid; }
  .figures, .case { columns: 2 auto; }
  a { color: inherit; text-decoration: none; } }
@page { margin: 16mm; }
"""


def text(value: object) -> str:
    """Return `value` as text that HTML shows as it is, also within quotes."""
    return escape(str(value), quote=True)


def unit(name: str) -> str:
    """Return a unit in base quantities as HTML, with raised powers; empty for a pure number."""
    return "" if name == "1" else _POWER.sub(r"<sup>\1</sup>", text(name)).replace("-", "−")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Return a table; the first cell of a row is its heading. Cells are HTML, heads plain text."""
    title = f"<caption>{text(caption)}</caption>" if caption else ""
    names = "".join(f'<th scope="col">{text(name)}</th>' for name in head)
    shown = f"<thead><tr>{names}</tr></thead>" if head else ""
    body = "".join(
        f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>'
        for first, *rest in rows
    )
    return f'<div class="wide"><table>{title}{shown}<tbody>{body}</tbody></table></div>'


def cards(pairs: Iterable[tuple[str, str]]) -> str:
    """Return a row of short facts, plain text."""
    inside = "".join(
        f"<div><dt>{text(name)}</dt><dd>{text(value)}</dd></div>" for name, value in pairs
    )
    return f'<dl class="cards">{inside}</dl>'


def verdict(kind: str, strong: str, lines: Iterable[str]) -> str:
    """Return a box that says whether all is well: kind good, bad or empty; plain text."""
    rest = "".join(f"<p>{text(line)}</p>" for line in lines if line)
    return f'<div class="verdict {kind}"><p><strong>{text(strong)}</strong></p>{rest}</div>'


def image(content: bytes, kind: str, words: tuple[str, str]) -> str:
    """Return an image that is part of the page: kind svg+xml or png; class and what it shows."""
    name, shows = words
    data = base64.b64encode(content).decode("ascii")
    return f'<img class="{name}" alt="{text(shows)}" src="data:image/{kind};base64,{data}">'


def figure(images: str, caption: str, *, across: bool = False) -> str:
    """Return a figure; `images` is HTML, the caption plain text."""
    place = ' class="across"' if across else ""
    return f"<figure{place}>{images}<figcaption>{text(caption)}</figcaption></figure>"


def section(name: str, title: str, *parts: str) -> str:
    """Return a section with its heading; parts are HTML."""
    return f'<section id="{name}"><h2>{text(title)}</h2>{"".join(parts)}</section>'


def page(title: str, head: str, sections: Sequence[tuple[str, str, str]], foot: str) -> str:
    """Return the whole page.

    Parameters
    ----------
    title
        Plain text.
    head
        HTML below the title.
    sections
        Name, title and HTML of each; empty ones are left out.
    foot
        HTML at the end.
    """
    shown = [(name, label, inside) for name, label, inside in sections if inside]
    links = "".join(f'<a href="#{name}">{text(label)}</a>' for name, label, _ in shown)
    body = "\n".join(section(name, label, inside) for name, label, inside in shown)
    # nothing is fetched and nothing runs, whatever a case may hold
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<title>{text(title)}</title>
<link rel="icon" href="data:,">
<style>{_CSS}</style>
</head>
<body>
<header><h1>{text(title)}</h1>
{head}
<nav aria-label="Sections">{links}</nav></header>
<main>
{body}
</main>
<footer>{foot}</footer>
</body>
</html>
"""
