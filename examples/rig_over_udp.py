"""A rig's computer over the network: one process computes the line, another one simulates the rig.

The simulated rig has a cylinder and a pantograph, computed with smaller steps, and knows nothing of the line.
Every millisecond of its time it sends the force that its load cell reads, as one packet of 8 bytes, and gets
the displacement to command in return. A real rig's controller would do the same at the rate of its own clock.

    python examples/rig_over_udp.py --seconds 5
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import socket
import struct
import time

import numpy as np

from panto_env.base.arrays import from_kmh
from panto_env.catalog import load_pantograph
from panto_env.rig import RigComputer
from panto_env.rig.computer import load_rig

RIG, PANTOGRAPH, SPEED_KMH = "rig-flexible", "own-two-mass", 250.0
NUMBER = struct.Struct("<d")
PATIENCE = 20.0
"""Seconds after which either side gives up."""
STOP = math.nan


def compute(port: int, seconds: float, ready: multiprocessing.synchronize.Event) -> None:
    """The computer: answer forces (N) with displacements (m) to command, until a force is nan."""
    data = load_rig(RIG)
    cell = data.load_cell.model_copy(update={"filter_frequency": 1e4})  # the simulated rig has no filter
    data = data.model_copy(update={"load_cell": cell})
    speed = from_kmh(SPEED_KMH)
    force, spans = load_pantograph(PANTOGRAPH).nominal_force(speed), data.spans
    spans = max(spans, math.ceil(data.alignment().in_spans(seconds * speed)) + 2)
    computer = RigComputer(data, SPEED_KMH, force=force, spans=spans)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.bind(("127.0.0.1", port))
        channel.settimeout(PATIENCE)
        ready.set()
        while True:
            packet, sender = channel.recvfrom(NUMBER.size)
            (force,) = NUMBER.unpack(packet)
            if math.isnan(force):
                return
            channel.sendto(NUMBER.pack(computer.step(force)), sender)


def stand_in(port: int, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """The simulated rig: forces (N) and round-trip times (s), one for each millisecond."""
    panto, step, substeps = load_pantograph(PANTOGRAPH), 1e-3, 20
    dt, omega, ratio = step / substeps, 2 * math.pi * 60.0, 0.7
    (head_mass, frame_mass), (k_head, k_frame) = panto.masses, panto.stiffnesses
    c_head, c_frame = panto.dampings
    lift, strip = panto.nominal_force(from_kmh(SPEED_KMH)), panto.contact_stiffness
    cylinder = velocity = head = frame = head_velocity = frame_velocity = 0.0
    head = lift / strip  # at rest, in contact with the cylinder
    frame = head + lift / k_head
    lift += k_frame * frame
    forces, trips, command = [], [], 0.0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.settimeout(PATIENCE)
        for _ in range(round(seconds / step)):
            for _ in range(substeps):
                velocity += dt * (omega**2 * (command - cylinder) - 2 * ratio * omega * velocity)
                cylinder += dt * velocity
                force = max(0.0, strip * (head - cylinder))
                link = k_head * (frame - head) + c_head * (frame_velocity - head_velocity)
                head_velocity += dt * (link - force) / head_mass
                frame_velocity += dt * (lift - link - k_frame * frame - c_frame * frame_velocity) / frame_mass
                head += dt * head_velocity
                frame += dt * frame_velocity
            begin = time.perf_counter()
            channel.sendto(NUMBER.pack(force), ("127.0.0.1", port))
            (command,) = NUMBER.unpack(channel.recv(NUMBER.size))
            trips.append(time.perf_counter() - begin)
            forces.append(force)
        channel.sendto(NUMBER.pack(STOP), ("127.0.0.1", port))
    return np.array(forces), np.array(trips)


def free_port() -> int:
    """A free port of this machine."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.bind(("127.0.0.1", 0))
        return int(channel.getsockname()[1])


def run(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Run both sides, the computer in its own process."""
    context = multiprocessing.get_context("spawn")
    port, ready = free_port(), context.Event()
    computer = context.Process(target=compute, args=(port, seconds, ready), daemon=True)
    computer.start()
    if not ready.wait(10 * PATIENCE):  # the first run compiles
        raise RuntimeError("The computer did not start.")
    found = stand_in(port, seconds)
    computer.join(PATIENCE)
    return found


def main() -> None:
    """Run the example and print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    forces, trips = run(parser.parse_args().seconds)
    settled = forces[len(forces) // 3 :]
    print(f"contact force: mean {settled.mean():.1f} N, standard deviation {settled.std():.1f} N")
    print(f"round trip: median {1e6 * np.median(trips):.0f} us, longest {1e6 * trips.max():.0f} us")


if __name__ == "__main__":
    main()
