# SPDX-License-Identifier: GPL-3.0-or-later
"""The score as pictures: plain SVG, written here."""
from xml.sax.saxutils import escape

FONT = 'font-family="sans-serif" font-size="11"'
COLOURS = ("#1b6ca8", "#c0392b", "#2e8b57", "#8e6c00")


def page(width, height, body):
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
            f'viewBox="0 0 {width} {height}">\n<rect width="100%" height="100%" fill="white"/>\n'
            + "\n".join(body) + "\n</svg>\n")


def words(x, y, text, anchor="start", turn=None):
    where = f' transform="rotate({turn} {x:.1f} {y:.1f})"' if turn else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" {FONT}{where}>{escape(text)}</text>'


def confusion(rows, columns, counts, title):
    """counts[row][column]: how often a hidden row was told as column; shade is the share of the row."""
    cell, left, top = 26, 190, 190
    body = [words(10, 20, title)]
    for j, column in enumerate(columns):
        body.append(words(left + cell * (j + 0.7), top - 8, column, turn=-60))
    for i, row in enumerate(rows):
        total = sum(counts[row].values())
        body.append(words(left - 8, top + cell * (i + 0.68), f"{row} ({total})", "end"))
        for j, column in enumerate(columns):
            n = counts[row].get(column, 0)
            shade = n / total if total else 0.0
            colour = (27, 108, 168) if row == column else (192, 57, 43)
            fill = ",".join(str(int(255 - (255 - c) * shade)) for c in colour)
            body.append(f'<rect x="{left + cell * j}" y="{top + cell * i}" width="{cell}" height="{cell}" '
                        f'fill="rgb({fill})" stroke="#ddd"/>')
            if n:
                body.append(words(left + cell * (j + 0.5), top + cell * (i + 0.68), str(n), "middle"))
    return page(left + cell * len(columns) + 130, top + cell * len(rows) + 20, body)


def curves(series, ticks, place, x_label, y_label, title, diagonal=False):
    """series: {name: [(x, share)]}, x mapped to 0..1 by `place`; bars are the intervals."""
    width, height, left, top = 460, 300, 60, 40

    def at(x, y):
        return left + width * place(x), top + height * (1.0 - y)
    body = [words(left, 22, title), words(left + width / 2, top + height + 36, x_label, "middle"),
            words(16, top + height / 2, y_label, "middle", -90)]
    for part in (0.0, 0.2, 0.4, 0.6, 0.8, 1.0):
        x, y = at(ticks[0], part)
        body.append(f'<line x1="{left}" x2="{left + width}" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>')
        body.append(words(left - 6, y + 4, f"{100 * part:.0f} %", "end"))
    for tick in ticks:
        x, _ = at(tick, 0.0)
        body.append(words(x, top + height + 18, f"{tick:g}", "middle"))
    if diagonal:
        body.append(f'<line x1="{left}" y1="{top + height}" x2="{left + width}" y2="{top}" stroke="#999" '
                    'stroke-dasharray="4 4"/>')
    for (name, points), colour in zip(series.items(), COLOURS):
        line = []
        for x, s in points:
            if s["part"] is None:
                continue
            px, py = at(x, s["part"])
            line.append(f"{px:.1f},{py:.1f}")
            low, high = at(x, s["low"])[1], at(x, s["high"])[1]
            body.append(f'<line x1="{px:.1f}" x2="{px:.1f}" y1="{low:.1f}" y2="{high:.1f}" '
                        f'stroke="{colour}"/><circle cx="{px:.1f}" cy="{py:.1f}" r="3" fill="{colour}"/>')
        body.append(f'<polyline points="{" ".join(line)}" fill="none" stroke="{colour}" stroke-width="1.5"/>')
    for k, (name, colour) in enumerate(zip(series, COLOURS)):
        body.append(f'<rect x="{left + width + 14}" y="{top + 18 * k}" width="10" height="10" fill="{colour}"/>')
        body.append(words(left + width + 30, top + 18 * k + 9, name))
    return page(left + width + 170, top + height + 50, body)
