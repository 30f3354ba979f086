#!/bin/sh
# SPDX-License-Identifier: GPL-3.0-or-later
# hyst diagnose on recordings with measured voltage, current and temperature, as its user meets it. The recordings come
# from an actuator that shares no formula with the tool. Usage: test_measured_columns.sh HYST WRITER FOLDER (made anew)
set -u
hyst=$1
writer=$2
folder=$3
# shellcheck source-path=SCRIPTDIR source=../../support/command.sh
. "$(dirname "$0")/../../support/command.sh"

# diagnose CASE   stdout, f.json, f.html; words, json: the first two on one line each
diagnose() {
    case=$1
    "$writer" "$case" "$case.csv" >seed || complain 'not written'
    expect 0 '' diagnose "$case.csv" --json f.json --report f.html
    tr -s '\n ' ' ' <stdout >words
    tr -s '\n ' ' ' <f.json >json
}

diagnose amplifier_alone # and without a column there is no word of them
if grep -q '^measured\|^   beside' stdout || grep -q '"measured[a-z_]*":' f.json || grep -q 'else was measured\|Measured beside' f.html; then
    complain 'a word of columns that there are not'
fi

diagnose nothing
has json '"verdict": "nothing missing"'
has words 'does not go with the temperature'
has words 'does not go with the measured voltage'
has words 'of the current; '
[ "$(grep -o '"relation": "none"' json | wc -l)" -eq 6 ] || complain 'a relation'
grep -q 'What else was measured' f.html || complain 'not on the page'

# The same lag of the position, before the voltage and behind it.
diagnose amplifier_voltage
has json '"block": "amplifier_bandwidth"'
has json '"certainty": "named"'
has json '"verdict": "present"'
has json '"verdict": "explained"'
has words 'The measured voltage shows it'
has words 'With what was found, nothing of that remains.'
grep -q 'Measured beside it' f.html || complain 'not on the page'
diagnose amplifier_current
has json '"block": "amplifier_bandwidth"'
has words 'The measured current shows it'
diagnose sensor_voltage
has json '"block": "sensor_bandwidth"'
has json '"verdict": "absent"'
has json '"verdict": "explained"'
has words 'it is behind the amplifier'
diagnose delay_before
has json '"block": "transport_delay"'
has words 'it is in the amplifier'
diagnose delay_behind # the chain is the same
has json '"block": "transport_delay"'
has json '"certainty": "named"'
has words 'it is behind the amplifier'

# Two lags: each on its side, and within some percent of what they are. (The position alone makes one of 190 Hz of them.)
near() {
    awk -v name="$1" -v truth="$2" -v part="$3" '
        index($0, "\"block\": \"" name "\"") { here = 1 }
        here && /"value":/ { sub(/.*: /, ""); exit !($0 > (1 - part) * truth && $0 < (1 + part) * truth) }' findings ||
        complain "$1 is not $2"
}
diagnose low_passes
sed -n '/"findings"/,/"not_found"/p' f.json >findings
near amplifier_bandwidth 300 0.03
near sensor_bandwidth 500 0.03
has json '"verdict": "explained"'
diagnose delay_and_sensor
sed -n '/"findings"/,/"not_found"/p' f.json >findings
# The chirp ends at 200 Hz: what the delay is longer, the time constant of the low pass is shorter.
near transport_delay 0.0005 0.05
near sensor_bandwidth 300 0.05

diagnose slew_current
has json '"block": "amplifier_slew_limit"'
has words 'The measured current shows it'

# No block has a thermometer.
diagnose cycling
has json '"verdict": "unknown physics"'
has json '"relation": "goes with it"'
has words 'What the model leaves goes with the temperature: 0.0'
diagnose warming
has json '"relation": "looks like it"'
has words 'cannot be distinguished from any other slow drift'
diagnose wandering
has json '"relation": "goes with it"'
has json '"findings": []' # a block that moves slowly explains a part, but stands for nothing beside the thermometer
has words 'But it goes with the temperature.'

finish
