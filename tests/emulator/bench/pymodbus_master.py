# SPDX-License-Identifier: GPL-3.0-or-later
"""The firmware's registers, as docs/REGISTERS.md tells a stranger to use them. Argument: serial port."""

import sys
import time

from pymodbus.client import ModbusSerialClient
from pymodbus.mei_message import ReadDeviceInformationRequest

SLAVE = 1
MODE, SETPOINT, SETPOINT_SLEW = 0x0101, 0x0102, 0x0111
COMMAND, LATCH, ARM, SEQUENCE = 0x0100, 8, 9, 0x0200
UNLOCK, OUTPUT_KEY = 0x013A, 0x4F4E


def words(value):
    return [(value >> 16) & 0xFFFF, value & 0xFFFF]


def signed(high, low):
    value = high << 16 | low
    return value - (1 << 32) if value & 0x80000000 else value


def main(port):
    client = ModbusSerialClient(port, baudrate=115200, parity="N", stopbits=1, timeout=3, retry_on_empty=True)
    assert client.connect(), f"cannot open {port}"

    def read(address, count):
        answer = client.read_holding_registers(address, count, slave=SLAVE)
        assert not answer.isError(), f"reading {address:#06x}: {answer}"
        return answer.registers

    def write(address, values):
        answer = client.write_registers(address, values, slave=SLAVE)
        assert not answer.isError(), f"writing {address:#06x}: {answer}"

    identity = read(0, 14)
    assert identity[0] == 0x4859 and identity[3] == 2, identity
    assert (identity[4] << 16 | identity[5]) == 10_000_000, identity

    # Unlocked and armed, as docs/REGISTERS.md says; the polls below are more frequent than the communication timeout.
    assert client.write_register(MODE, 1, slave=SLAVE).exception_code == 3, "moves before it is armed"
    assert client.write_register(COMMAND, ARM, slave=SLAVE).exception_code == 4, "arms before it is unlocked"
    assert not client.write_register(UNLOCK, OUTPUT_KEY, slave=SLAVE).isError(), "unlocking"
    assert not client.write_register(COMMAND, ARM, slave=SLAVE).isError(), "arming"

    # A drive of -0.25 full scale in direct mode shows up in the telemetry.
    target = -(1 << 29)
    write(MODE, [1])
    write(SETPOINT, words(target))
    for _ in range(100):
        telemetry = read(SEQUENCE, 33)
        if signed(telemetry[6], telemetry[7]) == target and telemetry[2] == 0:
            break
        time.sleep(0.05)
    else:
        raise AssertionError(f"the drive does not follow the setpoint: {telemetry}")
    assert telemetry[3] == 1, "active mode is not direct"

    # Functions 6, 23 and 43/14. The last two call the slave a unit in this version of pymodbus.
    assert not client.write_register(MODE, 0, slave=SLAVE).isError()
    both = client.readwrite_registers(
        read_address=MODE, read_count=1, write_address=MODE, write_registers=[1], unit=SLAVE
    )
    assert not both.isError() and both.registers == [1], both
    device = client.execute(ReadDeviceInformationRequest(read_code=1, object_id=0, unit=SLAVE))
    assert not device.isError() and len(device.information) == 3, device
    print("device identification:", [text.decode() for text in device.information.values()])

    # Exceptions: half of a value, a value out of range, an address that does not exist.
    setpoint = read(SETPOINT, 2)
    for address, values, code in ((SETPOINT, [0], 2), (MODE, [9], 3), (0x3000, [0], 2)):
        answer = client.write_registers(address, values, slave=SLAVE)
        print(f"writing {values} to {address:#06x}: exception {answer.exception_code}")
        assert answer.isError() and answer.exception_code == code, answer
    assert read(SETPOINT, 2) == setpoint, "a refused write changed something"

    # The same write again and again, as fast as this master does it: the amplifier gets each of them, and none again.
    served = 0x0220
    before = read(SEQUENCE, 33)[served - SEQUENCE]
    for _ in range(30):
        assert not client.write_register(COMMAND, LATCH, slave=SLAVE).isError(), "the same write again is lost"
    assert read(SEQUENCE, 33)[served - SEQUENCE] - before == 31, "a write was repeated, as its answer did not come"
    client.close()


main(sys.argv[1])
