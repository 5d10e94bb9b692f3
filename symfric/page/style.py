"""The style sheet of a page: light and dark by the reader's setting, black on white in print."""

from collections.abc import Sequence

from symfric.foundation.style import COLOURS, dash

_PAGE = """
:root { color-scheme: light dark; --ink: #1c2530; --soft: #5b6775; --paper: #ffffff;
  --panel: #f4f6f8; --line: #d5dbe1; --grid: #e6eaee; --measured: #9aa5b1; --predicted: #c23b22;
  --residual: #2b6ca3; --second: #7a4fa3; --good: #1d7a3e; --doubtful: #9a6200; --bad: #b3261e;
  --band: #2b6ca322; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e9ee; --soft: #9dabb9; --paper: #14191f;
  --panel: #1d242c; --line: #3a4550; --grid: #28313a; --measured: #7d8b99; --predicted: #ff8066;
  --residual: #6fb3ec; --second: #c09be8; --good: #62c983; --doubtful: #e8b04a; --bad: #ff8a80;
  --band: #6fb3ec2b; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, "Segoe UI", "Helvetica Neue", "DejaVu Sans", Arial, sans-serif; }
main { max-width: 62rem; margin: 0 auto; padding: 1.5rem 1.25rem 4rem; }
h1 { font-size: 1.6rem; line-height: 1.25; margin: 0 0 .25rem; overflow-wrap: anywhere; }
h2 { font-size: 1.15rem; margin: 2.2rem 0 .6rem; padding-top: .6rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.2rem 0 .4rem; overflow-wrap: anywhere; }
p, ul { margin: .4rem 0; max-width: 46rem; } .soft, figcaption { color: var(--soft); }
nav { font-size: .9rem; margin: .8rem 0; } nav a { margin-right: .9rem; white-space: nowrap; }
a { color: var(--residual); }
.verdict { background: var(--panel); border-left: .4rem solid var(--soft); border-radius: .3rem;
  padding: .7rem 1rem; margin: 1rem 0; } .verdict strong { font-size: 1.1rem; }
.verdict.good { border-color: var(--good); } .verdict.bad { border-color: var(--bad); }
.verdict.doubtful { border-color: var(--doubtful); }
.verdict.good strong, td.good { color: var(--good); }
.verdict.doubtful strong, td.doubtful { color: var(--doubtful); }
.verdict.bad strong, td.bad { color: var(--bad); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .9rem; margin: .4rem 0 .8rem;
  font-variant-numeric: tabular-nums; }
caption { text-align: left; white-space: nowrap; color: var(--soft); padding-bottom: .3rem; }
th, td { padding: .22rem .7rem .22rem 0; border-bottom: 1px solid var(--line); text-align: left;
  vertical-align: top; } thead th { color: var(--soft); font-weight: 600; }
th.number, td.number { text-align: right; white-space: nowrap; }
tbody th { font-weight: 600; } td.note { color: var(--soft); min-width: 12rem; }
table.square th, table.square td { padding: .2rem .5rem; text-align: right; }
table.square td { border: 1px solid var(--paper); }
figure { margin: .6rem 0 1.2rem; overflow-x: auto; }
figcaption { font-size: .9rem; max-width: 46rem; }
svg.chart { display: block; width: 100%; min-width: 36rem; height: auto; }
svg text { fill: var(--ink); font: 12px system-ui, "DejaVu Sans", Arial, sans-serif; }
svg .title { font-weight: 600; font-size: 13px; } svg .tick { fill: var(--soft); font-size: 11px;
  text-anchor: middle; } svg .tick.y { text-anchor: end; } svg .label { fill: var(--soft);
  text-anchor: middle; } svg .entry { fill: var(--soft); }
svg polyline, svg path { fill: none; stroke-width: 1.2; stroke-linejoin: round; }
svg .grid { stroke: var(--grid); stroke-width: 1; } svg .frame { fill: none; stroke: var(--line); }
svg .measured { stroke: var(--measured); stroke-width: 2.4; }
svg .predicted { stroke: var(--predicted); } svg .residual { stroke: var(--residual); }
svg .second { stroke: var(--second); stroke-dasharray: 5 3; }
svg .law { stroke: var(--predicted); stroke-width: 2; }
svg .bound { stroke: var(--soft); stroke-dasharray: 4 3; } svg .zero { stroke: var(--soft); }
svg .window { stroke: var(--line); stroke-dasharray: 2 3; }
svg .band { fill: var(--band); stroke: none; }
svg .dots { stroke-linecap: round; stroke-width: 3.2; }
svg .dots.measured { stroke-width: 2.4; stroke-opacity: .75; }
svg .dots.sample { stroke-width: 6; stroke-opacity: 1; }
svg .dots.good { stroke: var(--good); stroke-width: 7; } svg .dots.bad { stroke: var(--bad);
  stroke-width: 7; } svg .dots.doubtful { stroke: var(--doubtful); stroke-width: 7; }
details { margin: .4rem 0; } summary { cursor: pointer; color: var(--soft); }
footer { margin-top: 3rem; color: var(--soft); font-size: .85rem; }
code { font-size: .9em; overflow-wrap: anywhere; white-space: pre-wrap; }
@media print { :root { color-scheme: light; --ink: #000; --soft: #444; --paper: #fff;
  --panel: #fff; --line: #999; --grid: #ddd; --measured: #8a949e; --predicted: #b3261e;
  --residual: #1f5f99; --second: #6a3f93; --good: #145c2e; --doubtful: #7a4d00; --bad: #9c1c15;
  --band: #2b6ca322; } main { max-width: none; padding: 0; } nav { display: none; }
  svg.chart { min-width: 0; break-inside: avoid; }
  tr { break-inside: avoid; } h2 { break-after: avoid; }
  .wide { overflow: visible; } table { font-size: .78rem; } }
"""


def _lighter(colour: str) -> str:
    """Half way to white, to be seen on dark paper."""
    return "#" + "".join(f"{(int(colour[k : k + 2], 16) + 255) // 2:02x}" for k in (1, 3, 5))


def _dashes(k: int) -> str:
    pattern = dash(k)
    return "none" if isinstance(pattern, str) else " ".join(f"{1.2 * x:.3g}" for x in pattern[1])


def _runs(colours: Sequence[str]) -> str:
    """Classes run0, run1, ...: the colours and dashes that pictures give to simulations."""
    return "\n".join(
        f"svg .run{k} {{ stroke: {colour}; stroke-dasharray: {_dashes(k)}; }}"
        for k, colour in enumerate(colours)
    )


STYLE = f"""{_PAGE}{_runs(COLOURS)}
@media screen and (prefers-color-scheme: dark) {{ {_runs([_lighter(c) for c in COLOURS])} }}
"""
