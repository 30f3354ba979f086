#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# The hyst command as its user meets it. Usage: test_command.sh HYST FOLDER (made anew)
set -u
hyst=$1
folder=$2
# shellcheck source-path=SCRIPTDIR source=../support/command.sh
. "$(dirname "$0")/../support/command.sh"

# A synthetic recording: two full triangles with minor loops, a play operator of 20 V, a little noise from a fixed sequence.
awk 'BEGIN {
    print "# sample_rate_hz: 1000\n# drive_unit: V\n# displacement_unit: um\nt,drive,displacement"
    n = split("0 100 -100 60 -20 100 -100 100 20 100 -100 50 0 100 -100 100", corner, " ")
    z = 0; noise = 1
    for (k = 0; k < 6000; k++) {
        line = int(k / 100); a = corner[line % n + 1]; b = corner[(line + 1) % n + 1]
        u = a + (b - a) * (k % 100) / 100
        if (z < u - 20) z = u - 20
        if (z > u + 20) z = u + 20
        noise = (noise * 16807) % 2147483647
        printf "%.3f,%.4f,%.6f\n", k / 1000, u, 5 + 0.1 * u + 0.05 * z + 0.02 * (noise / 2147483647 - 0.5)
    }
}' >good.csv

expect 0 '' --help
has stdout 'Exit status'
expect 0 '' --version
has stdout 'hyst '
expect 2 'which command'
expect 2 "unknown command 'calibrate'" calibrate
for command in fit simulate diagnose compile; do
    expect 0 '' $command --help
    has stdout "hyst $command"
    expect 2 'missing argument' $command
    expect 2 'unknown option --frobnicate' $command --frobnicate
done
expect 2 'too many arguments' compile a b
expect 2 "--operators: 'many' is not" fit good.csv --operators many
expect 2 "--operators: '0' is not" fit good.csv --operators 0
expect 2 '--probe crep: no such block; there are all, ' record --port none --probe crep -o probe.csv
expect 2 'diagnose does not look for this block; there are all, ' record --port none --probe prandtl_ishlinskii -o probe.csv
expect 2 'either --waveform or --probe' record --port none --probe creep --waveform sine -o probe.csv
expect 2 'a probe takes the whole drive range' record --port none --probe creep --amplitude 5 -o probe.csv
expect 2 '--slew-rate belongs to --probe' record --port none --waveform sine --slew-rate 5 -o probe.csv
expect 1 'cannot open none' record --port none --probe creep -o probe.csv
expect 2 "unknown family 'no_such_family'" fit good.csv --family no_such_family
expect 2 '--output needs a value' fit good.csv -o
expect 2 "--drive-range: '5:1' is not a valid LO:HI" compile model.json --drive-range 5:1
expect 2 "--sample-rate: 'fast' is not a valid HZ" compile model.json --sample-rate fast
expect 2 '--json takes no value' compile model.json --json=1

# The path: fit, simulate, compile; text and JSON.
expect 0 '' fit good.csv -o model.json --operators 4
has stdout 'um/V'
has stdout 'held out'
expect 0 '' fit good.csv --operators=4 --json
has stdout '"hyst-model-1"'
expect 0 '' fit good.csv good.csv --family rate_dependent_prandtl_ishlinskii --operators 3 -o rate.json
has stdout 'beta_s'
expect 0 '' fit good.csv --family all --operators 4 -o best.json
has stdout 'largest error held out'
has stdout 'ellipse needs a sinusoidal drive'
grep -q "\"family\": \"$(sed -n 's/ .*//; 2p' stdout)\"" best.json || complain 'the model written is not the first of the table'
expect 0 '' fit good.csv --family all --operators 4 --json
has stdout '"hyst-fit-table-1"'
has stdout '"reason"'
expect 0 '' simulate model.json good.csv -o out.csv
has stdout 'NRMSE'
expect 0 '' simulate model.json good.csv --json
has stdout '"nrmse_percent"'
expect 0 '' simulate model.json out.csv # what simulate wrote is a recording again, and the model's own
has stdout 'NRMSE 0.0000 %'
expect 0 '' compile model.json -o image
has stdout 'play operators'
[ -s image ] || complain 'no image was written'
expect 0 '' compile rate.json --json
has stdout '"beta_samples"'
has stdout '"not_corrected": []'
sed 's/^ \],$/, {"block": "gain_drift", "parameters": {"gain_per_s": {"value": 0.01}}}],/' model.json >drift.json
expect 0 '' compile drift.json -o image
has stdout 'not corrected: gain_drift: '
expect 0 '' compile drift.json --json
has stdout '"block": "gain_drift"'
sed 's/^ \],$/, {"block": "static_nonlinearity", "parameters": {"quadratic": {"value": 0.02}, "cubic": {"value": 0}}}],/' model.json >curved.json
expect 0 '' compile curved.json -o image
has stdout 'a reference curve'
has stdout 'note: static_nonlinearity: the reading follows the reference'
expect 0 '' compile curved.json --follow=reading --json
has stdout '"reference_curves": 1'
has stdout '"not_corrected": []'
expect 0 '' compile curved.json --follow position --json
has stdout '"reference_curves": 0'
has stdout '"block": "static_nonlinearity"'
expect 2 '--follow sensor: not reading or position' compile curved.json --follow sensor
expect 0 '' compile model.json --drive-range -200:200 --position-range -50:60 --sample-rate 20000
has stdout '20000 Hz'

# Faults of the input: one line that names the place, exit status 1.
expect 1 'nowhere.csv: No such file' fit nowhere.csv
sed '100d' good.csv >gap.csv
expect 1 'gap.csv:100: gap' fit gap.csv
sed '100s/,[^,]*$/,nan/' good.csv >nan.csv
expect 1 "nan.csv:100: column 'displacement': 'nan' is not" simulate model.json nan.csv
sed 's/,displacement$/,position/' good.csv >column.csv
expect 1 "column.csv:4: missing column 'displacement'" fit column.csv
sed 's/^# sample_rate_hz: 1000/# sample_rate_hz: 500/' good.csv >rate.csv
expect 1 'rate.csv:6: wrong rate' fit rate.csv
: >empty.csv
expect 1 'empty.csv: empty file' fit empty.csv
awk -F, '/^[0-9]/ { print $1 "," $2 "," (-$3); next } { print }' good.csv >falling.csv
expect 1 'falling.csv: the displacement falls where the drive rises' fit falling.csv
head -n 20 good.csv >short.csv
expect 1 'no family fits: short.csv: 16 samples are too few' fit short.csv --family all
cp "$hyst" binary.csv
expect 1 'binary.csv:1: binary data' fit binary.csv
expect 1 'good.csv:1:' simulate good.csv good.csv
sed 's/prandtl_ishlinskii/prandtl/' model.json >unknown.json
expect 1 'unknown.json: chain[0]: unknown block "prandtl"' compile unknown.json
expect 1 'nowhere/image: No such file' compile model.json -o nowhere/image
expect 1 'nowhere/model.json' fit good.csv --operators 2 -o nowhere/model.json
# Diagnosis: text, JSON, page and model; the same bytes every time; and a compiler that takes the model.
for run in 1 2; do
    expect 0 '' diagnose good.csv --json diagnosis$run.json --report diagnosis$run.html -o better$run.json
    mv stdout text$run
done
cp text1 stdout
has stdout 'verdict    Nothing is missing'
has stdout 'held out'
has stdout 'would have been seen from'
has stdout 'next       hyst record --port DEV --probe all'
for form in diagnosis?.json diagnosis?.html better?.json text?; do
    cmp "$form" "$(echo "$form" | tr 12 21)" || complain "$form is not the same every time"
done
grep -q '"format": "hyst-diagnosis-1"' diagnosis1.json || complain 'no format in the diagnosis'
grep -q '"verdict": "nothing missing"' diagnosis1.json || complain 'no verdict in the diagnosis'
grep -q '</html>' diagnosis1.html || complain 'the page of the diagnosis has no end'
expect 0 '' compile better1.json -o image
expect 0 '' diagnose good.csv --model model.json
has stdout '(the chain as it came in -> its numbers fitted again)'
expect 1 'missing.csv: No such file' diagnose good.csv missing.csv
expect 1 'unknown.json: chain[0]: unknown block "prandtl"' diagnose good.csv --model unknown.json
expect 1 'nowhere/diagnosis.json' diagnose good.csv --json nowhere/diagnosis.json
expect 1 'nowhere/diagnosis.html' diagnose good.csv --report nowhere/diagnosis.html
head -20 good.csv >short.csv
expect 1 'short.csv' diagnose short.csv
expect 2 "unknown option --jsn" diagnose good.csv --jsn diagnosis.json

# The catalogue lists what a model may contain, and the model in use is made of it.
expect 0 '' blocks
has stdout 'prandtl_ishlinskii (hysteresis)'
has stdout 'gamma_per_decade   1     -0.1 .. 0.1'
has stdout 'looks like: The position goes on moving after the drive has stopped'
has stdout 'confused with: transport_delay, amplifier_bandwidth (group lag)'
has stdout 'revealed by: the same drive under three preloads'
expect 0 '' blocks --json
has stdout '"format": "hyst-blocks-1"'
has stdout '"place": "slow"'
has stdout '"group": "lag"'
has stdout '"looks_like": "The position goes on moving after the drive has stopped'
has stdout '"confused_with": null'
has stdout '"revealed_by": "the same drive under three preloads'
expect 2 'too many arguments' blocks model.json

if [ -w /dev/full ]; then
    "$hyst" fit good.csv --operators 2 >/dev/full 2>stderr
    [ $? -eq 1 ] || complain 'a full disk must not look like success'
fi

finish
