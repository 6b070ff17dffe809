"""Style sheet of the report, for light, dark and narrow screens and for A4 paper.

The colours are those of Okabe and Ito: vermillion before, blue after. Every kind of colour vision
distinguishes them. Dashes, labels and numbers repeat what the colours say.
"""

STYLE = """
:root { color-scheme: light dark; --fore: #1a1a1a; --soft: #5a5a5a; --line: #d4d4d4;
  --back: #ffffff; --panel: #f5f6f7; --before: #d55e00; --after: #0072b2; --band: #dcdcdc;
  --bar: #0072b2; --tint: #56b4e955; --heat1: #fdf0e4; --heat2: #f9d3b0; --heat3: #ee9a55;
  --heat4: #a84600; --heat4-fore: #ffffff; }
@media screen and (prefers-color-scheme: dark) {
  :root { --fore: #ececec; --soft: #b0b0b0; --line: #474747; --back: #17191c; --panel: #212429;
    --before: #f0883a; --after: #56b4e9; --band: #3a3e44; --bar: #56b4e9; --tint: #0072b288;
    --heat1: #33261c; --heat2: #5c3a1d; --heat3: #9a5418; --heat4: #f0a055;
    --heat4-fore: #17191c; } }
* { box-sizing: border-box; }
html { font: 16px/1.5 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif;
  background: var(--back); color: var(--fore); -webkit-text-size-adjust: 100%; }
body { max-width: 68rem; margin: 0 auto; padding: 1.5rem 1.25rem 4rem; }
body, td, th, dd { overflow-wrap: break-word; }
h1 { font-size: 1.05rem; font-weight: 600; color: var(--soft); margin: 0 0 .75rem; }
h2 { font-size: 1.25rem; line-height: 1.3; margin: 2.5rem 0 .5rem; padding-top: .75rem;
  border-top: 1px solid var(--line); }
h3 { font-size: 1rem; margin: 1.5rem 0 .25rem; overflow-wrap: anywhere; }
p { margin: .5rem 0; max-width: 48rem; }
code, .hash { font: .875em/1.45 ui-monospace, "DejaVu Sans Mono", Consolas, monospace; }
.hash, .any { overflow-wrap: anywhere; }
.soft { color: var(--soft); }
.small { font-size: .875rem; }
.verdict { background: var(--panel); border-left: .4rem solid var(--bar);
  padding: 1rem 1.25rem; margin: 0 0 1rem; }
.verdict .kind { font-size: .875rem; font-weight: 700; margin: 0; color: var(--soft);
  text-transform: uppercase; letter-spacing: .04em; }
.verdict .statement { font-size: 1.35rem; line-height: 1.35; font-weight: 600;
  margin: .25rem 0 0; }
.next { border-left: .4rem solid var(--line); padding: .25rem 1rem; }
dl { display: grid; grid-template-columns: fit-content(18rem) 1fr; gap: .3rem 1.25rem;
  margin: .5rem 0; }
dt { color: var(--soft); overflow-wrap: anywhere; }
dd { margin: 0; min-width: 0; overflow-wrap: anywhere; }
ul { margin: .5rem 0; padding-left: 1.25rem; max-width: 48rem; }
.wide { overflow-x: auto; }
.wide:focus-visible { outline: 2px solid var(--bar); }
table { border-collapse: collapse; margin: .5rem 0; font-size: .9375rem; min-width: 22rem;
  font-variant-numeric: tabular-nums; }
caption { text-align: left; color: var(--soft); font-size: .875rem; padding-bottom: .35rem;
  max-width: min(48rem, 100vw - 2rem); }
th, td { text-align: left; vertical-align: top; padding: .35rem .75rem;
  border-bottom: 1px solid var(--line); }
thead th { border-bottom: 2px solid var(--soft); font-weight: 600; vertical-align: bottom; }
tbody th { font-weight: 500; }
.n { text-align: right; white-space: nowrap; } thead .n { white-space: normal; }
.line { display: block; min-width: 15rem; }
.map .line { min-width: 0; white-space: nowrap; }
.line span, tbody th { white-space: nowrap; }
.accepted th, .accepted td { background-color: var(--panel); }
.accepted th { font-weight: 700; }
.bar { background-image: linear-gradient(var(--tint), var(--tint));
  background-repeat: no-repeat; background-position: left .4em; }
.map td { text-align: right; min-width: 5.5rem; border: 1px solid var(--line); }
.map .here { outline: 3px solid var(--fore); outline-offset: -3px; font-weight: 700; }
.heat1 { background: var(--heat1); } .heat2 { background: var(--heat2); }
.heat3 { background: var(--heat3); }
.heat4 { background: var(--heat4); color: var(--heat4-fore); }
.map .heat2 .soft, .map .heat3 .soft, .map .heat4 .soft { color: inherit; }
figure { margin: 1rem 0; }
figure svg { display: block; width: 100%; min-width: 40rem; height: auto; }
figcaption { font-size: .875rem; color: var(--soft); max-width: 48rem; }
svg text { font: 12px system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif;
  fill: var(--fore); }
svg .soft { fill: var(--soft); }
svg .bold { font-weight: 700; }
svg .end { text-anchor: end; } svg .middle { text-anchor: middle; }
svg path { fill: none; stroke-linejoin: round; }
.grid { stroke: var(--line); stroke-width: 1; }
.axis { stroke: var(--soft); stroke-width: 1; fill: none; }
.floor { stroke: var(--fore); stroke-width: 1.5; stroke-dasharray: 2 3; }
.left { fill: var(--bar); }
.gone { fill: none; stroke: var(--soft); stroke-width: 1; stroke-dasharray: 3 3; }
.whisker { stroke: var(--fore); stroke-width: 1.6; }
.band { fill: var(--band); } .edge { stroke: var(--fore); stroke-dasharray: 1 3; }
.measured { stroke: var(--soft); stroke-width: 4; stroke-opacity: .55; }
.before { stroke: var(--before); stroke-width: 1.5; stroke-dasharray: 7 3; }
.after { stroke: var(--after); stroke-width: 1.5; }
.strip.before { stroke-dasharray: none; stroke-width: 1; } .strip.after { stroke-width: 1; }
.legend svg { width: 42px; height: 12px; min-width: 0; display: inline-block; }
.legend span { display: inline-block; margin-right: 1.25rem; }
@media (max-width: 40rem) {
  body { padding: 1rem .75rem 3rem; }
  .verdict .statement { font-size: 1.15rem; }
  dl { grid-template-columns: 1fr; gap: 0; } dd { margin-bottom: .5rem; }
  th, td { padding: .3rem .5rem; } }
@page { size: A4; margin: 12mm 15mm; }
@media print {
  html { font-size: 10.5pt; -webkit-print-color-adjust: exact; print-color-adjust: exact; }
  body { max-width: none; padding: 0; }
  h2, h3, caption, thead { break-after: avoid; } h2 { margin-top: 1rem; }
  figure, tr, caption, .map, .short, .verdict, .keep { break-inside: avoid; }
  thead { display: table-header-group; }
  figure { margin: .5rem 0; } figure svg { min-width: 0; } .wide { overflow: visible; }
  table { font-size: 9pt; } th, td { padding: .2rem .35rem; } dl { font-size: 9pt; }
  .wide:has(.map, .short) { float: left; margin-right: .75rem; } h2 { clear: both; }
  .map, .short { font-size: 8.5pt; line-height: 1.25; min-width: 0; }
  .map td { min-width: 4rem; } .map .small { font-size: inherit; }
  .short caption { max-width: 13rem; } .verdict { padding: .6rem 1rem; }
  .verdict .statement { font-size: 1.15rem; } }
"""
