# SPDX-License-Identifier: GPL-3.0-or-later
"""Files as strangers' laboratories have them: other alphabets and encodings, rates and scales in words, several tables."""
import os

import h5py
import numpy as np
import scipy.io
from measurement import export, K, rows, T, text, U, Y


def moved(path, write, name):
    """What a library writes under a name of its own choice."""
    write(path + name)
    os.replace(path + name, path)


# ---- names in other letters, and the encodings of their regions

for encoding, shown in (("cp1251", "Windows-1251"), ("koi8-r", "KOI8-R"), ("cp866", "code page 866"), ("utf-8", "UTF-8")):
    @export(f"Russian names, {shown}, the position first",
            says=[f"text ({shown})", "'Перемещение' in нм", "'Напряжение' in В"])
    def _(path, encoding=encoding):
        text(path, "Время, мс;Перемещение, нм;Напряжение, В\r\n" +
             rows(1e3 * T, 1e3 * Y, U, separator=";", comma=True, end="\r\n"), encoding)


@export("Russian names without units, the position first", says=["'Управляющее напряжение', taken for V (by its name)"])
def _(path):
    text(path, "Время;Положение;Управляющее напряжение\n" + rows(T, Y, U, separator=";", comma=True))


for encoding, shown in (("cp932", "Shift-JIS"), ("euc-jp", "EUC-JP")):
    @export(f"Japanese names, {shown}, the position first", says=[f"text ({shown})", "'変位' in μm", "'印加電圧' in V"])
    def _(path, encoding=encoding):
        text(path, "時間(ms),変位(μm),印加電圧(V)\r\n" + rows(1e3 * T, Y, U, end="\r\n"), encoding)


@export("Chinese names, GB 18030, the position first", says=["text (GB 18030)", "'位移' in μm", "'驱动电压' in V"])
def _(path):
    text(path, "时间(s),位移(μm),驱动电压(V)\r\n" + rows(T, Y, U, end="\r\n"), "gb18030")


@export("Chinese names without units, the position first", says=["'电压', taken for V (by its name)"])
def _(path):
    text(path, "时间,位移,电压\n" + rows(T, Y, U))


@export("Korean names, EUC-KR, the position first", says=["text (EUC-KR)", "'변위' in um"])
def _(path):
    text(path, "시간(s),변위(um),전압(V)\n" + rows(T, Y, U), "euc-kr")


@export("German names, code page 850", says=["text (code page 850)", "'Länge' in µm"])
def _(path):
    text(path, "Zeit [s];Länge [µm];Spannung [V]\r\n" + rows(T, Y, U, separator=";", comma=True, end="\r\n"), "cp850")


@export("Polish names without units, the position first", says=["'napięcie', taken for V (by its name)"])
def _(path):
    text(path, "czas;przemieszczenie;napięcie\n" + rows(T, Y, U, separator=";", comma=True))


@export("names in a language that is not known",
        refused="2 columns could be the drive: 2 'siirtyma' (unknown), 3 'jannite'")
def _(path):
    text(path, "aika;siirtyma;jannite\n" + rows(T, Y, U, separator=";", comma=True))


@export("names that differ in their numbers alone", says=["by place"])
def _(path):
    text(path, "Kanava 1;Kanava 2;Kanava 3\n" + rows(T, U, Y, separator=";", comma=True))


# ---- units and numbers in other spellings

for unit, factor in (("\u00C5", 1e4), ("\u212B", 1e4), ("Angstrom", 1e4), ("㎛", 1.0), ("mkm", 1.0)):
    @export(f"a position in {unit}, U+{ord(unit[0]):04X}", says=[f"'position' in {unit}"])
    def _(path, unit=unit, factor=factor):
        text(path, f"t [s],position [{unit}],drive [V]\n" + rows(T, factor * Y, U))


for unit, seconds in (("h", 3600.0), ("days", 86400.0), ("100 ns", 1e-7)):
    @export(f"times in {unit}")
    def _(path, unit=unit, seconds=seconds):
        text(path, f"Time ({unit}),Drive (V),Position (um)\n" + rows(T / seconds, U, Y, form="%.15g"))


@export("a remark in brackets behind the unit",
        says=["'Current Position (axis 1)' in µm", "'Control Voltage (axis 1)' in V"])
def _(path):
    text(path, "Time/s\tTarget Position/µm (axis 1)\tCurrent Position/µm (axis 1)\tControl Voltage/V (axis 1)\n" +
         rows(T, 0.15 * U, Y, U, separator="\t"))


@export("a printed minus, U+2212", tolerance=1e-6)
def _(path):
    text(path, "t [s],drive [kV],position [um]\n" + "".join(
        f"{t - 0.2:.9g},{u * 1e-3:.9e},{y:.9g}\n" for t, u, y in zip(T, U, Y)).replace("-", "\u2212"))


@export("Fortran's exponents", says=["'drive'"])
def _(path):
    text(path, "  t             drive            position\n" +
         "".join(f"  {t:.9E}  {u:.9E}  {y:.9E}\n".replace("E", "D") for t, u, y in zip(T, U, Y)))


@export("Graphtec: blanks behind signs", "--time none --sample-rate 1000")
def _(path):
    text(path, '"Vendor","GRAPHTEC"\n"Number","CH1","CH2"\n"NO.","V","um"\n' +
         "".join(f"{k + 1},+ {u:.9g},+ {y:.9g}\n" for k, u, y in zip(K, U, Y)))


for name, separator, between in (("English thousands of whole numbers between tabs", "\t", ","),
                                 ("German thousands of whole numbers", ";", ".")):
    @export(name, refused="column 3 has signs between thousands")
    def _(path, separator=separator, between=between):
        text(path, separator.join(("t [ms]", "drive [V]", "position [nm]")) + "\n" + "".join(
            f"{k}{separator}{u:.0f}{separator}{1e3 * y:_.0f}\n".replace("_", between) for k, u, y in zip(K, U, Y)))


@export("English thousands of whole numbers in quotes", refused="column 3 has signs between thousands")
def _(path):
    text(path, "t [ms],drive [V],position [nm]\n" + "".join(f'"{k}","{u:.0f}","{1e3 * y:,.0f}"\n'
         for k, u, y in zip(K, U, Y)))


# ---- rates and times in words

for fact in ("Sample Interval: 1.0 mS", "Sampling interval = 1 msec.", "Sampling rate: 1 ms", "Sample rate: 1 kSps",
             "Sampling cycle,1000us", "# frame rate: 1000 Hz", "#CLOCK=1.000mS"):
    @export(f"a rate as '{fact}'")
    def _(path, fact=fact):
        text(path, fact + "\ndrive (V),position (um)\n" + rows(U, Y))


for fact in ("Sample rate: 1,000 Hz", "Sample rate: 5 furlongs"):
    @export(f"a rate as '{fact}'", refused="no column of times, and the sample rate in line 1 is not understood")
    def _(path, fact=fact):
        text(path, fact + "\ndrive (V)\tposition (um)\n" + rows(U, Y, separator="\t"))


# A step of 1 ms is 1.16e-8 days; beside 46355.5 days a double resolves 7e-12.
@export("spreadsheet: dates as days since 1900", start=(46355.5 - 25569.0) * 86400.0,
        says=["days since 1900, as their size says"])
def _(path):
    text(path, "Date,Drive [V],Position [um]\n" + "".join(f"{46355.5 + t / 86400.0:.12f},{u:.9g},{y:.9g}\n"
         for t, u, y in zip(T, U, Y)))


@export("MATLAB: datenum", says=["days since the year 0, as their size says"])
def _(path):
    text(path, "tnum,drive [V],position [um]\n" + "".join(f"{739950.5 + t / 86400.0:.12f},{u:.9g},{y:.9g}\n"
         for t, u, y in zip(T, U, Y)))


@export("Windows: file times", says=["100 ns each since 1601"])
def _(path):
    text(path, "timestamp,drive [V],position [um]\n" +
         "".join(f"{133500000000000000 + 10000 * k},{u:.9g},{y:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export(".NET: ticks", says=["100 ns each since the year 1"])
def _(path):
    text(path, "Ticks,drive [V],position [um]\n" +
         "".join(f"{638680000000000000 + 10000 * k},{u:.9g},{y:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export("MATLAB: dates with months in letters", says=["1000 Hz"])
def _(path):
    text(path, "Time,Drive (V),Position (um)\n" +
         "".join(f"29-Nov-2026 10:11:12.{k:03d},{u:.9g},{y:.9g}\n" for k, u, y in zip(range(400), U, Y)))


@export("two columns of times before the signals, of which one is slower",
        refused="column 2 't_pos' has other times than column 1")
def _(path):
    text(path, "t_drive (s),t_pos (s),Drive (V),Position (um)\n" + rows(T, 2 * T, U, Y))


@export("two columns of times before the signals, one chosen", "--time 1")
def _(path):
    text(path, "t_drive (s),t_pos (s),Drive (V),Position (um)\n" + rows(T, 2 * T, U, Y))


@export("a date to the second, and milliseconds in a column of their own", says=["'Time + ms'"])
def _(path):
    text(path, "Date,Time,ms,Drive (V),Position (um)\n" + "".join(
        f"2026-11-29,10:11:{12 + k // 1000},{k % 1000},{u:.9g},{y:.9g}\n" for k, u, y in zip(range(700, 1100), U, Y)))


@export("ROS: seconds and nanoseconds", says=["'secs + nsecs'"])
def _(path):
    text(path, "secs,nsecs,drive (V),position (um)\n" + "".join(
        f"{1700000000 + k // 1000},{k % 1000 * 1000000},{u:.9g},{y:.9g}\n" for k, u, y in zip(range(700, 1100), U, Y)))


# ---- instruments

@export("Rohde & Schwarz RTO: header and values in one file, no times", "--displacement-scale 5", start=-0.2,
        says=["in V, scaled"])
def _(path):
    text(path, "BaseUnit:V:\nResolution:0.001:\nXStart:-0.2:\nXStop:0.2:\nRecordLength:400:\nMultiChannelSource:C1W1:C2W1:\n" +
         rows(U, Y / 5.0, separator=";"))


@export("Igor: a block of text for each wave", start=0.5, says=["'Position' in m", "'Drive' in V"])
def _(path):
    scale = lambda name, unit: f'X SetScale/P x 500,1,"ms", {name}; SetScale y 0,0,"{unit}", {name}\n'
    text(path, "IGOR\n" + "".join(f"WAVES/D/O\t{name}\nBEGIN\n" + "".join(f"\t{x:.9g}\n" for x in value) + "END\n" +
                                  scale(name, unit)
                                        for name, value, unit in (("Position", 1e-6 * Y, "m"), ("Drive", U, "V"))))


@export("Igor: waves of different lengths", refused="line 405: a wave of 399 points, others have 400")
def _(path):
    text(path, "IGOR\n" + "".join(f"WAVES\t{name}\nBEGIN\n" + "".join(f"\t{x:.9g}\n" for x in value) + "END\n"
                                  for name, value in (("Position", Y), ("Drive", U[1:]))))


@export("SignalExpress: facts over the columns, by name", start=0.0)
def _(path):
    text(path, "channel names:\nDrive\tPosition\nstart times:\n11/29/2026 10:11:12.000\t11/29/2026 10:11:12.000\ndt:\n"
         "0.001000\t0.001000\ndata:\n" + rows(U, Y, separator="\t"))


@export("Moku: inputs with letters, remarks with %", "--displacement-scale 5",
        says=["'Input A' in V", "'Input B' in V"])
def _(path):
    text(path, "% Moku:Pro Data Logger\n% Channel A, DC coupling, 1MOhm\n% Acquisition rate: 1.000000e+03 Hz, Precision mode\n"
         "% Time (s), Input A (V), Input B (V)\n" + rows(T, U, Y / 5.0, separator=", "))


@export("HBM catman: a line of rates below the names", says=["'Time  1 - default sample rate'", "'WA' in µm"])
def _(path):
    text(path, "HBM_CATMAN_DATAFILE_40\n\n1\nChannels:\t3\n\nTime  1 - default sample rate [s]\tDrive [V]\tWA [µm]\n"
         "1.000 kHz\t\t\n" + rows(T, U, Y, separator="\t", comma=True), "latin-1")


@export("Hantek: the unit of all channels in the header", "--displacement-scale 5", says=["in V, scaled"])
def _(path):
    text(path, "#CHANNEL:,CH1,CH2\n#SIZE=400\n#CLOCK=1.000mS\n#UNITS:V\n\n" + rows(K, U, Y / 5.0))


@export("Owon: mV of all channels in the header, facts below the names", "--displacement-scale 5", says=["in mV"])
def _(path):
    text(path, "Unit:(mV)\n,CH1,CH2\nFrequency,2.5Hz,2.5Hz\nTime interval,1.000ms,\n" + rows(K, 1e3 * U, 1e3 * Y / 5.0))


@export("SmarAct: frame rate, pm, a voltage beside it")
def _(path):
    text(path, "# PicoScale data\n# frame rate: 1000 Hz\nIndex;Ch1 Position (pm);Analog In 0 (V)\n" +
         rows(K, 1e6 * Y, U, separator=";", form="%.12g"))


@export("markdown: a drawn line below the names", says=["'drive' in mV", "'position' in nm"])
def _(path):
    text(path, "| time (ms) | position (nm) | drive (mV) |\n|---|---|---|\n" +
         "".join(f"| {1e3 * t:.6g} | {1e3 * y:.9g} | {1e3 * u:.9g} |\n" for t, u, y in zip(T, U, Y)))


# ---- what a name says of a scale

for name in ("HV monitor (1:100) [V]", "Vin x20 (V)", "Drive/20 [V]", "Drive V/20"):
    @export(f"a drive named '{name}'",
            refused="whose name states a scale: say how many V that is (hyst import --drive-scale N)")
    def _(path, name=name):
        text(path, f"time (s),{name},Position (um)\n" + rows(T, U / 20.0, Y))


@export("a drive named 'Vin x20', scaled", "--drive-scale 20")
def _(path):
    text(path, "time (s),Vin x20 (V),Position (um)\n" + rows(T, U / 20.0, Y))


@export("a factor for each column in the header",
        refused="drive is column 4 'drive', for which the header states a scale")
def _(path):
    text(path, "name,time,position,drive\nunit,s,um,V\nscale,1,5,20\n" +
         "".join(f"{k},{t:.9g},{y / 5.0:.9g},{u / 20.0:.9g}\n" for k, t, u, y in zip(K, T, U, Y)))


@export("a factor for each column in the header, applied", "--drive-scale 20 --displacement-scale 5",
        says=["'position' in um, scaled"])
def _(path):
    text(path, "name,time,position,drive\nunit,s,um,V\nscale,1,5,20\n" +
         "".join(f"{k},{t:.9g},{y / 5.0:.9g},{u / 20.0:.9g}\n" for k, t, u, y in zip(K, T, U, Y)))


for head, tail, line in (("# Channel 1: drive, unit mV\n# Channel 2: position, unit nm\n", "", 1),
                         ("# units: drive=mV, position=nm\n", "", 1), ("", "units: s, mV, nm\n", 402)):
    @export(f"units in prose, line {line}: '{(head + tail).splitlines()[0]}'",
            refused=f"drive is column 2 'drive' without a unit, and line {line} names another than V")
    def _(path, head=head, tail=tail):
        text(path, head + "time [s],drive,position\n" + rows(T, 1e3 * U, 1e3 * Y) + tail)


@export("units in prose, of the times as well", "--drive-scale 0.001 --displacement-scale 0.001",
        refused="time is column 1 'time' without a unit, and line 1 names another than s: say the rate (hyst import "
                "--sample-rate: 1 or 1000)")
def _(path):
    text(path, "# units: time=ms, drive=mV, position=nm\ntime,drive,position\n" + rows(1e3 * T + 0.5, 1e3 * U, 1e3 * Y))


for names in ("Time {ms},Position {nm},Drive {mV}", "Time <ms>,Position <nm>,Drive <mV>", "Time:ms,Position:nm,Drive:mV",
              "Time..ms.,Position..nm.,Drive..mV.", "timeMs,positionNm,driveMv",
              "Time in milliseconds,Position in nanometers,Drive in millivolts", "Time (ms),Position (nm),Drive (mVolt)"):
    @export(f"units as in '{names}'", start=0.0005)
    def _(path, names=names):
        text(path, names + "\n" + rows(1e3 * T + 0.5, 1e3 * Y, 1e3 * U))


@export("units as in 'Âµs', which was read as Latin-1 once")
def _(path):
    text(path, "Time (Âµs),Position (Âµm),Drive (V)\n" + rows(1e6 * T, Y, U, form="%.12g"))


@export("spreadsheet: names of two lines in quotes", start=0.0005, says=["'position' in nm", "'drive' in mV"])
def _(path):
    text(path, '"time\n(ms)","position\n(nm)","drive\n(mV)"\n' + rows(1e3 * T + 0.5, 1e3 * Y, 1e3 * U))


@export("spreadsheet: names of two lines in quotes, and a gap", refused="line 205: gap in time")
def _(path):
    text(path, '"time\r\n(s)","position\r\n(um)","drive\r\n(V)"\r\n' +
         rows(np.where(K < 200, T, T + 0.01), Y, U, end="\r\n"))


@export("pandas: Unnamed: 0 over the index", says=["'drive' in V"])
def _(path):
    text(path, "Unnamed: 0,time_ms,drive_V,position_um\n" + rows(K, 1e3 * T, U, Y))


@export("'in mV' below the names", says=["'drive' in mV", "'position' in nm"])
def _(path):
    text(path, "time;position;drive\nin ms;in nm;in mV\n" + rows(1e3 * T, 1e3 * Y, 1e3 * U, separator=";", comma=True))


# ---- several tables, and remarks

@export("a table for each channel", refused="line 405 has names again, 'Time (s),Position (um)': another table begins")
def _(path):
    text(path, "[Channel 1]\nTime (s),Drive (V)\n" + rows(T, U) + "\n[Channel 2]\nTime (s),Position (um)\n" +
         rows(T, Y))


@export("a second table with its columns in another order", "--fill-missing",
        refused="line 405 has names again, 'Time (s),Position (um),Drive (V)': another table begins")
def _(path):
    text(path, "Run 1\nTime (s),Drive (V),Position (um)\n" + rows(T, U, Y) +
         "\nRun 2\nTime (s),Position (um),Drive (V)\n" +
         rows(T + 0.4, Y, U))


@export("NumPy savetxt twice, its columns in another order", "--sample-rate 1000",
        refused="line 202 has names again, '# position drive'")
def _(path):
    text(path, "# drive position\n" + rows(U[:200], Y[:200], separator=" ") + "# position drive\n" +
         rows(Y[200:], U[200:], separator=" "))


@export("a summary below the table", refused="line 404 has names again, 'min,max,mean'")
def _(path):
    text(path, "t [s],drive [V],position [um]\n" + rows(T, U, Y) + "\nSummary\nmin,max,mean\n0,100,50\n")


@export("two tables side by side, one of them shorter",
        refused="columns 3 'Time 2 (s)', 4 'Position (um)' have numbers in a part of the lines only: put what belongs together")
def _(path):
    text(path, "Time 1 (s),Drive (V),Time 2 (s),Position (um)\n" + "".join(
        f"{T[k]:.9g},{U[k]:.9g}," + (f"{T[2 * k]:.9g},{Y[2 * k]:.9g}\n" if k < 200 else ",\n") for k in range(400)))


@export("remarks with % and // among the data")
def _(path):
    text(path, "t [s],drive [V],position [um]\n" + rows(T[:200], U[:200], Y[:200]) + "// second half\n% pause, 3 s\n" +
         rows(T[200:], U[200:], Y[200:]))


@export("sixty sensors",
        refused="60 columns could be the displacement: 2 'Sensor 0 displacement of the s' in um (displacement)")
def _(path):
    text(path, "time (s)," + ",".join(f"Sensor {i} displacement of the stage number {i} (um)" for i in range(60)) +
         ",Drive (V)\n" + rows(T, *[Y + i for i in range(60)], U))


# ---- files that are no text

@export("MATLAB 4 .mat")
def _(path):
    moved(path, lambda name: scipy.io.savemat(name, {"t": T[:, None], "position_um": Y[:, None], "drive": U[:, None]},
                                              format="4"), ".mat")


@export("MATLAB 5 .mat, a structure for each sample", says=["'data.drive'", "'data.position'"])
def _(path):
    array = np.zeros((1, 400), dtype=[("t", "O"), ("position", "O"), ("drive", "O")])
    for k in range(400):
        array[0, k] = (T[k], Y[k], U[k])
    moved(path, lambda name: scipy.io.savemat(name, {"data": array}), ".mat")


@export("MATLAB 5 .mat, a cell for each signal", "--displacement data{3}", says=["'data{2}'"])
def _(path):
    cells = np.empty((1, 3), dtype=object)
    cells[0, 0], cells[0, 1], cells[0, 2] = T[:, None], U[:, None], Y[:, None]
    moved(path, lambda name: scipy.io.savemat(name, {"data": cells}), ".mat")


@export("NumPy .npz, dates as datetime64", says=["'time' (by its name)"])
def _(path):
    stamps = np.datetime64("2026-11-29T10:11:12", "ns") + np.arange(400) * np.timedelta64(1000000, "ns")
    moved(path, lambda name: np.savez(name, time=stamps, drive=U, position=Y), ".npz")


@export("NumPy .npy of three dimensions, one of a single element")
def _(path):
    moved(path, lambda name: np.save(name, np.vstack([T, U, Y])[None]), ".npy")


@export("NumPy .npy of three dimensions", refused="an array of 3 dimensions: save one run of it, samples by signals")
def _(path):
    moved(path, lambda name: np.save(name, np.stack([np.vstack([T, U, Y])] * 2)), ".npy")


for name, number in (("samplerate", 1000.0), ("fs_kHz", 1.0), ("dt_ms", 1.0)):
    @export(f"NumPy .npz, the rate as {name}", says=["1000 Hz"])
    def _(path, name=name, number=number):
        moved(path, lambda file: np.savez(file, voltage=U, displacement_nm=1e3 * Y, **{name: number}), ".npz")


@export("HDF5, a table of structures", says=["'drive'", "'position' in nm"])
def _(path):
    table = np.zeros(400, dtype=[("t", "f8"), ("position_nm", "f4"), ("drive", "f8"), ("note", "S4")])
    table["t"], table["position_nm"], table["drive"] = T, 1e3 * Y, U
    with h5py.File(path, "w") as file:
        file["run/data"] = table


@export("HDF5, units in capitals, a dimension of a single element", says=["'position' in nm"])
def _(path):
    with h5py.File(path, "w") as file:
        for name, value, unit in (("t", 1e3 * T, "ms"), ("drive", 1e3 * U, "mV"), ("position", 1e3 * Y, "nm")):
            file[name] = value[None, :, None]
            file[name].attrs["Units"] = unit


@export("netCDF: numbers packed as CF says", says=["'drive' in V", "'position' in nm"], tolerance=1e-4)
def _(path):
    with h5py.File(path, "w") as file:
        file["t"] = T
        for name, value, factor, offset, unit in (("drive", U, 0.01, 50.0, "V"), ("position", 1e3 * Y, 1.0, 0.0, "nm")):
            file[name] = np.round((value - offset) / factor).astype("i4")
            file[name].attrs["scale_factor"], file[name].attrs["add_offset"] = factor, offset
            file[name].attrs["units"] = unit


@export("netCDF: a fill value", refused="column 2 'position' has no number in 2 rows, the first is row 6")
def _(path):
    with h5py.File(path, "w") as file:
        file["t"], file["drive"], file["position"] = T, U, np.where((K == 5) | (K == 9), -999.0, Y)
        file["position"].attrs["_FillValue"] = -999.0


@export("HDF5, a gain that may have been applied", refused="displacement is column 2 'position', for which the header states a scale")
def _(path):
    with h5py.File(path, "w") as file:
        file["t"], file["drive"], file["position"] = T, U, np.round(1e3 * Y)
        file["position"].attrs["gain"] = 0.001


for name, content, refused in (("a sound file", b"RIFF" + bytes(800), "a sound file"),
                               ("a file packed by xz", b"\xFD7zXZ\0" + bytes(800), "packed in another way than gzip: unpack it"),
                               ("a Tektronix .isf", b":WFMPRE:BYT_NR 2;BIT_NR 16;:CURVE #3800" +
                               bytes(800), "an oscilloscope's own file"),
                               ("a LeCroy .trc", b"#9000000800WAVEDESC\0\0LECROY_2_3\0" +
                                bytes(800), "an oscilloscope's own file"),
                               ("a Parquet file", b"PAR1" + bytes(800), "a Parquet file: save it as CSV"),
                               ("a web page named .xls", b"<html><table><tr><td>t</td></tr></table>\n", "HTML or XML"),
                               ("a list of JSON", b"[\n[0, 1, 2],\n[1, 2, 3]\n]\n", "JSON, no table of measurements")):
    @export(name, refused=refused)
    def _(path, content=content):
        with open(path, "wb") as file:
            file.write(content)
