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
expect 0 '' -V
has stdout 'hyst '
expect 0 '' help
has stdout 'Exit status'
expect 0 '' help fit
has stdout 'hyst fit RECORDING'
expect 2 "unknown command 'calibrate'" help calibrate
expect 2 "help: too many arguments from 'now' on" help fit now
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
expect 2 '--port is empty: it takes the name of a serial port' info --port ''
expect 2 '--port is empty: it takes the name of a serial port' serve --port ''
expect 2 '--for -5: must not be negative' watch --port none --model good.json --report watched --for -5
expect 2 '--sample-rate 12345: the loop of the firmware that comes with this program has 10000 Hz' \
    bench --model good.json --sample-rate 12345
expect 2 '--sample-rate 20000: the loop of the firmware that comes with this program has 10000 Hz' \
    serve --bench --model good.json --sample-rate 20000
expect 2 '--sample-rate 1e+09: outside 0.001..4.29497e+06 Hz' bench --image good.elf --model good.json --sample-rate 1e9
expect 2 "unknown family 'no_such_family'" fit good.csv --family no_such_family
expect 2 '--output needs a value' fit good.csv -o
expect 2 "--drive-range: '5:1' is not a valid LO:HI" compile model.json --drive-range 5:1
expect 2 "--sample-rate: 'fast' is not a valid HZ" compile model.json --sample-rate fast
expect 2 "--sample-rate: '0' is not a valid HZ" compile model.json --sample-rate 0
expect 2 "--sample-rate: '0' is not a valid HZ" import good.csv --sample-rate 0
expect 2 "--drive-scale: '0' is not a valid" import good.csv --drive-scale 0
expect 2 "--displacement-scale: '0.0' is not a valid" import good.csv --displacement-scale 0.0
expect 2 '--json= needs the name of a file' compile model.json --json=

# The path: fit, simulate, compile; text and JSON.
expect 0 '' fit good.csv -o model.json --operators 4
has stdout 'um/V'
has stdout 'held out'
expect 0 '' fit good.csv --operators=4 --json
has stdout '"hyst-model-1"'
expect 0 'note: good.csv is the same file as good.csv and counts once more' fit good.csv good.csv --family rate_dependent_prandtl_ishlinskii --operators 3 -o rate.json
has stdout 'beta_s'
expect 0 '' fit good.csv --family all --operators 4 -o best.json
has stdout 'largest error held out'
has stdout 'ellipse needs a sinusoidal drive'
grep -q "\"family\": \"$(sed -n 's/ .*//; 2p' stdout)\"" best.json || complain 'the model written is not the first of the table'
expect 0 '' fit good.csv --family all --operators 4 --json
has stdout '"hyst-fit-table-1"'
has stdout '"reason"'
# A sine, answered with harmonics: a family that holds for this sine only is nearest to what is held out, the same sine
# again. It says nothing of other drives, so it is listed last and written only when asked for by name.
awk 'BEGIN {
    print "# sample_rate_hz: 1000\n# drive_unit: V\n# displacement_unit: um\nt,drive,displacement"
    for (k = 0; k < 3000; k++) {
        p = 6.283185307179586 * k / 200
        printf "%.3f,%.6f,%.6f\n", k / 1000, 50 + 50 * sin(p), 5 + 3 * sin(p - 0.3) + 0.2 * sin(2 * p + 0.5) + 0.2 * sin(3 * p - 1)
    }
}' >sine.csv
expect 0 '' fit sine.csv --family all --operators 4 -o sine.json
awk '/^[a-z_]+ .*that sine only/ { print $5 }' stdout | sort -g >only
awk '/^[a-z_]+ .* um$/ { print $5 }' stdout | sort -g >any
if [ "$(head -n 1 only)" = '' ] || [ "$(cat only any | sort -g | head -n 1)" != "$(head -n 1 only)" ]; then
    complain 'no family of one sine has the least error: this tests nothing'
fi
grep -q '"family": "\(ellipse\|.*modified_play\|recursive_bouc_wen\)"' sine.json && complain 'a model that holds for one sine only was chosen'
expect 0 '' fit sine.csv --family all --operators 4 --json
has stdout '"one_sine": true'
expect 0 '' fit sine.csv --family ellipse -o sine.json
grep -q '"family": "ellipse"' sine.json || complain 'asked for by name, it is written'

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
expect 1 'model.json: --preload 5: the model has no block preload' compile model.json --preload 5 -o refused
expect 1 'model.json: --frequency 5: the model has no block ellipse' compile model.json --frequency 5 -o refused
[ ! -e refused ] || complain 'an image was written for a block that is not there'
expect 0 '' compile model.json --preload 0
expect 0 '' compile sine.json --frequency 5
expect 2 '--frequency must be positive' compile sine.json --frequency -5
sed 's/^ \],$/, {"block": "preload", "parameters": {"compliance_per_n": {"value": 0.001}}}],/' model.json >pressed.json
expect 0 '' compile pressed.json --preload 5
has stdout 'preload: compiled for 5 N (--preload)'
expect 2 '--follow sensor: not reading or position' compile curved.json --follow sensor
expect 0 '' compile model.json --drive-range -200:200 --position-range -50:60 --sample-rate 20000
has stdout '20000 Hz'

# Drive and displacement exchanged: refused at once, with the command that mends it; nothing is written. One may insist.
awk 'BEGIN {
    print "# sample_rate_hz: 1000\n# drive_unit: V\n# displacement_unit: um\nt,displacement,drive"
    z = 0; noise = 1
    for (k = 0; k < 3000; k++) {
        p = 6.283185307179586 * k / 500
        u = 50 * sin(p) + 30 * sin(2.3 * p)
        if (z < u - 20) z = u - 20
        if (z > u + 20) z = u + 20
        noise = (noise * 16807) % 2147483647
        printf "%.3f,%.6f,%.6f\n", k / 1000, u, 5 + 0.1 * u + 0.05 * z + 0.02 * (noise / 2147483647 - 0.5)
    }
}' >exchanged.csv
for command in 'fit' 'fit --family all' 'diagnose --json=exchanged.json --report exchanged.html' 'diagnose --model model.json'; do
    # shellcheck disable=SC2086 # a command is several words
    expect 1 'exchanged.csv: drive and displacement are exchanged: ' $command good.csv exchanged.csv -o exchanged.model
    has stderr 'hyst import exchanged.csv --drive displacement --displacement drive -o NEW'
    for file in exchanged.json exchanged.html exchanged.model; do
        if [ -e "$file" ]; then complain "$file was written"; fi
    done
done
expect 0 '' fit exchanged.csv --columns-are-right --operators 4
expect 0 '' import exchanged.csv --drive displacement --displacement drive -o mended.csv
expect 0 '' fit mended.csv -o mended.json
expect 0 '' simulate mended.json good.csv # it is a model of the right recording
has stdout 'NRMSE 0.'

# A sensor that is read every four rows, beginning with row 2: of each reading the first row.
awk -F, '/^[#t]/ {print; next} {k++; if (k % 4 == 2 || k == 1) y = $3; print $1 "," $2 "," y}' good.csv >slow.csv
expect 0 '' import slow.csv --drop-held -o fresh.csv
has stdout 'each in 4 rows: the first of them is kept, from row 2 of the data on'
has stdout 'fresh.csv: 1500 samples at 250 Hz'
awk -F, '/^[#t]/ {next} {k++; if (k % 4 == 2) print $2 + 0, $3 + 0}' good.csv >wanted
awk -F, '/^[#t]/ {next} {print $2 + 0, $3 + 0}' fresh.csv >got
cmp wanted got || complain 'import --drop-held: not the first rows'
expect 1 'good.csv: no reading stands in several rows' import good.csv --drop-held -o none.csv
[ ! -e none.csv ] || complain 'import --drop-held: wrote what it refused'

# Faults of the input: one line that names the place, exit status 1.
expect 1 'nowhere.csv: No such file' fit nowhere.csv
expect 1 'nowhere.json: No such file' compile nowhere.json
expect 1 'nowhere.json: No such file' restore --port none --from nowhere.json
expect 1 'good.csv: not a model, which is JSON' simulate good.csv model.json
expect 1 'good.csv: not a backup, which is JSON' restore --port none --from good.csv
expect 1 '.: Is a directory' compile .
expect 1 'a diagnosis of 999 of the samples: it takes 1000 of each recording' diagnose good.csv --samples 999
sed '100d' good.csv >gap.csv
expect 1 'gap.csv:100: gap' fit gap.csv
sed '100s/,[^,]*$/,nan/' good.csv >nan.csv
expect 1 "nan.csv:100: column 'displacement': 'nan' is not" simulate model.json nan.csv
# Numbers that are finite and can be none: the line names file, line and column, in every command that reads a recording.
for value in 1e308 -1e308 1e9 -1e7; do
    sed "100s/,[^,]*\$/,$value/" good.csv >huge.csv
    sed "50s/,[^,]*,/,$value,/" good.csv >drive.csv
    for command in 'fit' 'fit --family all' 'fit --json' 'diagnose' 'simulate model.json' 'report model.json'; do
        case $command in
        report*) arguments='a=good.csv,good.csv' ;;
        *) arguments='' ;;
        esac
        # shellcheck disable=SC2086 # a command is several words
        expect 1 "huge.csv:100: column 'displacement': '$value' is not plausible" $command huge.csv $arguments
        # shellcheck disable=SC2086 # likewise
        expect 1 "drive.csv:50: column 'drive': '$value' is not plausible" $command drive.csv $arguments
    done
    # The same from elsewhere: a text without our header, and one in another unit.
    sed '1,3d; s/^t,drive,displacement/time [s],drive [V],displacement [um]/' huge.csv >elsewhere.csv
    expect 1 "line 97: column 3 'displacement'" fit elsewhere.csv
    has stderr 'is not plausible'
done
awk -F, '/^[0-9]/ { print $1 "," $2 "," 1e6 * $3; next } /^t,/ { print "time [s],drive [V],displacement [m]" }' good.csv >metres.csv
expect 1 'um is not plausible: more than 1e+06 um' fit metres.csv

# no_infinity COMMAND...: whatever it ends with, no number that it prints or writes is infinite or none.
no_infinity() {
    got=0
    rm -f page.html
    "$hyst" "$@" >stdout 2>stderr || got=$?
    if grep -qiw -e 'inf' -e 'nan' stdout; then complain "hyst $*: prints a number that is none, with exit status $got"; fi
    if [ -e page.html ] && grep -qiwE '(inf|nan)(&nbsp;| |<|")' page.html; then complain "hyst $*: writes a number that is none"; fi
    [ "$got" -eq 0 ] || [ "$(wc -l <stderr)" -eq 1 ] || complain "hyst $*: stderr is not one line"
}
# Nothing moves where the error is measured; the reference is met exactly; the smallest numbers there are.
awk -F, '/^[0-9]/ { if (++n > 3500) { print $1 ",0,5.123"; next } } { print }' good.csv >still_end.csv
awk -F, '/^[0-9]/ { print $1 ",0," $3; next } { print }' good.csv >still_drive.csv
awk -F, '/^[0-9]/ { print $1 "," $2 ",3"; next } { print }' good.csv >dead.csv
awk -F, '/^[0-9]/ { printf "%s,%s,%.17g\n", $1, $2, 1e-308 * $3; next } { print }' good.csv >tiny.csv
awk -F, '/^[0-9]/ { printf "%s,%.17g,%s\n", $1, 1e-308 * $2, $3; next } { print }' good.csv >tiny_drive.csv
awk -F, '/^[0-9]/ { print $0 "," $3; next } /^t,/ { print $0 ",reference"; next } { print }' good.csv >exact.csv
awk -F, '/^[0-9]/ { print $0 "," 1.01 * $3; next } /^t,/ { print $0 ",reference"; next } { print }' good.csv >near.csv
awk -F, '/^[0-9]/ { print $0 ",7"; next } /^t,/ { print $0 ",reference"; next } { print }' good.csv >still.csv
for recording in still_end still_drive dead tiny tiny_drive exact; do
    no_infinity fit $recording.csv --operators 3
    no_infinity fit $recording.csv --operators 3 --json
    no_infinity fit $recording.csv --operators 3 --family all
    no_infinity fit $recording.csv --operators 3 --family rate_dependent_prandtl_ishlinskii
    no_infinity simulate model.json $recording.csv
    no_infinity simulate model.json $recording.csv --json
    no_infinity diagnose $recording.csv --report page.html
done
for tracks in exact,exact near,exact exact,near still,near near,still near,near; do
    no_infinity report model.json good.csv "a=${tracks%,*}.csv,${tracks#*,}.csv" -o page.html
    no_infinity report model.json good.csv "a=${tracks%,*}.csv,${tracks#*,}.csv" -o page.html --json
done
for number in 1e300 -1e300 1e30 1e-300; do
    for array in 1 2; do # weights, thresholds
        awk -v number="$number" -v array=$array '{ print }
            /"value": \[/ && ++n == array { getline; sub(/[-0-9.e+]+/, number); print }' model.json >extreme.json
        grep -qF -e "$number" extreme.json || complain 'no extreme number in the model: this tests nothing'
        no_infinity simulate extreme.json good.csv
        no_infinity simulate extreme.json good.csv --json
        no_infinity compile extreme.json
        no_infinity compile extreme.json --json
    done
done

sed 's/,displacement$/,position/' good.csv >column.csv
expect 1 "column.csv:4: missing column 'displacement'" fit column.csv
sed 's/^# sample_rate_hz: 1000/# sample_rate_hz: 500/' good.csv >rate.csv
expect 1 'rate.csv:6: wrong rate' fit rate.csv
: >empty.csv
expect 1 'empty.csv: empty file' fit empty.csv
awk -F, '/^[0-9]/ { print $1 "," $2 "," (-$3); next } { print }' good.csv >falling.csv
for family in prandtl_ishlinskii bouc_wen inertial_hysteresis stop_density all; do
    expect 1 'falling.csv: the displacement falls where the drive rises' fit falling.csv --family "$family"
done
awk 'BEGIN {
    print "# sample_rate_hz: 1000\n# drive_unit: V\n# displacement_unit: um\nt,drive,displacement"
    for (k = 0; k < 600; k++) printf "%.3f,%.4f,%.5f\n", k / 1000, k / 6, 0.1 * k / 6 + 1e-4 * k * k / 36
}' >ramp.csv
expect 0 '' fit ramp.csv --operators 4
has stdout 'the drive never turns round by more than half of its range'
expect 0 '' fit good.csv --operators 2
! grep -q 'never turns round' stdout || complain 'good.csv turns round'
sed '1i # drive_between_samples: hold' good.csv >between.csv
for command in 'look' 'fit' 'simulate model.json' 'diagnose' 'bode'; do
    # shellcheck disable=SC2086
    expect 1 "between.csv: header key drive_between_samples is 'hold', not held, line or smooth" $command between.csv
done
sed '1i # drive_unit: mV' good.csv >units.csv
expect 1 'units.csv:3: second drive_unit' fit units.csv
sed 's/^# drive_unit:/# drive_units:/' good.csv >units.csv
expect 1 'units.csv:2: drive_units is no header key: drive_unit is' fit units.csv
head -n 20 good.csv >short.csv
expect 1 'no family fits: short.csv: 16 samples are too few' fit short.csv --family all
cp "$hyst" binary.csv
expect 1 'binary.csv:1: binary data' fit binary.csv
expect 1 'good.csv: not a model' simulate good.csv good.csv
sed 's/prandtl_ishlinskii/prandtl/' model.json >unknown.json
expect 1 'unknown.json: chain[0]: unknown block "prandtl"' compile unknown.json
expect 1 'nowhere/image: No such file' compile model.json -o nowhere/image
expect 1 'nowhere/model.json' fit good.csv --operators 2 -o nowhere/model.json
# Diagnosis: text, JSON, page and model; the same bytes every time; and a compiler that takes the model.
export SOURCE_DATE_EPOCH=1700000000 # the page says when it was made
for run in 1 2; do
    expect 0 '' diagnose good.csv --json diagnosis.json --report diagnosis.html -o better.json
    mv diagnosis.json diagnosis$run.json
    mv diagnosis.html diagnosis$run.html
    mv better.json better$run.json
    mv stdout text$run
done
unset SOURCE_DATE_EPOCH
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
has stdout 'confused with: transport_delay, amplifier_bandwidth, amplifier_filter, sensor_filter (group lag)'
has stdout 'revealed by: the same drive under three preloads'
expect 0 '' blocks --json
has stdout '"format": "hyst-blocks-1"'
has stdout '"place": "slow"'
has stdout '"group": "lag"'
has stdout '"looks_like": "The position goes on moving after the drive has stopped'
has stdout '"confused_with": null'
has stdout '"revealed_by": "the same drive under three preloads'
expect 2 'too many arguments' blocks model.json

# OpenBLAS has its slowest code for a processor that it does not know; the command does not stay with it.
if grep -qw avx2 /proc/cpuinfo && grep -qw fma /proc/cpuinfo; then
    env -u OPENBLAS_CORETYPE OPENBLAS_VERBOSE=2 "$hyst" blocks >stdout 2>stderr ||
        complain 'the command did not begin again'
    code=$(sed -n 's/^.*Core: //p' stderr | tail -1)
    case $code in
    '' | Prescott) complain "OpenBLAS' code is '$code'" ;;
    esac
fi

# A reader that has seen enough: no failure to tell of.
{
    "$hyst" fit good.csv --operators 2 2>stderr || echo $? >left
} | true
if [ "$(cat left)" -ne 141 ] || [ -s stderr ]; then complain 'a closed pipe does not end the command quietly'; fi

if [ -w /dev/full ]; then
    "$hyst" fit good.csv --operators 2 >/dev/full 2>stderr
    [ $? -eq 1 ] || complain 'a full disk must not look like success'
    "$hyst" fit good.csv --operators 2 --json >/dev/full 2>stderr
    [ "$(wc -l <stderr)" -eq 1 ] || complain 'a full disk is not one line'
fi

finish
