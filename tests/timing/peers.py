# SPDX-License-Identifier: GPL-3.0-or-later
"""peers.py RECORDING.csv LINES: programs that others use, on the recording and beside the numbers of host_cost.

LINES holds what host_cost printed a moment ago; its own numbers are taken from there. A peer that is not installed is
left out, and named on stderr. Processor time, the best of three.
"""
import sys
import time


def best(work, repetitions=3):
    times = []
    for _ in range(repetitions):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return min(times)


def main(recording, lines):
    ours = {w[1]: float(w[2]) for w in map(str.split, open(lines, encoding="utf-8")) if w and w[0] == "host"}
    try:
        import numpy
    except ImportError:
        print("peers.py: no numpy", file=sys.stderr)
        drive = [float(line.split(",")[1]) for line in open(recording, encoding="utf-8").readlines()[4:100004]]
    else:
        table = numpy.loadtxt(recording, delimiter=",", skiprows=4)
        samples = len(table)
        t = best(lambda: numpy.loadtxt(recording, delimiter=",", skiprows=4))
        print("host read_CSV", ours["read_CSV"], samples / t, "samples/s", "numpy.loadtxt_" + numpy.__version__)
        drive = table[:100000, 1].tolist()
        t = best(lambda: numpy.genfromtxt(recording, delimiter=",", skip_header=4), 1)
        print("host read_CSV", ours["read_CSV"], samples / t, "samples/s", "numpy.genfromtxt_" + numpy.__version__)
        t = best(lambda: numpy.savetxt(recording + ".numpy", table, delimiter=",", fmt="%.17g"), 1)
        print("host write_CSV", ours["write_CSV"], samples / t, "samples/s", "numpy.savetxt_" + numpy.__version__)
    try:
        import openseespy.opensees as ops
    except (ImportError, RuntimeError):
        print("peers.py: no OpenSeesPy", file=sys.stderr)
        return
    # Stops in parallel, which carry the same memory as plays: modulus = weight, yield strain = threshold.
    for plays in (10, 256):
        ops.wipe()
        for i in range(plays):
            ops.uniaxialMaterial("ElasticPP", i + 1, 0.1 / plays, 50.0 * (i + 1) / (plays + 1))
        ops.uniaxialMaterial("Parallel", plays + 1, *range(1, plays + 1))
        ops.testUniaxialMaterial(plays + 1)

        def run():
            for u in drive:
                ops.setStrain(u)
                ops.getStress()

        t = best(run, 1)
        what = f"simulate_{plays}_plays"
        print("host", what, ours[what], len(drive) / t, "samples/s", "OpenSeesPy_Parallel_ElasticPP")


main(*sys.argv[1:])
