import numpy as np
import pytest

from panto_env import studies
from panto_env.identification import IDENTIFIED
from panto_env.studies.paper1_identification.published import (
    PUBLISHED,
    TRUTH,
    best_performance,
    dry_friction,
    expected,
    largest_mean_error,
    per_plate,
)  # fmt: skip

from . import made

DIFFER = {
    # Table 2's parameters do not give Table 1's motion.
    *(f"{name}, {series}, amplitude" for name in ("I", "II", "III") for series in ("f_1", "y_p3")),
    *(f"{name}, best P_f of y_p1 by Tables 1 and 2" for name in ("I", "II", "III")),
    # Table 5 against Eq. 9.
    "I, y_p1, maximum mean error that the printed P_f allows",
    # Noise and sampling of the paper's records are not known.
    *(f"{name}, condition number" for name in ("I", "II", "III")),
    # Least squares on derivatives of noise.
    "lowest coverage, equation error",
    "lowest coverage, equation error, low-passed",
}


def test_catalogue_holds_table_2():
    assert tuple(TRUTH[name] for name in IDENTIFIED) == PUBLISHED[0].values


def test_offsets_of_table_1_follow_from_table_2():
    for printed in PUBLISHED:
        for *_, offset, their_offset in expected(printed)[1:]:
            assert offset == pytest.approx(their_offset, abs=0.1)


def test_force_of_table_1_needs_about_one_newton_of_dry_friction():
    friction = [dry_friction(printed) for printed in PUBLISHED]
    np.testing.assert_allclose(friction, [0.979, 1.172, 1.083], atol=0.002)
    best = [best_performance(printed) for printed in PUBLISHED]
    np.testing.assert_allclose(best, [-37.4, -158.0, -49.0], atol=0.2)


def test_dry_friction_found_by_harmonic_balance_gives_the_force_back():
    """A square wave of friction added to the sine, its first harmonic by quadrature."""
    phase = np.linspace(0, 2 * np.pi, 20_001)[:-1]
    for printed in PUBLISHED:
        amplitude = expected(printed)[0][2]
        force = 1e-3 * printed.amplitudes[0] * per_plate(printed.frequency)[0]
        assert abs(force) == pytest.approx(amplitude)
        wave = (force * np.exp(1j * phase)).imag + dry_friction(printed) * np.sign(np.cos(phase))
        harmonic = 2 * np.mean(wave * np.exp(-1j * phase))
        assert abs(harmonic) == pytest.approx(printed.force[0], rel=1e-3)


def test_mean_error_of_experiment_1_exceeds_what_eq_9_allows():
    first, second = ([largest_mean_error(printed, k) for k in range(3)] for printed in PUBLISHED[:2])
    assert first == pytest.approx([0.1715, 0.1757, 0.1674], abs=1e-4)
    assert (np.array(first) < np.array(PUBLISHED[0].mean_error) - 0.05).all()
    assert (np.array(second) > PUBLISHED[1].mean_error).all()


@pytest.fixture(scope="module")
def outcome():
    return made("paper1-identification")


@pytest.mark.study
def test_numbers_are_those_of_the_document(outcome):
    assert {each.quantity for each in outcome.comparisons if not each.agrees} == DIFFER
    assert all(each.note for each in outcome.comparisons if not each.agrees)
    ours = {each.quantity: each.ours for each in outcome.comparisons}
    for quantity, value, within in (
        ("I, condition number", 969.4, 10),
        ("II, condition number", 1977, 30),
        ("III, condition number", 1715, 30),
        ("I, f_1, amplitude", 0.7708, 1e-3),
        ("lowest coverage, output error", 94.0, 2.0),
        ("lowest coverage, equation error", 0.0, 0.0),
        ("lowest fitting performance", 99.59, 0.05),
    ):
        assert ours[quantity] == pytest.approx(value, abs=within), quantity
    assert min(ours[f"{name}, RSD of k3"] for name in ("I", "II", "III")) > 100
    sweeps = outcome.numbers["sweep_rsd_k3"]["free"]
    assert sweeps[0] > 100  # a sine
    assert sweeps[-1] < 0.2  # a sweep to 4 Hz
    errors = np.abs(outcome.numbers["sampling"]["errors_percent"]["I"]).max(axis=1)
    assert errors[-1] < 0.5 < errors[-3]


@pytest.mark.study
def test_figures_and_numbers_are_written(outcome, tmp_path):
    files = {path.name for path in studies.write(outcome, tmp_path)}
    names = [f"figure-{k}" for k in range(6, 12)]
    names += ["rsd-and-condition", "stiffness-k3", "convergence", "coverage"]
    assert files == {"numbers.json", *(f"{name}.png" for name in names)}
    assert max((tmp_path / name).stat().st_size for name in files) < 150_000
