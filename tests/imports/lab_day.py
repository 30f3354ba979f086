# SPDX-License-Identifier: GPL-3.0-or-later
"""A day's files of a laboratory, each of which was once taken wrongly without a word, or refused without need."""
import os

import numpy as np
import scipy.io
from measurement import export, K, rows, T, text, U, Y


# ---- names and units that do not stand over their columns by themselves

@export("blanks between columns, names with units behind blanks", says=["'drive' in V", "'position' in um"])
def _(path):
    np.savetxt(path, np.column_stack([T, U, Y]), header="time [s]  drive [V]  position [um]")


@export("blanks between columns, names with units, position first", says=["'position' in nm"])
def _(path):
    np.savetxt(path, np.column_stack([T, 1e3 * Y, U]), header="time [s] position [nm] voltage [V]")


@export("blanks between columns, names of several words between wide gaps", says=["'Piezo Voltage' in V"])
def _(path):
    np.savetxt(path, np.column_stack([T, Y, U]), header="Time (s)   Stage Position (um)   Piezo Voltage (V)")


@export("blanks between columns, commas between names", says=["'U' in V", "'x' in nm"])
def _(path):
    np.savetxt(path, np.column_stack([T, U, 1e3 * Y]), header="t/s, U/V, x/nm")


@export("blanks between columns, words above that are no names of theirs",
        refused="line 1 has 5 words over 3 columns, so what is what is not known: say it by number")
def _(path):
    np.savetxt(path, np.column_stack([T, Y, U]), header="time sensor position piezo voltage")


@export("Tektronix MSO 5: facts with empty fields between channels", "--displacement-scale 5",
        says=["'CH1' in V", "'CH2' in V, scaled"])
def _(path):
    text(path, "Model,MSO58\nFirmware Version,1.28.4\n\nWaveform Type,ANALOG\nHorizontal Units,s\nSample Interval,1e-3\n"
         "Record Length,400\nZero Index,0\nVertical Units,V,,V,,\nLabels,Drive monitor,,Position,,\n\nTIME,CH1,CH2\n" +
         rows(T, U, Y / 5.0))


@export("Tektronix MSO 5, nothing said of the sensor", refused="displacement is column 3 'CH2' in V: say how many um")
def _(path):
    text(path, "Model,MSO58\nHorizontal Units,s\nVertical Units,V,,V,,\n\nTIME,CH1,CH2\n" + rows(T, U, Y / 5.0))


@export("BenchVue: VDC")
def _(path):
    text(path, "Time,Drive (VDC),Position (um)\n" + rows(T, U, Y))


@export("Igor: text waves", "--sample-rate 1000", says=["'drive'", "'position'"])
def _(path):
    text(path, "IGOR\nWAVES/D\tposition\tdrive\nBEGIN\n" + "".join(f"\t{y:.9g}\t{u:.9g}\n" for y, u in zip(Y, U)) + "END\n")


# ---- times

@export("Arduino: milliseconds by the name alone", start=123.456)
def _(path):
    text(path, "boot v1.2\nsensor ok\nmillis,drive_V,pos_um\n" + rows(123456 + K, U, Y))


@export("Arduino: microseconds, whose counter of 32 bits begins anew", says=["the clock begins anew at line 112"])
def _(path):
    text(path, "micros,drive (V),pos (um)\n" + rows((2**32 - 110000 + 1000 * K) % 2**32, U, Y, form="%.10g"))


@export("milliseconds since 1970, by their size", start=1.7e9, says=["milliseconds since 1970"])
def _(path):
    text(path, "timestamp,drive_V,position_um\n" + rows(1.7e12 + K, U, Y, form="%.15g"))


@export("nanoseconds since 1970, by their size", start=1.7e9, says=["nanoseconds since 1970"])
def _(path):
    text(path, "timestamp,drive_V,position_um\n" +
         "".join(f"{1700000000000000000 + 1000000 * k},{u:.9g},{y:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export("times of day over midnight", says=["the clock begins anew at line 102"])
def _(path):
    at = 86399.9 + T
    text(path, "Time,Drive [V],Position [um]\n" + "".join(
        f"{int(t % 86400) // 3600:02d}:{int(t % 86400) // 60 % 60:02d}:{t % 60.0:06.3f},{u:.9g},{y:.9g}\n"
        for t, u, y in zip(np.round(at, 3), U, Y)))


@export("times in microseconds, which the header's rate says", says=["its rate says that they are us"])
def _(path):
    text(path, "Sampling rate: 1 kHz\ntime,drive,position\n" + rows(1e6 * T, U, Y))


@export("TwinCAT scope: keyed lines, a time in ms beside each signal", says=["in V (by its", "in um (by its"])
def _(path):
    keyed = (("Name", "Drive", "Position"), ("SymbolComment", "", ""), ("Data-Type", "REAL64", "REAL64"),
             ("SampleTime[ms]", "1", "1"), ("VariableSize", "8", "8"), ("SymbolName", "MAIN.fDrive", "MAIN.fPos"),
             ("Unit", "V", "um"), ("Offset", "0", "0"), ("ScaleFactor", "1", "1"))
    text(path, "Name;Scope Project\nFile;C:\\lab\\loop.svdx\n\n" +
         "".join(f"{key};{a};{key};{b}\n" for key, a, b in keyed) + "\n" +
         rows(1e3 * T, U, 1e3 * T, Y, separator=";", comma=True))


@export("whole numbers as times, no unit", refused="column 1 'time' are whole numbers without a unit, 1 apart: say the rate "
        "(hyst import --sample-rate: 1000 if they are ms, 1e+06 if us, 1 if s)")
def _(path):
    text(path, "time,drive,position\n" + rows(K, U, Y))


@export("a rate beyond any instrument", "--sample-rate 1e157", refused="a sample rate of 1e+157 Hz is not plausible")
def _(path):
    text(path, "drive (V),position (um)\n" + rows(U, Y))


@export("times beyond any instrument", refused="times 1e-43 s apart are not plausible")
def _(path):
    text(path, "time (s),drive (V),position (um)\n" + rows(1e-40 * T, U, Y))


@export("whole numbers as times, no unit, a rate given", "--sample-rate 1000", says=["its rate says that they are us"])
def _(path):
    text(path, "time,drive,position\n" + rows(1000 * K, U, Y))


@export("times in an unsaid unit, and no rate", says=["column 1 'time', taken for s"])
def _(path):
    text(path, "time,drive,position\n" + rows(T, U, Y))


@export("times in an unsaid unit that the rate confirms", says=["column 1 'time' (by its name)"], says_not=["taken for s"])
def _(path):
    text(path, "# sample_rate_hz: 1000\ntime,drive,position\n" + rows(T, U, Y))


@export("times in nanoseconds, nothing said, a rate given", "--sample-rate 1000", says=["its rate says that they are ns"])
def _(path):
    text(path, "time,drive,position\n" + rows(1e9 * T, U, Y))


@export("pandas: an index without a name, no rate", refused="neither a column of times nor a sample rate (column 1")
def _(path):
    text(path, ",drive_V,position_um\n" + rows(K, U, Y))


@export("pandas: time differences", start=0.0)
def _(path):
    text(path, ",drive_V,position_um\n" + "".join(
        f"0 days 00:00:00{f'.{1000 * k:06d}' if k else ''},{u:.9g},{y:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export("a second's stamp without a fraction before a comma")
def _(path):
    text(path, "timestamp,drive_V,position_um\n" + "".join(
        f"2026-11-23 10:00:0{k // 1000}{f'.{k % 1000:03d}' if k % 1000 else ''},{u:.9g},{y:.9g}\n"
        for k, u, y in zip(range(900, 1300), U, Y)))


@export("BenchLink: dates with colons before the milliseconds, alarms between", says=["'101 <Drive>' in VDC"])
def _(path):
    text(path, "Owner,lab\nAcquisition Date,3/12/2026 10:11:12 AM\n\n"
         "Scan,Time,101 <Drive> (VDC),Alarm 101,102 <Position> (um),Alarm 102\n" + "".join(
             f"{k + 1},03/12/2026 10:11:12:{k:03d},{u:+.8E},0,{y:+.8E},0\n" for k, u, y in zip(range(400), U, Y)), "utf-16")


@export("a time beside each signal, that of the position later", keys=["# displacement_sampled_after_s: 0.00025"],
        says=["later than the drive by 0.00025 s"])
def _(path):
    text(path, "Time (s),Drive (V),Time (s),Position (um)\n" + rows(T, U, T + 0.00025, Y, form="%.10g"))


@export("a time beside each signal, of which one drifts", refused="column 3 'Time' has other times than column 1 'Time'")
def _(path):
    text(path, "Time (s),Drive (V),Time (s),Position (um)\n" + rows(T, U, 1.01 * T, Y, form="%.10g"))


# ---- fields that are more than a number

@export("words in columns of their own: unit, flags, terminals", says=["left out: words in column"])
def _(path):
    text(path, "Index,Reading,Unit,Position (um),Unit,Start Group,Date,Relative Time (s),Terminals\n" + "".join(
        f"{k},{u:.9g},Volt DC,{y:.9g},um,F,03/12/2026,{t:.9g},Front\n" for k, t, u, y in zip(range(1, 401), T, U, Y)))


@export("units behind the numbers", says=["'drive' in V", "'position' in nm"])
def _(path):
    text(path, "time,drive,position\n" + "".join(f"{t:.9g} s,{u:.9g} V,{1e3 * y:.9g} nm\n" for t, u, y in zip(T, U, Y)))


@export("units behind the numbers, that change with the range", says=["'position' in"])
def _(path):
    text(path, "time,drive,position\n" + "".join(
        f"{t:.9g} s,{u:.9g} V,{1e3 * y if y < 11 else y:.9g} {'nm' if y < 11 else 'um'}\n" for t, u, y in zip(T, U, Y)))


@export("units behind the numbers, one of another quantity", refused="line 52: '1 A' where others are 'N V'")
def _(path):
    text(path, "time,drive,position\n" + "".join(
        f"{t:.9g} s,{1 if k == 50 else u:.9g} {'A' if k == 50 else 'V'},{y:.9g} um\n"
        for k, t, u, y in zip(range(400), T, U, Y)))


@export("MATLAB timetable: sec behind the times", start=0.0)
def _(path):
    text(path, "Time,Drive,Position\n" + "".join(f"{t:.9g} sec,{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("names before the numbers", says=["'u'", "'x' in um"])
def _(path):
    text(path, "".join(f"millis:{k},u:{u:.9g},x_um:{y:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export("a serial monitor's stamps, names before the numbers")
def _(path):
    text(path, "".join(f"10:11:12.{k:03d} -> ms:{k},x_um:{y:.9g},u:{u:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export("German thousands in part of the lines", refused="signs between thousands")
def _(path):
    german = lambda x: f"{x:,.3f}".replace(",", "_").replace(".", ",").replace("_", ".")
    text(path, "Zeit [ms];Spannung [V];Auslenkung [nm]\n" +
         "".join(f"{german(1e3 * t)};{german(u)};{german(1e3 * y)}\n" for t, u, y in zip(T, U, Y)))


# ---- structures of MATLAB

def save(path, **variables):
    scipy.io.savemat(path + ".mat", variables)
    os.replace(path + ".mat", path)


def structures(*elements):
    array = np.zeros((1, len(elements)), dtype=[(field, "O") for field in elements[0]])
    for i, element in enumerate(elements):
        array[0, i] = tuple(element.values())
    return array


@export("dSPACE ControlDesk .mat: structures of signals with names and units", says=["in V (by its name)", "in nm (by its name)"])
def _(path):
    signal = lambda name, data, unit: {"Name": name, "Type": "Signal", "Data": data[None, :], "Unit": unit, "XIndex": 1.0}
    save(path, loop_001={"X": structures({"Name": "time", "Data": T[None, :], "Unit": "s"}),
                         "Y": structures(signal('"Model Root"/"Position"/"Out1"', 1e3 * Y, "nm"),
                                         signal('"Model Root"/"Drive"/"Out1"', U, "V")),
                         "Capture": {"SamplingPeriod": 1e-3, "Length": 0.4}})


@export("Simulink: structure with time", says=["signals.drive", "signals.position"])
def _(path):
    signal = lambda name, data: {"values": data[:, None], "dimensions": 1.0, "label": name}
    save(path, ScopeData={"time": T[:, None], "signals": structures(signal("position", Y), signal("drive", U)),
                          "blockName": "model/Scope"})


# ---- samples that are missing

def holes(path, word, lines=(120, 121, 330)):
    text(path, "time (s),drive (V),position (um)\n" + "".join(
        f"{t:.9g},{u:.9g},{word if k in lines else f'{y:.9g}'}\n" for k, t, u, y in zip(range(400), T, U, Y)))


# A straight line over three samples of a loop that is straight there, but for its bend of 1e-4 um/V^2.
@export("overload in three lines, filled", "--fill-missing", tolerance=1e-4,
        says=["filled with straight lines: 3 of 400 lines of data cannot be read", "the longest run is 2"])
def _(path):
    holes(path, "OL")


# The names are above them, and are not the line that cannot be read.
for line in range(5):
    @export(f"overload in line {line + 1} of the data",
            refused=f"1 of 400 lines of data cannot be read: line {line + 2}: 'OL' is not a number")
    def _(path, line=line):
        holes(path, "OL", (line,))


@export("no number in lines 2 and 4 of the data, filled", "--fill-missing", tolerance=1e-4,
        says=["2 of 400 lines of data cannot be read: line 3: 'NaN' is not a number; line 5: 'NaN'"])
def _(path):
    holes(path, "NaN", (1, 3))


@export("overload in line 3, and no column of time", "--sample-rate 1000",
        refused="1 of 400 lines of data cannot be read: line 4: 'OL' is not a number")
def _(path):
    text(path, "drive (V),position (um)\n" + "".join(
        f"{'OL' if k == 2 else f'{u:.9g}'},{y:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export("overload in three lines, nothing said", refused="(hyst import --fill-missing: straight lines over them)")
def _(path):
    holes(path, "#N/A")


@export("NumPy: not a number in two rows", refused="column 3 'position' has no number in 2 rows, the first is row 121 "
                                                   "(hyst import --fill-missing: straight lines over them)")
def _(path):
    np.savez(path + ".npz", t=T, drive=U, position=np.where(np.isin(K, (120, 121)), np.nan, Y))
    os.replace(path + ".npz", path)


@export("NumPy: not a number in two rows, filled", "--fill-missing", tolerance=1e-4,
        says=["column 3 'position' has no number in 2 rows, the first is row 121: filled"])
def _(path):
    np.savez(path + ".npz", t=T, drive=U, position=np.where(np.isin(K, (120, 121)), np.inf, Y))
    os.replace(path + ".npz", path)


@export("a position that is never a number", "--fill-missing", refused="column 3 'position' has no number in 400 rows")
def _(path):
    np.savez(path + ".npz", t=T, drive=U, position=0.0 * Y + np.nan)
    os.replace(path + ".npz", path)


@export("SCPI's overload, 9.9E+37", refused="line 122: '9.9E+37' is not a number; line 123")
def _(path):
    holes(path, "9.9E+37")


# ---- what the columns say together

@export("LabJack: a signal raw and scaled", "--displacement-scale 5", tolerance=np.inf,
        says=["is that plausible? The displacement is the drive times 20, plus 0: the same signal twice"])
def _(path):
    text(path, "Time\tv0\ty0\n" + rows(T, U, 4.0 * U, separator="\t"))


@export("two inputs of a scope", refused="displacement is column 3 'IN2' in V: say how many um")
def _(path):
    text(path, '"Time (s)","IN1 (V)","IN2 (V)"\n' + rows(T, U, Y / 5.0))


@export("two inputs of a scope, 5 um/V", "--displacement-scale 5", says=["by place"])
def _(path):
    text(path, "Time (s),Input 1 (V),Input 2 (V)\n" + rows(T, U, Y / 5.0))


@export("a drive in percent of full scale", refused="drive is column 2 'Output' in %: say how many V")
def _(path):
    text(path, "Time (s),Output (%),Position (um)\n" + rows(T, U / 1.5, Y))


@export("a drive in percent of 150 V", "--drive-scale 1.5")
def _(path):
    text(path, "Time (s),Output (%),Position (um)\n" + rows(T, U / 1.5, Y))


@export("Igor: text waves with scales and units", start=0.5, says=["line 406: SetScale", "'position' in m", "'drive' in V"])
def _(path):
    text(path, "IGOR\nWAVES/D\tposition\tdrive\nBEGIN\n" +
         "".join(f"\t{1e-6 * y:.9g}\t{u:.9g}\n" for y, u in zip(Y, U)) + "END\n"
         'X SetScale/P x 500,1,"ms", position; SetScale y 0,0,"m", position\n'
         'X SetScale/P x 500,1,"ms", drive; SetScale d 0,0,"V", drive\n')
