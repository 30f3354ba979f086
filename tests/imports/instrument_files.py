# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of instruments, in the layout of their manuals."""
import numpy as np
from measurement import export, K, rows, T, text, U, Y


@export("Tektronix MSO/DPO CSV", "--displacement-scale 5")
def _(path):
    text(path, "Model,MSO4034\nFirmware Version,2.98\n\nPoint Format,Y,\nHorizontal Units,S,\nHorizontal Scale,0.04,\n"
         "Sample Interval,0.001,\nRecord Length,400,\nProbe Attenuation,10,1\nVertical Units,V,V\n"
         "Vertical Offset,0,0\n\nLabel,,\nTIME,CH1,CH2\n" + rows(T, U, Y / 5.0))


@export("Tektronix MSO/DPO CSV, nothing said of the sensor", refused="displacement is column 3 'CH2' in V: say how many um")
def _(path):
    text(path, "Model,MSO4034\nHorizontal Units,S,\nSample Interval,0.001,\nVertical Units,V,V\nLabel,mon,sens\n"
         "TIME,CH1,CH2\n" + rows(T, U, Y / 5.0))


@export("Siglent SDS CSV", "--displacement-scale 5", start=-0.2, says_not=["pairs of such columns"])
def _(path):
    text(path, "Record Length,Analog:400\nSample Interval,Analog:0.001\nVertical Units,CH1:V,CH2:V\n"
         "Vertical Scale,CH1:20.00,CH2:1.00\nHorizontal Units,s\nModel Number,SDS1104X-E\nSource,CH1,CH2\n"
         "Second,Volt,Volt\n" + rows(T - 0.2, U, Y / 5.0))


@export("Tektronix TDS: facts beside the first samples", "--drive 5 --displacement 6 --displacement-scale 5 --time 4")
def _(path):
    facts = ["Record Length,4.000000e+02,", "Sample Interval,1.000000e-03,", "Trigger Point,0.000000e+00,", ",,",
             "Source,CH1,", "Vertical Units,V,", "Vertical Scale,2.000000e+01,", "Horizontal Units,s,"]
    lines = rows(T, U, Y / 5.0, form="%.9f").splitlines()
    text(path, "".join((facts[i] if i < len(facts) else ",,") + "," + line + ",\n" for i, line in enumerate(lines)))


@export("Keysight InfiniiVision CSV", "--displacement-scale 5")
def _(path):
    text(path, "x-axis,1,2\nsecond,Volt,Volt\n" + rows(T, U, Y / 5.0, form="%+.8E"))


@export("Rigol DS1000 CSV: sample numbers, increment in the header", "--displacement-scale 5")
def _(path):
    text(path, "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,0.000000e+00,1.000000e-03\n" +
         rows(K, U, Y / 5.0, form="%.9g", end=",,\n"))


@export("Rigol DS4000 CSV: its numbers begin at 22, the time before the trigger", "--displacement-scale 5", start=-0.378)
def _(path):
    text(path, "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-0.400000e+00,1.000000e-03,\n" +
         rows(K + 22, U, Y / 5.0, form="%.9g", end=",\n"))


@export("Rigol MSO5000 CSV", "--displacement-scale 5")
def _(path):
    text(path, "Time(s),CH1(V),CH2(V)\n" + rows(T, U, Y / 5.0))


@export("LeCroy ASCII", "--drive 2 --displacement 3 --displacement-scale 5")
def _(path):
    text(path, "LECROYWS64Xs,12345,Waveform\nSegments,1,SegmentSize,400\nSegment,TrigTime,TimeSinceSegment1\n"
         "#1,23-Nov-2026 10:00:00,0\nTime,Ampl,Ampl\n" + rows(T, U, Y / 5.0))


@export("PicoScope CSV", "--displacement-scale 5")
def _(path):
    text(path, "Time,Channel A,Channel B\n(ms),(V),(V)\n\n" + rows(1e3 * T, U, Y / 5.0, form="%.8f"))


LVM = ("LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t{point}\n"
       "Multi_Headings\tNo\nX_Columns\t{columns}\nTime_Pref\tRelative\nOperator\tlab\nDate\t2026/11/23\n"
       "Time\t10:00:00\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t400\t400\t\n"
       "Date\t2026/11/23\t2026/11/23\t\nTime\t10:00:00\t10:00:00\t\nX_Dimension\tTime\tTime\t\nX0\t0\t0\t\n"
       "Delta_X\t{delta}\t{delta}\t\n***End_of_Header***\t\t\t\nX_Value\tdrive\tposition\tComment\n")


@export("LabVIEW .lvm with times")
def _(path):
    text(path, LVM.format(point=".", columns="One", delta="0.001") + rows(T, U, Y, separator="\t"))


@export("LabVIEW .lvm without times, decimal commas")
def _(path):
    text(path, LVM.format(point=",", columns="No", delta="0,001") +
         "".join("\t" + line + "\n" for line in rows(U, Y, separator="\t", comma=True).splitlines()))


@export("LabVIEW .lvm, a time beside each signal, units in the header", "--displacement-scale 5",
        says=["'Voltage' in Volts", "'Sensor' in Volts"])
def _(path):
    header = LVM.format(point=".", columns="Multi", delta="0.001").replace("X_Dimension", "Y_Unit_Label\tVolts\t\tVolts\nX_Dimension")
    text(path, header.replace("X_Value\tdrive\tposition", "X_Value\tVoltage\tX_Value\tSensor") +
         rows(T, U, T, Y / 5.0, separator="\t"))


@export("LabVIEW .lvm, units in the header, nothing said of the sensor",
        refused="displacement is column 3 'Voltage_1' in Volts: say how many um")
def _(path):
    header = LVM.format(point=".", columns="One", delta="0.001").replace("X_Dimension", "Y_Unit_Label\tVolts\tVolts\nX_Dimension")
    text(path, header.replace("drive\tposition", "Voltage_0\tVoltage_1") + rows(T, U, Y / 5.0, separator="\t"))


@export("LabVIEW .lvm, a header longer than the data", refused="no column is left for drive: the file has 3")
def _(path):
    header = LVM.format(point=".", columns="One", delta="0.001").replace("X_Dimension", "Y_Unit_Label\tNewtons\tm/s^2\nX_Dimension")
    text(path, header.replace("drive\tposition", "force (raw)\tresponse") + rows(T[:8], U[:8], Y[:8], separator="\t"))


@export("NumPy savetxt")
def _(path):
    np.savetxt(path, np.column_stack([T, U, Y]), header="t drive displacement")


# A scope chooses mV by itself. A scale is of what 1 V is all the same.
@export("PicoScope CSV in mV, nothing said of the sensor",
        refused="displacement is column 3 'Kanal B' in mV: say how many um 1 V is (hyst import --displacement-scale N)")
def _(path):
    text(path, "Zeit;Kanal A;Kanal B\n(ms);(V);(mV)\n\n" +
         rows(1e3 * T, U, 200.0 * Y, separator=";", comma=True, form="%.8f"))


@export("PicoScope CSV in mV, 5 um/V", "--displacement-scale 5", says=["in mV, scaled by 5 um for 1 V"])
def _(path):
    text(path, "Zeit;Kanal A;Kanal B\n(ms);(V);(mV)\n\n" +
         rows(1e3 * T, U, 200.0 * Y, separator=";", comma=True, form="%.8f"))
