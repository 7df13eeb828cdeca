"""The guard's promise: python -m tests.baselines.guard [POLICY ...] [--seeds N] [--tracks T ...] [--alone].

Policies behind the guard, on all lines, speeds, cases and journeys of the benchmark's tracks, under seeds
that nothing was tuned on. Over any ten spans of a pass σ is to be at most 5 % above that of the passive
pantograph, and no contact is to be lost that this keeps. --without: rules of the guard that are left out, by
the names of their constants. --alone: the policies without it. --first: seeds that are passed over, so that
many can be run in parts.
"""

import argparse
import math
import warnings
from functools import partial

import numpy as np

from panto_baselines.benchmark.settings import load_benchmark
from panto_baselines.benchmark.single_pass import _arguments
from panto_baselines.policies import guard_rules
from panto_env import simulate
from panto_env.analysis.pool import in_processes
from panto_env.metrics.low_pass import low_pass
from panto_env.terminal import counting

TRACKS = (
    "any-line",
    "unknown-line",
    "unknown-section",
    "high-speed-as-built",
    "train-both",
    "faults",
    "journey",
)
POLICIES = ("agent-any-pantograph", "agent-any-line", "repetitive", "pd:washout=1")
SPANS, PROMISED = 10, 5.0
FIRST_SEED = 5_000_000
"""Nothing was trained, tuned or selected from here on."""


def passes(tracks, first, seeds):
    """Track, number of its line, speed and seed."""
    for track in tracks:
        for number, line in enumerate(load_benchmark(f"benchmark/{track}").lines):
            for speed in line.speeds_kmh:
                yield from ((track, number, speed, FIRST_SEED + first + seed) for seed in range(seeds))


def sliding(run):
    """σ (N) over each ten spans in a row, and whether contact is lost there, from the third span on."""
    force = low_pass(run.contact_force, run.time_step)
    last = run.alignment.last_whole_span(float(run.position[-1]), 1e-9)
    numbers = np.searchsorted(run.alignment.supports, run.position, side="right")
    sums = [
        np.bincount(numbers, weights, minlength=last + 1)[3 : last + 1]
        for weights in (np.ones(len(force)), force, force**2, (run.contact_force <= 0).astype(float))
    ]
    count, first, second, lost = (np.convolve(each, np.ones(SPANS), "valid") for each in sums)
    return np.sqrt(np.maximum(second / count - (first / count) ** 2, 0.0)), lost > 0


def judge(policies, without, track, number, speed, seed):
    """For each policy: largest change of σ (%) over ten spans, the first of these, windows with contact lost.

    Contact counts as lost where the passive pantograph keeps it.
    """
    warnings.simplefilter("ignore")
    for rule in without:
        setattr(guard_rules, rule, 0.0 if rule in ("LOW", "QUIET") else math.inf)
    settings = load_benchmark(f"benchmark/{track}")
    arguments = _arguments(settings, settings.lines[number], speed, seed)
    passive, *runs = (simulate(policy=each, record_droppers=False, **arguments) for each in (None, *policies))
    found = []
    for run in runs:
        worst, lost_alone = (-math.inf, 0), 0
        for own, than in zip(run.train, passive.train, strict=True):
            if own.terminated and not than.terminated:  # it broke off where passive went on
                worst, lost_alone = (math.inf, 0), lost_alone + 1
                continue
            (std, lost), (quiet, lost_too) = sliding(own), sliding(than)
            length = min(len(std), len(quiet))
            changes = 100 * (std[:length] / quiet[:length] - 1)
            most = int(np.argmax(changes))
            worst = max(worst, (float(changes[most]), most + 3))
            lost_alone += int(np.sum(lost[:length] & ~lost_too[:length]))  # of any pantograph of a train
        found.append((*worst, lost_alone))
    return found


def main():
    """Print a row for each policy: passes, how many break the promise, the worst one and its seed."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("policies", nargs="*", default=POLICIES)
    parser.add_argument("--seeds", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="seeds to pass over")
    parser.add_argument("--tracks", nargs="*", default=TRACKS)
    parser.add_argument("--without", nargs="*", default=())
    parser.add_argument("--alone", action="store_true", help="without the guard")
    given = parser.parse_args()
    policies = [each if given.alone else f"guarded:{each}" for each in given.policies]
    todo = list(passes(given.tracks, given.first, given.seeds))
    with counting("passes") as progress:
        found = in_processes(
            [partial(judge, policies, given.without, *one) for one in todo], progress=progress
        )
    print("| policy | passes | above 5 % | contact lost | worst ten spans (%) | where |")
    print("|---|---:|---:|---:|---:|---|")
    for name, own in zip(policies, zip(*found, strict=True), strict=True):
        most = int(np.argmax([each[0] for each in own]))
        track, number, speed, seed = todo[most]
        line = load_benchmark(f"benchmark/{track}").lines[number]
        where = (
            f"{track}, {line.case or line.catenary}, {speed:g} km/h, seed {seed}, from span {own[most][1]}"
        )
        above, lost = sum(each[0] > PROMISED for each in own), sum(each[2] > 0 for each in own)
        print(f"| `{name}` | {len(own)} | {above} | {lost} | {own[most][0]:+.1f} | {where} |", flush=True)


if __name__ == "__main__":
    main()
