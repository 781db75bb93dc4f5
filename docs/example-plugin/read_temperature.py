"""Prints the thermometer's messages: of its own type, live and in lockstep, and as bytes.

The type is made by `lcm-gen -p thermometer_t.lcm`.
"""

import ruedo
from example import thermometer_t

with ruedo.connect(timeout=30) as sim:
    rover = sim.robot("rover")
    temp = rover.stream("temp", thermometer_t)
    if sim.lockstep:
        for message in sim.step(40).all(temp):
            print(f"{message.utime * 1e-6:g} s: {message.temperature:.6f}")
    else:
        size = len(rover.stream("temp", raw=True).latest())
        print(f"{temp.latest().temperature:.6f}, {size} bytes")
