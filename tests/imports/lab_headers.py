# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of columns as laboratories and their instruments write them: which column is what, and where that is not clear."""
import numpy as np
from measurement import export, K, REF, rows, T, text, U, Y

MONITOR = 0.98 * U + 0.3  # of the same drive: taken for the displacement, it would make a perfect model
ERROR = REF - Y


def table(path, names, *columns, separator=",", comma=False, encoding="utf-8", form="%.9g"):
    text(path, names + "\n" + rows(*columns, separator=separator, comma=comma, form=form), encoding)


# ---- by the words in the names

@export("a command, its monitor and a sensor", says=["voltage      column 3 'Monitor Voltage'"])
def _(path):
    table(path, "time,Command Voltage,Monitor Voltage,Capacitive Sensor", T, U, MONITOR, Y)


@export("German: position before voltage")
def _(path):
    table(path, "Zeit;Weg;Spannung", T, Y, U, separator=";")


@export("German: an index first", says=["not used     column 1 'Index' (counter)"])
def _(path):
    table(path, "Index;Zeit;Spannung;Weg", K, T, U, Y, separator=";")


@export("German: wanted and actual voltage, and travel", says=["voltage      column 3 'Istspannung'"])
def _(path):
    table(path, "Zeit/s;Sollspannung/V;Istspannung/V;Auslenkung/µm", T, U, MONITOR, Y, separator=";", comma=True)


@export("German: control loop", says=["reference    column 2 'Sollwert'", "(control error)"])
def _(path):
    table(path, "Zeitstempel;Sollwert;Istwert;Regelabweichung;Stellgröße", T, REF, Y, ERROR, U, separator=";",
          encoding="latin-1")


@export("German: words put together", says=["5 'Abtastung' (counter)"])
def _(path):
    table(path, "Piezospannung [V];Wegsensor [nm];Sollposition [nm];Messzeit [ms];Abtastung", U, 1e3 * Y, 1e3 * REF, 1e3 * T,
          K, separator=";", comma=True)


@export("French", says=["'Déplacement' in µm"])
def _(path):
    table(path, "Temps (s);Tension de commande (V);Déplacement (µm);Température (°C)", T, U, Y, 0.0 * T + 21.0, separator=";",
          comma=True)


@export("French: set point and position of a sensor")
def _(path):
    table(path, "temps;consigne;capteur de position;tension", T, REF, Y, U, separator=";", comma=True)


@export("Italian")
def _(path):
    table(path, "Tempo [s];Tensione [V];Spostamento [um]", T, U, Y, separator=";", comma=True)


@export("Spanish")
def _(path):
    table(path, "Tiempo [s];Voltaje [V];Posición [um]", T, U, Y, separator=";", comma=True)


@export("input and output voltage of an amplifier, x", says=["voltage      column 3 'Vout'"])
def _(path):
    table(path, "t,Vin,Vout,x", T, U, MONITOR, Y)


@export("a control loop with its error first", says=["reference    column 3 'Setpoint'", "2 'Position Error' (control error)"])
def _(path):
    table(path, "Time,Position Error,Setpoint,Position,Control Output", T, ERROR, REF, Y, U)


@export("a strain gauge in volts", refused="displacement is column 2 'strain_gauge' in V: say how many um")
def _(path):
    table(path, "time,strain_gauge_V,piezo_voltage_V", T, Y / 5.0, U)


@export("a strain gauge in volts, 5 um/V", "--displacement-scale 5")
def _(path):
    table(path, "time,strain_gauge_V,piezo_voltage_V", T, Y / 5.0, U)


@export("a sensor that is a voltage by its name alone", refused="'Sensor Voltage', by its name a voltage: say how many um")
def _(path):
    table(path, "Time,Piezo Command,Sensor Voltage", T, U, Y / 5.0)


@export("digits of a converter", refused="displacement is column 3 'encoder' in counts: say how many um")
def _(path):
    table(path, "time_s,dac_volts,encoder_counts", T, U, 100.0 * Y)


@export("units alone, as names")
def _(path):
    table(path, "s,V,µm", T, U, Y)


@export("units within names", says=["'Voltage CH1' in V", "'Position CH2' in nm"])
def _(path):
    table(path, "Time (ms) ,Voltage (V) CH1,Position [ nm ] CH2", 1e3 * T, U, 1e3 * Y)


@export("units with a full stop, a line of units in brackets")
def _(path):
    text(path, "Time\tDrive\tPosition\n[ sec. ]\t[ mV ]\t[ nm ]\n" + rows(T, 1e3 * U, 1e3 * Y, separator="\t"))


# ---- as programs and instruments write them

@export("NI DAQ: channels of a device", says=["(the only column left)"])
def _(path):
    table(path, "Time,Dev1/ao0,Dev1/ai0", T, U, Y)


@export("NI DAQ: Voltage_0 and Voltage_1", "--displacement-scale 5", says=["'Voltage_0' in V (by its place)"])
def _(path):
    table(path, "Time (s),Voltage_0 (V),Voltage_1 (V)", T, U, Y / 5.0)


@export("LabVIEW: a graph, exported", says=["by place: no name or unit says which"])
def _(path):
    table(path, "Time - Plot 0\tAmplitude - Plot 0\tTime - Plot 1\tAmplitude - Plot 1", T, U, T, Y, separator="\t")


@export("dSPACE ControlDesk: paths of a model")
def _(path):
    text(path, "Platform,DS1202\nDuration,0.4\nPath,,\n"
         'Time,"Model Root/Position Sensor/Out1","Model Root/Controller/Control Output/Out1"\n' + rows(T, Y, U))


@export("Simulink: logged signals")
def _(path):
    table(path, "Time,Plant/Input Voltage:1,Plant/Position:1", T, U, Y)


@export("Polytec vibrometer", says=["'Vib Displacement' in m"])
def _(path):
    text(path, "Source File Name: scan.pvd\nSignal: Vib & Ref1\nTime\tVib Displacement\tRef1 Voltage\n[ s ]\t[ m ]\t[ V ]\n" +
         rows(T, 1e-6 * Y, U, separator="\t"))


@export("SIOS interferometer")
def _(path):
    table(path, "Zeit [ms]\tLänge 1 [nm]\tSpannung [V]", 1e3 * T, 1e3 * Y, U, separator="\t", comma=True)


@export("attocube: two axes", refused="2 columns could be the displacement: 2 'Displacement Axis 1' in pm")
def _(path):
    table(path, "Time (s),Displacement Axis 1 (pm),Displacement Axis 2 (pm),Piezo (V)", T, 1e6 * Y, 5e5 * Y, U)


@export("attocube: two axes, one chosen", "--displacement 2")
def _(path):
    table(path, "Time (s),Displacement Axis 1 (pm),Displacement Axis 2 (pm),Piezo (V)", T, 1e6 * Y, 5e5 * Y, U)


GCS = ("#REM E-727\n#\n# VERSION = 1\n# TYPE = 1\n# SEPARATOR = 32\n# DIM = 3\n# SAMPLE_TIME = 0.001\n# NDATA = 400\n#\n"
       "# NAME0 = Target Position of axis 1\n# NAME1 = Current Position of axis 1\n"
       "# NAME2 = Control Voltage of output chan 1\n{units}# END_HEADER\n")


@export("PI GCS array: names and sample time in its header", says=["reference    column 1 'Target Position of axis 1'"])
def _(path):
    text(path, GCS.format(units="") + rows(REF, Y, U, separator=" "))


@export("PI GCS array with units", says=["'Current Position of axis 1' in nm"])
def _(path):
    text(path, GCS.format(units="# UNIT0 = nm\n# UNIT1 = nm\n# UNIT2 = V\n") + rows(1e3 * REF, 1e3 * Y, U, separator=" "))


@export("Keithley KickStart", says=["1 'Reading #' (counts)"])
def _(path):
    table(path, "Reading #,Relative Time (s),Source Voltage (V),Displacement (um)", K, T, U, Y)


@export("Thorlabs Kinesis", says=["voltage      column 3 'Output Voltage'"])
def _(path):
    table(path, "Time (s),Command Voltage (V),Output Voltage (V),Strain Gauge Position (um)", T, U, MONITOR, Y)


@export("Zygo ZMI")
def _(path):
    table(path, "Time(sec)\tPosition(nm)\tDrive(V)", T, 1e3 * Y, U, separator="\t")


@export("Micro-Epsilon: channels by their units", says=["(by its unit)"])
def _(path):
    table(path, "Zeit [ms];Kanal 1 [µm];Kanal 2 [V]", 1e3 * T, Y, U, separator=";", comma=True)


@export("MATLAB table")
def _(path):
    table(path, "t,u_drive,y_pos", T, U, Y)


@export("MATLAB table without names")
def _(path):
    table(path, "Var1,Var2,Var3", T, U, Y)


YOKOGAWA = ('"//YOKOGAWA ASCII FILE FORMAT"\n""\n"Model","DLM2024"\n"BlockNumber","1"\n"TraceName","Drive","Capacitive"\n'
            '"BlockSize","400","400"\n"VUnit","{drive}","{position}"\n"SampleRate","0","0"\n"HResolution","{step}","{step}"\n'
            '"HOffset","0","0"\n"HUnit","{time}","{time}"\n"DisplayBlockSize","1500","1500"\n"DisplayPointNo","0","0"\n'
            '"PhaseShift","0","0"\n"Date","2026/11/25","2026/11/25"\n"Time","10:00:00","10:00:00"\n""\n')


@export("Yokogawa: facts in quotes, their key first", says=["'Drive' in V", "'Capacitive' in um"])
def _(path):
    text(path, YOKOGAWA.format(drive="V", position="um", time="s", step="1.0E-03") +
         "".join(f'"","{u:.9g}","{y:.9g}"\n' for u, y in zip(U, Y)))


@export("Yokogawa: milliseconds, no column before the first")
def _(path):
    text(path, YOKOGAWA.format(drive="mV", position="nm", time="ms", step="1.0") + rows(1e3 * U, 1e3 * Y))


@export("this project's header keys, no rate: mV and nm", says=["'drive' in mV", "'displacement' in nm"])
def _(path):
    text(path, "# drive_unit: mV\n# displacement_unit: nm\nt,drive,displacement\n" + rows(T, 1e3 * U, 1e3 * Y))


@export("this project's own file in mV and nm")
def _(path):
    text(path, "# sample_rate_hz: 1000\n# drive_unit: mV\n# displacement_unit: nm\nt,drive,displacement\n" +
         rows(T, 1e3 * U, 1e3 * Y))


@export("a unit in the name, and another in the header", refused="is in um, and header key displacement_unit says 'nm'")
def _(path):
    text(path, "# displacement_unit: nm\nt,drive,displacement [um]\n" + rows(T, U, Y))


@export("ADC channels by number", "--drive 2 --displacement 4")
def _(path):
    table(path, "Time,AIN0,AIN1,AIN2", T, U, MONITOR, Y)


# ---- not clear, so refused

@export("an index, and two channels in volts", refused="displacement is column 4 'Ch2' in V: say how many um")
def _(path):
    table(path, "Index,Time,Ch1 (V),Ch2 (V)", K, T, U, Y / 5.0)


for above, end in (("# Sampling rate: 1 kHz\n# Ch1: position [nm]\n# Ch2: drive [mV]\n", ""),
                   ("# fs = 1000 Hz\n# column 1: position (nm)\n# column 2: drive voltage (mV)\n", " ")):
    @export(f"what each channel is, in remarks: '{above.splitlines()[1]}'", says=["' in mV (by its name)"])
    def _(path, above=above, end=end):
        text(path, above + rows(1e3 * Y, 1e3 * U, separator=end or ","))


@export("what each channel is, in remarks, beside times", start=0.0)
def _(path):
    text(path, "# Channel 1: drive [mV]\n# Channel 2: position [nm]\n" + rows(T, 1e3 * U, 1e3 * Y))


@export("remarks of two words over two columns", "--sample-rate 1000", says=["  by place: "])
def _(path):
    text(path, "# Sensor: capacitive\n" + rows(U, Y))


@export("three channels", refused="3 columns could be the drive: 2 'Ch1' (unknown), 3 'Ch2' (unknown), 4 'Ch3' (unknown): say which")
def _(path):
    table(path, "Time,Ch1,Ch2,Ch3", T, U, MONITOR, Y)


@export("four columns without names", refused="3 columns could be the drive")
def _(path):
    text(path, rows(T, U, MONITOR, Y))


@export("three axes", refused="3 columns could be the displacement: 2 'x' (displacement), 3 'y' (displacement), 4 'z'")
def _(path):
    table(path, "time,x,y,z,U", T, Y, 2.0 * Y, 3.0 * Y, U)


@export("two commands", refused="2 columns could be the drive: 2 'Command A' (drive), 3 'Command B' (drive)")
def _(path):
    table(path, "time,Command A,Command B,Position", T, U, MONITOR, Y)


@export("a force, no position", refused="no column is left for displacement: the file has 3; the columns are 1 'time' (time)")
def _(path):
    table(path, "time,drive [V],force [N]", T, U, Y)


@export("a unit that contradicts the name", refused="3 'Piezo Voltage' in um (another quantity)")
def _(path):
    table(path, "time,Position [um],Piezo Voltage [um]", T, Y, U)


@export("a time in an unknown unit", refused="time is column 1 'Time' in fortnights, which is no unit of time: s, ms, us or min")
def _(path):
    table(path, "Time [fortnights],drive,position", T, U, Y)


@export("sample numbers with a hole", "--sample-rate 1000", refused="line 202: samples are missing: their number goes from 199 to 210")
def _(path):
    table(path, "sample,drive,position", K + 10 * (K >= 200), U, Y)


@export("signs between thousands", refused="column 3 has signs between thousands")
def _(path):
    text(path, "t;u;y [nm]\n" + "".join(f"{t:.4f};{u:.4f};{1e3 * y + 9000:,.1f}\n" for t, u, y in zip(T, U, Y)))


@export("signs between thousands, as separators", refused="signs between thousands are separators, too")
def _(path):
    text(path, "t,u,y [nm]\n" + "".join(f"{t:.4f},{u:.4f},{1e3 * y + 9000:,.1f}\n" for t, u, y in zip(T, U, Y)))


@export("signs between thousands, in one line", refused="'14,256.3' is not a number (without a sign between thousands it is)")
def _(path):
    lines = rows(T, U, Y, separator=";").splitlines()
    lines[50] = "0.05;50;14,256.3"
    text(path, "t;u;y\n" + "\n".join(lines) + "\n")


@export("decimal commas between commas", refused="decimal commas and separators are the same sign")
def _(path):
    text(path, "t,u,y\n" + rows(T, U, Y, comma=True, form="%.4f"))


# ---- habits of programs that write rows and times

@export("Origin: names, units, remarks", says=["'Position' in nm"])
def _(path):
    text(path, "Time\tDrive\tPosition\ns\tV\tnm\nrun 1\trun 1\trun 1\n" + rows(T, U, 1e3 * Y, separator="\t"))


@export("R: numbers of rows without a name", says=["1 'column 1' (counts)"])
def _(path):
    text(path, '"t" "drive" "pos"\n' + "".join(f'"{k + 1}" {t:.9g} {u:.9g} {y:.9g}\n' for k, t, u, y in zip(K, T, U, Y)))


@export("pandas: an index without a name", "--sample-rate 1000")
def _(path):
    text(path, ",drive,position\n" + rows(K, U, Y))


@export("dSPACE: a word before each line, names and units in keyed lines", says=["'Model Root/DAC/u' in V"])
def _(path):
    text(path, '"descriptor","","",""\n"path","Platform()","Model Root/DAC/u","Model Root/ADC/pos"\n"type","","",""\n'
         '"unit","s","V","um"\n' + "".join(f'"data",{t:.9g},{u:.9g},{y:.9g}\n' for t, u, y in zip(T, U, Y)))


@export("Simulink: numbered parts of one signal", says=["'Data:1(1)', taken for V (by its place)"])
def _(path):
    table(path, "Time,Data:1(1),Data:1(2)", T, U, Y)


@export("LabVIEW: the time of a signal", "--displacement-scale 5", says=["time         column 1 'Time - Voltage_0'"])
def _(path):
    table(path, "Time - Voltage_0\tAmplitude - Voltage_0\tAmplitude - Voltage_1", T, U, Y / 5.0, separator="\t")


@export("AFM: a piezo named by its axis", says=["drive        column 2 'Z Piezo' in V", "'Deflection Error' in nm (control error)"])
def _(path):
    table(path, "Time (s)\tZ Piezo (V)\tHeight Sensor (nm)\tDeflection Error (nm)", T, U, 1e3 * Y, ERROR, separator="\t")


@export("two sensors of one axis", refused="2 columns could be the displacement: 3 'x_cap' (displacement), 4 'x_sg'")
def _(path):
    table(path, "t,U,x_cap,x_sg", T, U, Y, 1.1 * Y)


@export("a position, and the same filtered", says=["4 'Position filtered' (displacement)"])
def _(path):
    table(path, "Time,Drive,Position,Position filtered", T, U, Y, 0.9 * Y)


@export("a date with points")
def _(path):
    text(path, "Zeit;Spannung;Weg\n" + "".join(f"25.11.2026 10:00:{t:06.3f};{u:.9g};{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("a date with slashes, and PM", start=12 * 3600.0 + 10)
def _(path):
    text(path, "Timestamp,Drive,Position\n" +
         "".join(f"11/12/2026 12:00:{t + 10:06.3f} PM,{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("a date with a time zone, over midnight")
def _(path):
    text(path, "Timestamp,Drive,Position\n" +
         "".join(f"2026-11-{'25T23:59:59' if k < 200 else '26T00:00:00'}.{(k + 800) % 1000:03d}+01:00,{u:.9g},{y:.9g}\n"
                 for k, u, y in zip(K, U, Y)))


@export("minutes and seconds", start=90.0)
def _(path):
    text(path, "Time,Drive,Position\n" + "".join(f"01:{t + 30:06.3f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("stamps with too few digits", refused="time stays or goes back: 0 s after 0 s (too few digits?")
def _(path):
    text(path, "t,u,y\n" + "".join(f"{t:.2f},{u:.9g},{y:.9g}\n" for t, u, y in zip(T, U, Y)))


@export("JSON", refused="JSON (a model of this project?), no table of measurements")
def _(path):
    text(path, '{"format": "hyst-model-1"}\n')


# Units in a line of their key, between blanks; and above the names.
for key in ("units:", "Unit =", "Einheiten:"):
    @export(f"NumPy savetxt, names and units behind keys, '{key}'", says=["'displacement' in m"])
    def _(path, key=key):
        np.savetxt(path, np.column_stack([1e3 * T, U, 1e-6 * Y]), header=f"columns: t drive displacement\n{key} ms V m")


@export("NumPy savetxt, units above the names", says=["'displacement' in nm"])
def _(path):
    np.savetxt(path, np.column_stack([T, U, 1e3 * Y]), header="units: s V nm\nt drive displacement")


@export("AFM: columns, long names and units in remarks", "--drive 2", says=["'Height (measured)' in m"])
def _(path):
    text(path, '# kLength: 400\n# columns: height vDeflection time\n'
         '# fancyNames: "Height (measured)" "Vertical deflection" "Series Time"\n# units: m V s\n' +
         rows(1e-6 * Y, U, T, separator=" "))


@export("a unit in prose: all positions in nm", refused="displacement is column 3 'displacement' without a unit, and line 1 names another")
def _(path):
    text(path, "# All positions in nm\n# t drive displacement\n" + rows(T, U, 1e3 * Y, separator=" "))
