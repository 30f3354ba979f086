/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "page/html_page.h"
#include "base/provenance.h"
#include "base/shown_name.h"
#include "page/svg_plot.h"
#include "page_scripts.h" /* generated: plot.js */

/* Colours are plot_style's. */
static const char style[] =
    "*{box-sizing:border-box}body{margin:0;background:var(--paper);color:var(--ink);"
    "font:16px/1.5 system-ui,sans-serif}\n"
    "main{max-width:76rem;margin:0 auto;padding:1.5rem 1rem 3rem}\n"
    "h1{font-size:1.6rem;line-height:1.25;margin:0 0 .5rem}h2{font-size:1.2rem;margin:2.2rem 0 .5rem}"
    "h3{font-size:1rem;margin:1.4rem 0 .3rem}p{max-width:46rem;margin:.5rem 0}.verdict{font-size:1.1rem}\n"
    ".note{color:var(--soft)}.simulated{border-left:.25rem solid var(--soft);padding-left:.75rem}\n"
    /* A shadow at the side at which a table goes on; the two covers go with the table. */
    ".wide{overflow-x:auto;background:linear-gradient(90deg,var(--paper) 40%,transparent) left/1.5rem 100%,"
    "linear-gradient(-90deg,var(--paper) 40%,transparent) right/1.5rem 100%,"
    "linear-gradient(90deg,var(--soft),transparent) left/.4rem 100%,"
    "linear-gradient(-90deg,var(--soft),transparent) right/.4rem 100%;"
    "background-repeat:no-repeat;background-attachment:local,local,scroll,scroll}\n"
    "table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.8rem 0}\n"
    "th,td{padding:.3rem .8rem .3rem 0;text-align:right;border-bottom:1px solid var(--grid);vertical-align:bottom}"
    "th:first-child,td:first-child{text-align:left;min-width:8rem}th{font-weight:600;color:var(--soft)}td.gain{font-"
    "weight:600}\n"
    ".row{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(20rem,100%),1fr));gap:1rem 1.5rem}\n"
    "figure{margin:0;min-width:0;display:flex;flex-direction:column;justify-content:flex-end}figcaption{font-size:."
    "85rem}.key{color:var(--soft);white-space:nowrap;margin-left:."
    "5rem}"
    ".key svg{width:1.4rem;height:.55rem}.plot{display:block;width:100%;height:auto;touch-action:pan-y}\n"
    ".plot:focus-visible{outline:2px solid var(--after)}.mark{stroke:var(--soft);stroke-width:.7}"
    ".zoom{fill:var(--after);fill-opacity:.15}.tools{display:flex;gap:.4rem;font-size:.8rem;color:var(--soft)}"
    ".told{flex:1;min-height:1.5em}.tools button{font:inherit;color:inherit;background:none;border:1px solid "
    "var(--grid);border-radius:.25rem;padding:0 .5rem;height:1.6em;white-space:nowrap;cursor:pointer}"
    ".numbers{width:100%;height:8rem;font:.75rem monospace;color:var(--ink);background:var(--shade);border:0}\n"
    "details{margin:2.2rem 0 .5rem}summary{font-size:1.2rem;font-weight:600;cursor:pointer}"
    ".origin{margin-top:2.2rem;border-top:1px solid var(--grid);padding-top:.6rem;font-size:.85rem}"
    ".origin code{overflow-wrap:anywhere}.origin dl{display:grid;grid-template-columns:max-content 1fr;gap:.1rem 1rem;"
    "margin:.3rem 0}.origin dt{color:var(--soft)}.origin dd{margin:0;min-width:0}"
    "@media(max-width:40rem){.origin dl{grid-template-columns:1fr}.wide table{font-size:.8rem;line-height:1.3}"
    ".wide th,.wide td{padding:.25rem .5rem .25rem 0;min-width:0}.wide th:first-child,.wide td:first-child"
    "{min-width:0}}\n"
    "@media print{.tools,.numbers{display:none}body{font-size:10pt}figcaption{font-size:8pt}.plot "
    "text{font-size:15px}.plot .tick{font-size:14px}main{max-width:none;padding:0}figure,table{break-inside:avoid}"
    "h2,h3,.with-next{break-after:avoid}p,dd{orphans:3;widows:3}.row{grid-template-columns:repeat(3,1fr)}}\n";

bool page_open(output_file_t *page, const char *path, const char *title, failure_t *failure) {
    if (!output_file_open(page, path, failure)) {
        return false;
    }
    const char *own = provenance_title(), *heading = own != NULL ? own : title;
    fprintf(page->file,
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
            "content=\"width=device-width, initial-scale=1\">\n<title>");
    write_escaped(page->file, heading);
    fprintf(page->file, "</title>\n<style>\n%s%s</style>\n</head>\n<body>\n<main>\n<h1>", plot_style, style);
    write_escaped(page->file, heading);
    fprintf(page->file, "</h1>\n");
    if (own != NULL) {
        fprintf(page->file, "<p class=\"note\">");
        write_escaped(page->file, title);
        fprintf(page->file, "</p>\n");
    }
    return true;
}

/* Where the page comes from. */
static void write_origin(FILE *file) {
    provenance_t from;
    provenance_now(&from);
    fprintf(file, "<section class=\"origin\">\n<dl>\n<dt>Made</dt><dd>%s by hyst " HYST_VERSION "</dd>\n", from.date);
    if (from.command != NULL) {
        fprintf(file, "<dt>Command</dt><dd><code>");
        write_escaped(file, from.command);
        fprintf(file, "</code></dd>\n");
    }
    if (from.device != NULL) {
        fprintf(file, "<dt>Device</dt><dd>");
        write_escaped(file, from.device);
        fprintf(file, "</dd>\n");
    }
    for (size_t i = 0; i < from.files; i++) {
        fprintf(file, "<dt>%s</dt><dd>", i == 0 ? "Files" : "");
        write_escaped(file, shown_name(from.file[i].path));
        fprintf(file, "<br><code>SHA-256 %s</code></dd>\n", from.file[i].sha256);
    }
    fprintf(file, "</dl>\n</section>\n");
    provenance_free(&from);
}

bool page_close(output_file_t *page, bool good, failure_t *failure) {
    write_origin(page->file);
    fprintf(page->file, "</main>\n<script id=\"pictures\">\n");
    for (size_t i = 0; i < page_scripts_count; i++) {
        (void)fwrite(page_scripts[i].data, 1, page_scripts[i].length, page->file);
    }
    fprintf(page->file, "</script>\n</body>\n</html>\n");
    return output_file_close(page, good, failure);
}
