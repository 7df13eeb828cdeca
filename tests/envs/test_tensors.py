"""The environment of tensors does what the one of NumPy's arrays does; on a GPU where there is one."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest

torch = pytest.importorskip("torch")

from panto_env import InputError  # noqa: E402

from ..marks import some_at_once  # noqa: E402
from ..plant.test_frame_spring import line_over, with_table  # noqa: E402

DEVICE = "cuda" if torch.cuda.is_available() else "cpu"
EXACT = {"actuator": "realistic", "sensors": "ideal"}
"""No noise of sensors, which the two draw from different generators."""
CASES = {
    "flexible": ("Pantograph-v0", EXACT | {"distance": 700.0, "settle": 1.0, "accuracy": "fast"}),
    "overlap": (
        "Pantograph-v0",
        EXACT | {"catenary": "examples/overlap.toml", "distance": 500.0, "settle": 1.0, "accuracy": "fast"},
    ),
    "ramp": (
        "Pantograph-v0",
        EXACT
        | {"catenary": line_over((0.0, 0.1, 0.2) + (0.3,) * 12), "distance": 500.0, "settle": 1.0}
        | {"pantograph": with_table(), "accuracy": "fast"},
    ),
    "stiffness": ("PantographStiffness-v0", {"distance": 300.0}),
    "three-span": ("PantographThreeSpan-v0", {"distance": 150.0}),
    "train": (
        "Pantograph-v0",
        EXACT
        | {"pantographs": ["en50318-2002"] * 2, "distances": [100.0], "controlled": [1, 2]}
        | {"distance": 400.0, "settle": 1.0, "accuracy": "fast"},
    ),
}


def both(name, lanes, settings, **more):
    """The same lanes as arrays and as tensors."""
    ours = gymnasium.make_vec(f"panto_env:{name}", num_envs=lanes, device=DEVICE, **settings, **more)
    return gymnasium.make_vec(f"panto_env:{name}", num_envs=lanes, **settings, **more), ours


def check_same(arrays, tensors, within, where="infos"):
    """Infos have the same keys and values."""
    if isinstance(arrays, dict):
        assert set(arrays) == set(tensors), where
        for key, value in arrays.items():
            check_same(value, tensors[key], within, f"{where}[{key}]")
    elif arrays.dtype == object:  # final observations: one array for each lane that has ended
        for lane, own in enumerate(arrays):
            if own is not None:
                np.testing.assert_allclose(tensors[lane].cpu(), own, atol=within, err_msg=where)
    else:
        np.testing.assert_allclose(tensors.cpu(), arrays, atol=within, rtol=within, err_msg=where)


def check_episodes(arrays, tensors, within):
    """Episodes of both go alike until some have ended; the last infos of both."""
    seen, info = arrays.reset(seed=5)
    ours, our_info = tensors.reset(seed=5)
    check_same(seen, ours, within)
    check_same(info, our_info, within)
    random = np.random.default_rng(1)
    for _ in range(2000):
        action = random.uniform(-1, 1, arrays.action_space.shape).astype(np.float32)
        *results, info = arrays.step(action)
        *our_results, our_info = tensors.step(torch.from_numpy(action).to(tensors.unwrapped.device))
        ended = bool((results[2] | results[3]).any())
        if not (ended and arrays.unwrapped.autoreset_mode.value == "SameStep"):
            check_same(results[0], our_results[0], within, "observation")
            check_same(info, our_info, within)
        for given, own in zip(results[1:], our_results[1:], strict=True):
            check_same(given, own.to(torch.float64), max(within, 1e-6), "reward and flags")
        if ended:
            return info, our_info
    raise AssertionError("no episode has ended")


@pytest.mark.slow
@pytest.mark.parametrize("case", some_at_once(CASES, ["flexible", "stiffness"]))
def test_lanes_are_those_of_arrays(case):
    name, settings = CASES[case]
    # On a GPU all was equal so far, but another compiler may fuse other operations. Even the same one
    # does for arrays that lie otherwise in memory: on lines of spans one by one, by 1e-10 N.
    within = 0.0 if DEVICE == "cpu" and case not in ("overlap", "ramp") else 1e-3
    info, ours = check_episodes(*both(name, 4, settings), within)
    assert np.isfinite(info["figures"]["std"]).all()
    check_same(info["figures"], ours["figures"], within)


@pytest.mark.longer
def test_same_step():
    name, settings = CASES["stiffness"]
    arrays, tensors = both(name, 3, settings, autoreset_mode="SameStep")
    info, ours = check_episodes(arrays, tensors, 1e-9)
    for key in ("final_obs", "final_info", "_final_info"):
        check_same(info[key], ours[key], 1e-9, key)


@pytest.mark.longer
def test_disabled_and_masks():
    name, settings = CASES["stiffness"]
    arrays, tensors = both(name, 3, settings, autoreset_mode="Disabled")
    check_episodes(arrays, tensors, 1e-9)
    device = tensors.unwrapped.device
    action = torch.zeros(3, 1, device=device)
    with pytest.raises(InputError, match="lane 0 has ended"):
        tensors.step(action)
    mask = torch.ones(3, dtype=torch.bool, device=device)
    position = tensors.reset(options={"reset_mask": mask})[1]["position"]
    assert (position < 1.0).all()
    tensors.step(action)


@pytest.mark.longer
def test_seeds_and_starts():
    make = {"num_envs": 5, "device": DEVICE, "starts": 3, "distance": 300.0}
    env = gymnasium.make_vec("panto_env:PantographStiffness-v0", speed_kmh=(100, 300), **make)
    first, second = (env.reset(seed=7)[1]["speed_kmh"].tolist() for _ in range(2))
    assert first == second != env.reset(seed=8)[1]["speed_kmh"].tolist()
    assert first[:2] == first[3:]  # lane 3 begins from start 0 again
    assert len(set(first)) == 3


@pytest.mark.longer
def test_context_is_that_of_the_lane():
    make = {"num_envs": 3, "device": DEVICE, "distance": 300.0, "speed_kmh": (100, 300)}
    env = gymnasium.make_vec("panto_env:PantographStiffness-v0", **make)
    env.reset(seed=7)
    still = torch.zeros(3, 1, device=env.unwrapped.device)
    while "figures" not in (info := env.step(still)[-1]):  # worked out in the lanes of starts
        pass
    for lane, speed_kmh in enumerate(info["speed_kmh"].tolist()):
        assert env.unwrapped.context(lane).speed * 3.6 == pytest.approx(speed_kmh)


@pytest.mark.longer
def test_noise_is_drawn_anew():
    env = gymnasium.make_vec(
        "panto_env:PantographStiffness-v0", num_envs=2, device=DEVICE, sensors="realistic"
    )
    still = torch.zeros(2, 1, device=env.unwrapped.device)
    seen = []
    for _ in range(2):
        env.reset(seed=3)
        seen.append(torch.stack([env.step(still)[0] for _ in range(100)]))
    assert torch.equal(*seen)
    force = [entry.name for entry in env.unwrapped.task.layout.entries].index("contact force")
    scale = env.unwrapped.task.layout.entries[force].scale
    rough = (seen[0][:, 0, force] - seen[0][:, 1, force]) * scale  # both lanes run alike
    assert float(rough.std()) == pytest.approx(2.0 * 2**0.5, rel=0.3)  # N, of two readings


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"device": "tpu"}, "device must be"),
        ({"device": "cpu", "render_mode": "rgb_array"}, "no pictures"),
        ({"device": "cpu", "catenary": ["re250", "re330"]}, "share one line"),
        ({"device": "cpu", "starts": 1}, "starts"),
        pytest.param(
            {"device": "cuda"}, "needs a GPU", marks=pytest.mark.skipif(DEVICE == "cuda", reason="a GPU")
        ),
    ],
)
def test_refused(settings, said):
    with pytest.raises(InputError, match=said):
        gymnasium.make_vec("panto_env:Pantograph-v0", num_envs=2, **settings)


@pytest.mark.longer
def test_refused_actions_and_options():
    env = gymnasium.make_vec("panto_env:PantographStiffness-v0", num_envs=2, device=DEVICE)
    device = env.unwrapped.device
    with pytest.raises(InputError, match="call reset"):
        env.step(torch.zeros(2, 1, device=device))
    env.reset(seed=0)
    for action, said in (
        (torch.zeros(2, 1, dtype=torch.int64, device=device), "floating-point"),
        (torch.tensor([[0.0], [torch.nan]], device=device), "lane 1 must be finite"),
    ):
        with pytest.raises(InputError, match=said):
            env.step(action)
    for options, said in (
        ({"speed_kmh": 250}, "only the option reset_mask"),
        ({"reset_mask": torch.zeros(2, dtype=torch.bool, device=device)}, "reset_mask must be"),
    ):
        with pytest.raises(InputError, match=said):
            env.reset(options=options)
