"""A motor that presses on one mass, integrated by SciPy: a judge of the plant's motors, in their own units.

Nothing here is the plant's: amperes, volts and radians, a PI current controller with its integrator, friction
by the sign of the speed, teeth by their angle. The mass stands on a spring and a damper and is held by a
spring whose other end moves as ``wire(t)``.
"""

import math
from collections import namedtuple

import numpy as np
from scipy.integrate import solve_ivp

STICKING = 1e-4
"""Speed (m/s) within which dry friction goes from one sense to the other here."""


class Rig:
    """One mass (kg), spring (N/m) and damper (N s/m) to the ground, and a spring (N/m) to the wire."""

    def __init__(self, motor, mass, stiffness, damping, holding, wire):
        self.motor, self.mass, self.stiffness, self.damping = motor, mass, stiffness, damping
        self.holding, self.wire = holding, wire
        self.integrator = False
        self.arm, self.ratio, self.count = motor.arm_length, motor.gear_ratio, motor.motors
        self.inertia = motor.rotor_inertia + motor.gear_inertia
        self.wide = 2 * math.pi * motor.bandwidth

    def voltage(self, current, speed, asked, integral):
        """Of the drive (V); speed of the shaft (rad/s), asked current (A), integral of what lacks (A s)."""
        motor, emf = self.motor, self.motor.torque_constant * speed
        if self.integrator:
            wanted = emf + self.wide * (motor.inductance * (asked - current) + motor.resistance * integral)
        else:
            most = (np.array([-1, 1]) * motor.voltage - emf) / motor.resistance
            asked = min(max(asked, most[0]), most[1])
            wanted = emf + motor.resistance * current + motor.inductance * self.wide * (asked - current)
        return min(max(wanted, -motor.voltage), motor.voltage)

    def asked(self, force, speed):
        """Current (A) that a force (N) at the head asks for, at a speed of the shaft (rad/s)."""
        force = min(max(force, -self.motor.force_limit), self.motor.force_limit)
        current = force * self.arm / (self.ratio * self.count * self.motor.torque_constant)
        peak, share = self.motor.peak_torque / self.motor.torque_constant, speed / self.motor.largest_speed
        up, down = (min(max((1 - sense * share) / 0.05, 0), 1) for sense in (1, -1))
        return min(max(current, -peak * down), peak * up)

    def rates(self, t, state, force):
        """Of height, speed, current, integral; and, of loose motors, angle and speed of the shaft."""
        z, w, current, integral, *loose = state
        motor, per_metre = self.motor, self.ratio / self.arm
        shaft = loose[1] if loose else w * per_metre
        asked = self.asked(force, shaft)
        voltage = self.voltage(current, shaft, asked, integral)
        di = (voltage - motor.resistance * current - motor.torque_constant * shaft) / motor.inductance
        outside = -self.stiffness * z - self.damping * w - self.holding * (z - self.wire(t))
        torque, sense = motor.torque_constant * current, math.tanh(shaft / per_metre / STICKING)
        lost = 1 - motor.gear_efficiency
        if loose:
            ahead, rate = loose[0] / self.ratio - z / self.arm, shaft / self.ratio - w / self.arm
            play = 0.5 * motor.backlash
            beyond = ahead - math.copysign(play, ahead) if abs(ahead) > play else 0.0
            teeth = motor.gear_stiffness * beyond + (motor.gear_damping * rate if beyond else 0.0)
            teeth = teeth if teeth * beyond > 0 else 0.0  # at the output (N m); they do not pull
            load = teeth / self.ratio
            friction = sense * (motor.friction_torque + lost * abs(load))
            turning = (torque - friction - load) / self.inertia
            acceleration = (outside + self.count * teeth / self.arm) / self.mass
            return [w, acceleration, di, asked - current, shaft, turning]
        # The teeth bear X = torque - J (acceleration of the shaft), and pass on X - friction(|X|).
        heavy = self.mass / (self.count * per_metre)  # torque of a motor by acceleration of the mass
        own = self.inertia * per_metre
        push = heavy / own * torque - outside / (self.count * per_metre) + sense * motor.friction_torque
        load = push / (1 + heavy / own - sense * lost * math.copysign(1, push))
        return [w, (torque - load) / own, di, asked - current]

    def run(self, forces, interval, step, start=None):
        """States at the end of each time step (s), under forces (N) that each hold for an interval (s)."""
        state = [0.0] * (6 if self.motor.backlash > 0 else 4) if start is None else list(start)
        if self.motor.backlash > 0 and start is not None and len(start) == 4:
            state += [state[0] * self.ratio / self.arm, 0.0]
        states = []
        for k, force in enumerate(forces):
            begin, steps = k * interval, round(interval / step)
            times = begin + step * np.arange(1, steps + 1)
            solved = solve_ivp(
                self.rates,
                (begin, times[-1] + 1e-12),
                state,
                t_eval=times,
                args=(force,),
                method="LSODA",
                rtol=1e-8,
                atol=1e-10,
                max_step=step,
            )
            states += solved.y.T.tolist()
            state = solved.y[:, -1]
        return np.array(states)


Power = namedtuple("Power", "current voltage copper mechanical electrical")
"""Of the motors of one place, means of each step: of each motor (A, V), of all (W): lost in armatures, put
out by arms, taken in."""


def motor_power(motor, force, speed, time_step):
    """Power of motors from a recorded force (N) and the speed (m/s) at which their ends moved apart.

    Both are means over time steps (s), (n,): a run's ``head_force``, and the velocity of the head minus that
    of the mass below it; or ``frame_force``, and ``frame_velocity``. The motors' equations are inverted:
    friction follows the sign of the speed, so a step in which they stick or reverse is only approximate. Not
    for motors with backlash, whose rotors move relative to the arms.
    """
    sense, inertia = np.sign(speed), motor.reflected_mass * np.gradient(speed, time_step)
    # The teeth bear X = e - inertia, and pass on X - sense (dry friction + lost share of |X|) = force -
    # inertia.
    borne = force - inertia + sense * motor.force_of(motor.friction_torque)
    borne = borne / (1.0 - sense * (1.0 - motor.gear_efficiency) * np.sign(borne))
    current = (borne + inertia) / motor.force_of(motor.torque_constant)
    emf = motor.torque_constant * motor.shaft_per_metre * speed
    voltage = motor.resistance * current + motor.inductance * np.gradient(current, time_step) + emf
    return Power(
        current=current,
        voltage=voltage,
        copper=motor.motors * motor.resistance * current**2,
        mechanical=(force - inertia) * speed,
        electrical=motor.motors * voltage * current,
    )
