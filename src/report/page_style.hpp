#pragma once

#include <string_view>

namespace flyball::report {

/// The page's style sheet. Colours keep a contrast of at least 4.5 in both schemes.
inline constexpr std::string_view page_style = R"css(
:root{color-scheme:light dark;--bg:#fff;--fg:#1b1f24;--quiet:#57606a;--line:#d0d7de;--card:#f6f8fa;
--good:#116329;--caution:#7d4e00;--bad:#a40e26;--link:#0550ae}
@media (prefers-color-scheme:dark){:root{--bg:#0f1319;--fg:#e3e8ee;--quiet:#a3adb8;--line:#343b44;
--card:#191f27;--good:#56d364;--caution:#e3b341;--bad:#ff7b72;--link:#79c0ff}}
*{box-sizing:border-box}
body{margin:0 auto;padding:1.25rem;max-width:60rem;background:var(--bg);color:var(--fg);
font:1rem/1.5 system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
h1{font-size:1.6rem;line-height:1.25;margin:.2rem 0 .6rem}
h2{font-size:1.25rem;margin:2.2rem 0 .6rem;padding-bottom:.2rem;border-bottom:1px solid var(--line)}
a{color:var(--link)}
nav ul{display:flex;flex-wrap:wrap;gap:.3rem 1rem;list-style:none;padding:0;margin:.8rem 0}
.verdict{border-left:.35rem solid currentColor;background:var(--card);padding:.7rem 1rem;margin:0}
.verdict strong{font-size:1.1rem}
.verdict ul{margin:.4rem 0 0;padding-left:1.2rem;color:var(--fg)}
.good{color:var(--good)}.caution{color:var(--caution)}.bad{color:var(--bad)}.quiet{color:var(--quiet)}
.scroll{overflow-x:auto;margin:.8rem 0}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
caption{text-align:left;padding-bottom:.3rem}
th,td{padding:.25rem .8rem .25rem 0;text-align:right;vertical-align:top;
border-bottom:1px solid var(--line)}
thead th{color:var(--quiet);font-weight:600;border-bottom-width:2px}
th.w,td.w{text-align:left}
tbody th{font-weight:600}
.scroll tbody th,.scroll td:not(.w){white-space:nowrap}
.facts th{color:var(--quiet);font-weight:400;white-space:nowrap}
.facts td{overflow-wrap:anywhere}
figure{margin:1rem 0}
.picture{background:#fff;border:1px solid var(--line);border-radius:.4rem;padding:.4rem;
overflow-x:auto}
.picture svg{display:block;width:100%;height:auto;min-width:22rem}
figcaption{color:var(--quiet);font-size:.9rem;margin-top:.3rem}
.findings{list-style:none;padding:0}
.findings li{padding:.35rem 0;border-bottom:1px solid var(--line)}
.badge{display:inline-block;min-width:4.6rem;font-weight:600}
code,pre{font:0.875rem/1.45 ui-monospace,SFMono-Regular,Menlo,Consolas,monospace}
pre{background:var(--card);border:1px solid var(--line);border-radius:.4rem;padding:.8rem;
overflow-x:auto;margin:.5rem 0}
details{margin:.4rem 0}
summary{cursor:pointer;font-weight:600}
footer{margin-top:2.5rem;color:var(--quiet);font-size:.9rem}
@media (max-width:36rem){body{padding:.8rem}h1{font-size:1.35rem}
.facts th,.facts td{display:block;border:0;padding:0;text-align:left}
.facts td{padding-bottom:.5rem;border-bottom:1px solid var(--line)}
.scroll td.w:last-child{min-width:8rem}.scroll table{font-size:.875rem}.scroll th,.scroll td{padding-right:.6rem}
.picture svg{min-width:38rem}.badge{min-width:0;margin-right:.5rem}}
@media print{nav{display:none}body{max-width:none;padding:0}figure,pre,tr{break-inside:avoid}
h2{break-after:avoid}.picture{border:0}}
)css";

}  // namespace flyball::report
