// The style sheet of the page: on screens one column, on paper A4.
#pragma once

#include <string_view>

namespace lbea::tool {

inline constexpr std::string_view style = R"css(
:root { color-scheme: light; --ink: #1d2126; --faint: #545b64; --line: #d5d9de; }
* { box-sizing: border-box; }
body { margin: 0; background: #eceff2; color: var(--ink); font: 15px/1.45 "Liberation Sans", Arial, Helvetica, sans-serif; }
main { max-width: 1060px; margin: 0 auto; padding: 24px 32px 48px; background: #fff; }
h1 { font-size: 24px; margin: 0 0 4px; }
h2 { font-size: 19px; margin: 32px 0 8px; padding-top: 10px; border-top: 2px solid var(--ink); }
h3 { font-size: 15px; margin: 0; }
p { margin: 4px 0 8px; }
header p, figcaption p, .note { color: var(--faint); font-size: 13px; }
.name, code, pre { overflow-wrap: anywhere; }
pre { white-space: pre-wrap; background: #f3f5f7; padding: 8px 10px; margin: 6px 0; font-size: 13px; }
.answer { border-left: 10px solid; padding: 12px 18px; margin: 16px 0; }
.answer .word { font-size: 13px; font-weight: bold; letter-spacing: .04em; text-transform: uppercase; }
.answer .headline { font-size: 21px; line-height: 1.3; font-weight: bold; margin: 2px 0 10px; }
.good { border-color: #00754f; background: #eaf6f1; } .good .word { color: #005c3e; }
.open { border-color: #b07d00; background: #fdf6e3; } .open .word { color: #6b4c00; }
.bad { border-color: #b3261e; background: #fcedec; } .bad .word { color: #8f1d17; }
.flaws { border: 2px solid #b3261e; padding: 8px 16px; margin: 16px 0; }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(185px, 1fr)); gap: 12px; margin: 16px 0; padding: 0; }
.facts div { border: 1px solid var(--line); padding: 8px 12px; }
.facts dt { color: var(--faint); font-size: 13px; }
.facts dd { margin: 0; font-size: 18px; font-weight: bold; overflow-wrap: anywhere; }
.facts dd small { display: block; font-size: 13px; font-weight: normal; color: var(--faint); }
table { border-collapse: collapse; margin: 8px 0; font-size: 14px; }
.scroll { overflow-x: auto; } .scroll th, .scroll td { overflow-wrap: normal; white-space: nowrap; }
.scroll.values td { white-space: normal; overflow-wrap: anywhere; }
th, td { text-align: left; padding: 4px 14px 4px 0; border-bottom: 1px solid var(--line); vertical-align: top; overflow-wrap: anywhere; }
td.number, th.number { text-align: right; font-variant-numeric: tabular-nums; }
tr.sub td:first-child { padding-left: 18px; }
figure { margin: 0; break-inside: avoid; }
figcaption { min-height: 3.6em; }
svg { display: block; width: 100%; height: auto; }
svg text { font-size: 11.5px; fill: #3d444c; }
.grid { stroke: #e3e6ea; fill: none; } .curve { fill: none; stroke-width: 1.8; stroke-linecap: round; stroke-linejoin: round; }
.limit { stroke: #b3261e; stroke-width: 1.4; stroke-dasharray: 5 3; fill: none; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(420px, 1fr)); gap: 22px 26px; }
.legend { list-style: none; margin: 2px 0 0; padding: 0; display: flex; flex-wrap: wrap; gap: 2px 16px; font-size: 13px; }
.legend svg { display: inline-block; width: 34px; height: 8px; margin-right: 5px; }
.moment { break-inside: avoid; margin: 14px 0 18px; }
.trio { display: grid; grid-template-columns: repeat(3, 1fr); gap: 12px; }
.quad { display: grid; grid-template-columns: repeat(2, 1fr); gap: 12px; margin: 8px 0 18px; }
.trio img, .quad img { display: block; width: 100%; height: auto; border: 1px solid var(--line); }
.trio figcaption, .quad figcaption { min-height: 0; font-size: 13px; }
.bar { max-width: 420px; }
.map { max-width: 640px; }
@media print {
  @page { size: A4; margin: 14mm 12mm; }
  body { background: #fff; font-size: 10pt; }
  main { max-width: none; padding: 0; }
  h2 { break-after: avoid; } .page { break-before: page; }
  .charts { grid-template-columns: 1fr 1fr; } .scroll { overflow: visible; } .scroll table { font-size: 8pt; } .scroll th, .scroll td { padding-right: 6px; white-space: normal; }
  .answer, .facts div, tr, pre { break-inside: avoid; }
  .answer, .good, .open, .bad { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
}
)css";

}  // namespace lbea::tool
