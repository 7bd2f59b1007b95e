"""Style sheet and script of the page: plain text, so that the page is one file without network."""

CSS = """
:root { --ink: #222; --faint: #5f5f5f; --line: #dcdcdc; --accent: #D55E00; }
* { box-sizing: border-box; }
html { background: #fff; color: var(--ink); -webkit-text-size-adjust: 100%; }
body { max-width: 68rem; margin: 0 auto; padding: 2.5rem 1.5rem 4rem;
  font: 1rem/1.55 "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .4rem; letter-spacing: -.01em; }
h2 { font-size: 1.25rem; margin: 3.2rem 0 .5rem; padding-top: .9rem;
  border-top: 1px solid var(--line); }
p { max-width: 46rem; margin: .5rem 0; }
.lede { font-size: 1.1rem; }
.faint, figcaption { color: var(--faint); }
.tiles { display: flex; flex-wrap: wrap; gap: .9rem 2.6rem; margin: 1.6rem 0 0; padding: 0; }
.tiles div { min-width: 8rem; }
.tiles dt { font-size: .84rem; color: var(--faint); }
.tiles dd { margin: 0; font-size: 1.6rem; line-height: 1.25; font-variant-numeric: tabular-nums; }
.tiles dd small { font-size: .95rem; color: var(--faint); }
.tiles .main dd { color: var(--accent); }
figure { margin: 1.2rem 0 0; }
figure img { display: block; max-width: 100%; height: auto; }
figcaption { font-size: .88rem; line-height: 1.45; max-width: 50rem; margin-top: .5rem; }
figcaption b { color: var(--ink); }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; margin: 1rem 0 0; font-size: .92rem;
  font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .8rem; text-align: right; border-bottom: 1px solid #ececec; }
th { font-weight: 600; border-bottom: 1px solid #999; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; padding-left: 0; }
tr.replay td { color: var(--faint); border-top: 1px solid #999; }
tr.last td { font-weight: 600; }
.choice { border: 0; padding: 0; margin: .9rem 0 0; display: flex; flex-wrap: wrap; gap: .35rem; }
.choice legend { float: left; margin-right: .8rem; padding: .2rem 0; font-size: .92rem; }
.choice label { cursor: pointer; }
.choice input { position: absolute; opacity: 0; }
.choice span { display: inline-block; padding: .18rem .75rem; border: 1px solid #b5b5b5;
  border-radius: .3rem; font-size: .92rem; }
.choice input:checked + span { background: var(--ink); border-color: var(--ink); color: #fff; }
.choice input:focus-visible + span { outline: 2px solid #0072B2; outline-offset: 2px; }
.note { border-left: 3px solid var(--accent); padding: .3rem 0 .3rem .9rem; margin: 1rem 0; }
.settings td:first-child { white-space: nowrap; }
details { margin-top: 1rem; }
summary { cursor: pointer; }
td { white-space: nowrap; }
.settings td { text-align: left; white-space: normal; font-size: .84rem;
  overflow-wrap: anywhere; vertical-align: top; }
code { font: .9em ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace; }
@media print { .choice { display: none; } body { padding: 0; } figure { break-inside: avoid; } }
"""

SCRIPT = """
const controls = document.getElementById("joint-controls");
if (controls) {
  const show = () => {
    const chosen = name => controls.querySelector(`input[name=${name}]:checked`).value;
    const wanted = `joints-${chosen("iteration")}-${chosen("view")}`;
    document.querySelectorAll(".joints").forEach(f => { f.hidden = f.id !== wanted; });
  };
  controls.hidden = false;
  controls.addEventListener("change", show);
  show();
}
"""
