# SPDX-License-Identifier: GPL-3.0-or-later
"""Tables as text: separators and names, units and scales, times."""
import gzip

import numpy as np
from measurement import export, K, RATE, REF, ROWS, rows, T, text, U, Y


# ---- separators, decimal signs, names

@export("CSV with names")
def _(path):
    text(path, "time,drive,displacement\n" + rows(T, U, Y))


@export("CSV, names in another order and case")
def _(path):
    text(path, "Displacement,Time,Drive\n" + rows(Y, T, U))


@export("CSV without names")
def _(path):
    text(path, rows(T, U, Y))


@export("CSV, blanks behind commas")
def _(path):
    text(path, "t, u, y\n" + rows(T, U, Y, separator=", "))


@export("CSV, a comma at the end of each line")
def _(path):
    text(path, "t,u,y,\n" + rows(T, U, Y, end=",\n"))


@export("semicolons")
def _(path):
    text(path, "t;drive;position\n" + rows(T, U, Y, separator=";"))


@export("semicolons and decimal commas (German spreadsheet)")
def _(path):
    text(path, "Zeit;drive;position\r\n" + rows(T, U, Y, separator=";", comma=True, end="\r\n"))


@export("tabs")
def _(path):
    text(path, "t\tdrive\tposition\n" + rows(T, U, Y, separator="\t"))


@export("tabs and decimal commas")
def _(path):
    text(path, "t\tdrive\tposition\n" + rows(T, U, Y, separator="\t", comma=True))


@export("columns between blanks")
def _(path):
    text(path, "t drive position\n" + rows(T, U, Y, separator="   ", form="%12.6f"), )


@export("bars")
def _(path):
    text(path, "t|drive|position\n" + rows(T, U, Y, separator="|"))


@export("quoted names and numbers")
def _(path):
    text(path, '"time","drive","displacement"\n' + "".join(f'"{t:.6f}","{u:.9g}","{y:.9g}"\n' for t, u, y in zip(T, U, Y)))


@export("quoted numbers with decimal commas")
def _(path):
    text(path, '"time","drive","displacement"\n' +
         "".join(",".join('"' + (f"{v:.9g}").replace(".", ",") + '"' for v in row) + "\n" for row in zip(T, U, Y)))


@export("Windows line ends")
def _(path):
    text(path, "t,u,y\r\n" + rows(T, U, Y, end="\r\n"))


@export("old Macintosh line ends")
def _(path):
    text(path, "t,u,y\r" + rows(T, U, Y, end="\r"))


@export("byte order mark")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y), "utf-8-sig")


@export("UTF-16 with a mark, tabs (spreadsheet's Unicode text)")
def _(path):
    text(path, "t\tu\ty\r\n" + rows(T, U, Y, separator="\t", end="\r\n"), "utf-16")


@export("UTF-16 without a mark")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y), "utf-16-le")


@export("Latin-1 with a micro sign")
def _(path):
    text(path, "t [s];U [V];Weg [µm]\n" + rows(T, U, Y, separator=";"), "latin-1")


@export("gzip")
def _(path):
    with gzip.open(path, "wb") as file:
        file.write(("t,u,y\n" + rows(T, U, Y)).encode())


@export("empty line at the end, and text below the table")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y) + "\nend of data\n")


# ---- units and scales

@export("units in brackets")
def _(path):
    text(path, "Time [s],V_in [V],Position [um]\n" + rows(T, U, Y))


@export("units in parentheses: ms, mV, nm")
def _(path):
    text(path, "Time (ms),V_in (mV),Position (nm)\n" + rows(1e3 * T, 1e3 * U, 1e3 * Y))


@export("units behind an underscore or a slash")
def _(path):
    text(path, "t_us,drive/kV,pos_mm\n" + rows(1e6 * T, 1e-3 * U, 1e-3 * Y, form="%.12g"))


@export("a line of units under the names")
def _(path):
    text(path, "Time,Channel A,Position\n(ms),(V),(um)\n\n" + rows(1e3 * T, U, Y))


@export("a temperature in °C, in Latin-1", says=["in °C (by its name): 23 to 23 degC"])
def _(path):
    text(path, "Zeit [ms];Spannung [V];Weg [\xb5m];Temp. [\xb0C]\r\n" +
         rows(1e3 * T, U, Y, 0.0 * T + 23.0, separator=";", comma=True, end="\r\n"), encoding="latin-1")


@export("channels A and B", says=["'Channel A', taken for V"])
def _(path):
    text(path, "time,Channel A,Channel B\n" + rows(T, U, Y))


@export("columns chosen by the name as written, with its unit", "--drive U_V --displacement x_(um)")
def _(path):
    text(path, "t,w,U_V,x_(um)\n" + rows(T, REF, U, Y))


@export("two analog inputs", says=["'ai0', taken for V (by its place)"])
def _(path):
    text(path, "t,ai0,ai1\n" + rows(T, U, Y))


@export("metres")
def _(path):
    text(path, "t,drive,displacement [m]\n" + rows(T, U, 1e-6 * Y))


@export("drive before an amplifier with a gain of 20", "--drive-scale 20")
def _(path):
    text(path, "t,drive [V],position [um]\n" + rows(T, U / 20.0, Y))


@export("sensor in volts, 5 um/V", "--displacement-scale 5")
def _(path):
    text(path, "t,drive [V],sensor [V]\n" + rows(T, U, Y / 5.0))


@export("sensor in volts, nothing said", refused="displacement is column 3 'sensor' in V: say how many um")
def _(path):
    text(path, "t,drive [V],sensor [V]\n" + rows(T, U, Y / 5.0))


@export("several actuators, chosen by name", "--drive V2 --displacement X2")
def _(path):
    text(path, "t,V1,X1,V2,X2\n" + rows(T, 0 * U + 3.0, 0 * Y + 1.0, U, Y))


@export("several actuators, chosen by number", "--drive 4 --displacement 5")
def _(path):
    text(path, "t,V1,X1,V2,X2\n" + rows(T, 0 * U + 3.0, 0 * Y + 1.0, U, Y))


@export("a reference beside it")
def _(path):
    text(path, "t,setpoint,drive,position\n" + rows(T, REF, U, Y))


# ---- time

@export("no time, a rate given", "--sample-rate 1000")
def _(path):
    text(path, "drive,position\n" + rows(U, Y))


@export("no time, the rate in a header line")
def _(path):
    text(path, "# Sampling rate: 1 kHz\n# drive position\n" + rows(U, Y, separator=" "))


@export("no time, no rate", refused="neither a column of times nor a sample rate")
def _(path):
    text(path, "drive,position\n" + rows(U, Y))


@export("sample numbers and a rate", "--sample-rate 1000")
def _(path):
    text(path, "sample,drive,position\n" + rows(K, U, Y, form="%.9g"))


@export("stamps with three digits at 1 kHz")
def _(path):
    text(path, "t,u,y\n" + "".join(f"{t:.3f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


_jitter = np.random.default_rng(7).uniform(-0.35, 0.35, ROWS) / RATE
_jitter[0] = _jitter[-1] = 0.0


# Between the samples of a triangle no interpolation knows its tips: 3 % of the range there.
@export("stamps that jitter", tolerance=0.03)
def _(path):
    at = T + _jitter
    text(path, "t,u,y\n" + rows(at, np.interp(at, T, U), np.interp(at, T, Y), form="%.12g"))


@export("stamps in seconds since 1970")
def _(path):
    text(path, "timestamp,u,y\n" + "".join(f"{1.7e9 + t:.6f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("stamps as times of day")
def _(path):
    text(path, "t,u,y\n" + "".join(f"10:00:{t:09.6f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("date and time of day")
def _(path):
    text(path, "t;u;y\n" + "".join(f"2026-11-23 23:59:59,{k:03d};{u:.9g};{y:.9g}\n".replace("59:59", "59:%02d" % 30)
                                   for k, u, y in zip(range(400), U, Y)))


@export("a time column that contradicts the given rate", "--sample-rate 50", refused="the time column says 1000 Hz")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y))


@export("a gap", refused="gap in time")
def _(path):
    text(path, "t,u,y\n" + rows(np.delete(T, slice(100, 110)), np.delete(U, slice(100, 110)), np.delete(Y, slice(100, 110))))


@export("stamps that go back", refused="time stays or goes back")
def _(path):
    text(path, "t,u,y\n" + rows(np.where(K == 200, 0.1, T), U, Y))


@export("semicolons, and more empty rows than data (German spreadsheet)", says_not=["left out"])
def _(path):
    text(path, "Zeit [s];Spannung [V];Weg [um]\n" + rows(T, U, Y, separator=";", comma=True) + ";;\n" * 1000)


@export("empty rows of a spreadsheet before a summary", says=["left out: 51 lines behind the data"])
def _(path):
    text(path, "Time [s],Drive [V],Position [um]\n" + rows(T, U, Y) + ",,\n" * 50 + "Mean,50.0,7.1\n")


for end, what in (("\0" * 3000, "zeros behind the end, where a logger reserved room"),
                  ("\x1a", "the sign for the end of a file of DOS")):
    @export(what, says_not=["left out"])
    def _(path, end=end):
        text(path, "Time [s],Drive [V],Position [um]\n" + rows(T, U, Y) + end)


@export("300 columns", says=["left out: columns 257 to 303 are not read, 256 are"])
def _(path):
    text(path, "Time [s],Drive [V],Position [um]" + "".join(f",aux{i}" for i in range(300)) + "\n" +
         "".join(line + ",0.5" * 300 + "\n" for line in rows(T, U, Y).splitlines()))


@export("300 columns, the position last",
        refused="columns 257 to 303 are not read, 256 are: put what belongs together in a file each")
def _(path):
    text(path, "Time [s],Drive [V]" + "".join(f",aux{i}" for i in range(300)) + ",Position [um]\n" +
         "".join(f"{t:.9g},{u:.9g}" + ",0.5" * 300 + f",{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("two segments without times, an empty line between", "--sample-rate 1000",
        says=["1 empty line or remark among the data, the first before line 203: what stands around them is taken for one run"])
def _(path):
    text(path, "Drive [V],Position [um]\n" + rows(U[:200], Y[:200]) + "\n" + rows(U[200:], Y[200:]))


@export("an empty line behind each line, and no times", "--sample-rate 1000", says_not=["is that plausible"])
def _(path):
    text(path, "Drive [V],Position [um]\n\n" + rows(U, Y, end="\n\n"))
