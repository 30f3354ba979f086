/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "html_page.h"
#include "svg_plot.h"
#include <errno.h>
#include <string.h>

/* Colours are plot_style's. */
static const char style[] =
    "*{box-sizing:border-box}body{margin:0;background:var(--paper);color:var(--ink);"
    "font:16px/1.5 system-ui,sans-serif}\n"
    "main{max-width:76rem;margin:0 auto;padding:1.5rem 1rem 3rem}\n"
    "h1{font-size:1.6rem;line-height:1.25;margin:0 0 .5rem}h2{font-size:1.2rem;margin:2.2rem 0 .5rem}"
    "h3{font-size:1rem;margin:1.4rem 0 .3rem}p{max-width:46rem;margin:.5rem 0}.verdict{font-size:1.1rem}\n"
    ".note{color:var(--soft)}.simulated{border-left:.25rem solid var(--soft);padding-left:.75rem}\n"
    ".wide{overflow-x:auto}table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.8rem 0}\n"
    "th,td{padding:.3rem .8rem .3rem 0;text-align:right;border-bottom:1px solid var(--grid);vertical-align:bottom}"
    "th:first-child,td:first-child{text-align:left;min-width:8rem}th{font-weight:600;color:var(--soft)}td.gain{font-"
    "weight:600}\n"
    ".row{display:grid;grid-template-columns:repeat(auto-fill,minmax(min(20rem,100%),1fr));gap:1rem 1.5rem}\n"
    "figure{margin:0;min-width:0;display:flex;flex-direction:column;justify-content:flex-end}figcaption{font-size:."
    "85rem}.key{color:var(--soft);white-space:nowrap;margin-left:."
    "5rem}"
    ".key svg{width:1.4rem;height:.55rem}.plot{display:block;width:100%;height:auto}\n"
    "@media print{body{font-size:10pt}figcaption{font-size:8pt}.plot "
    "text{font-size:15px}.plot .tick{font-size:14px}main{max-width:none;padding:0}figure,table{break-inside:avoid}"
    "h2,h3,.with-next{break-after:avoid}p,dd{orphans:3;widows:3}.row{grid-template-columns:repeat(3,1fr)}}\n";

FILE *page_open(const char *path, const char *title, failure_t *failure) {
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        fail(failure, "%s: %s", path, strerror(errno));
        return NULL;
    }
    fprintf(file, "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" "
                  "content=\"width=device-width, initial-scale=1\">\n<title>");
    write_escaped(file, title);
    fprintf(file, "</title>\n<style>\n%s%s</style>\n</head>\n<body>\n<main>\n", plot_style, style);
    return file;
}

bool file_close_written(FILE *file, const char *path, failure_t *failure) {
    const bool written = ferror(file) == 0;
    if (fclose(file) != 0 || !written) {
        return fail(failure, "%s: %s", path, strerror(errno));
    }
    return true;
}

bool page_close(FILE *file, const char *path, bool good, failure_t *failure) {
    fprintf(file, "<p class=\"note\">Written by hyst " HYST_VERSION ".</p>\n</main>\n</body>\n</html>\n");
    if (!good) {
        (void)fclose(file);
        (void)remove(path);
        return false;
    }
    return file_close_written(file, path, failure);
}
