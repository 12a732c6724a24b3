"""Files of tensors: they answer as the library does, with derivatives, and never with NaN."""

from __future__ import annotations

import ast
import dataclasses
import importlib.util
import warnings
from functools import cache
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from checks import actuator_units
from exported import KEEP, limit_units, machine, off, truth
from pfabrik.errors import InvalidArgument, UnknownName, UnsupportedMechanism
from pfabrik.exchange.export.source import targets_around_home
from pfabrik.exchange.export.tensors import tensor_source
from pfabrik.machine.motion.joint_path import joint_path, passive_series

REFUSED = {
    "nrpm": "poses leave joints A1, B1",
    "panda": "between the ends of its rod, is not along it",
    "snake60": "between the ends of its rod, is not along it",
    "serial_arm": "legs on joints J3",
}
NAMES = [name for name in pf.catalog() if name not in REFUSED]
NAMES += ["exechon", "upu", "puu", "ankle", "closure.tricept", "planar_4rpr", "hinge", "slider"]
SERIES = ["ankle_rss", "ankle_ups", "g1_ankle", "tricept", "ankle", "closure.tricept"]
EXACT = {"float64": 1e-12, "float32": 1e-5}


def module_of(text: str) -> ModuleType:
    made = ModuleType("exported")
    exec(compile(text, "exported", "exec"), made.__dict__)
    return made


@cache
def module(name: str, backend: Any = "numpy", joints: tuple[str, ...] | None = None) -> ModuleType:
    """The exported file as a module; skips where its library is not installed."""
    {"torch": torch, "jax": jax}.get(backend, str)()
    return module_of(tensor_source(machine(name), backend=backend, joints=joints))


@cache
def series(name: str) -> tuple[str, ...]:
    return passive_series(machine(name))


@cache
def known(name: str, count: int) -> tuple[np.ndarray, pf.Solution]:
    """Targets that the library reaches without limits, and its answers."""
    free = machine(name).without_limits()
    targets = targets_around_home(machine(name), 3 * count, np.random.default_rng(5))
    solution = pf.solve_ik(free, targets, options=KEEP)
    if not (solution.status == 0).any():  # of a machine with less freedoms than its task: nearest to the targets
        targets = np.ascontiguousarray(solution.pose)
        solution = pf.solve_ik(free, targets, options=KEEP)
    rows = np.flatnonzero(solution.status == 0)[:count]
    return targets[rows], solution[rows]


def library_jacobian(solution: pf.Solution) -> np.ndarray:
    jacobian = pf.inverse_jacobian(solution)
    return np.concatenate([jacobian, 0.0 * jacobian], axis=-1) if jacobian.shape[-1] == 3 else jacobian


def as_rates(mechanism: pf.Mechanism, jacobian: np.ndarray) -> np.ndarray:
    """A Jacobian by twists over L and rad."""
    scale = np.repeat([mechanism.characteristic_length, 1.0], 3)
    return jacobian * scale / actuator_units(mechanism)[:, None]


def sharpness(mechanism: pf.Mechanism, jacobian: np.ndarray) -> np.ndarray:
    """How much rounding of a pose shows in each actuator, nearly dead cranks above all."""
    return np.maximum(1.0, np.linalg.norm(as_rates(mechanism, jacobian), axis=-1))


def check_actuators(name: str, made: ModuleType, number: Any, count: int, dtype: str = "float64") -> None:
    """Actuators and Jacobians at whole poses are the library's; where cranks are nearly dead, as far as rounding is."""
    mechanism, (targets, solution) = machine(name), known(name, count)
    actuators, jacobian = made.with_jacobian(number(targets))
    expected = library_jacobian(solution)
    sharp = sharpness(mechanism, expected)
    assert len(targets) > 0.2 * count
    assert (off(mechanism, np.asarray(actuators), solution.actuators) / sharp).max() <= EXACT[dtype]
    if dtype == "float64":
        error = np.abs(as_rates(mechanism, np.asarray(jacobian) - expected)).max(axis=(1, 2))
        assert (error <= 1e-9 * sharp.max(axis=1) ** 2).all()


@pytest.mark.parametrize("name", NAMES)
def test_actuators_and_jacobians_are_the_library_s_and_forward_kinematics_come_back(name: str) -> None:
    made = module(name)
    check_actuators(name, made, np.asarray, 40)
    check_actuators(name, made, lambda poses: poses.astype(np.float32), 40, "float32")
    mechanism, (targets, solution) = machine(name), known(name, 40)
    actuators, start = made.to_actuators(targets), solution.pose.copy()
    start[:, :3, 3] += 1e-3 * mechanism.characteristic_length * np.random.default_rng(0).normal(size=(len(start), 3))
    apart = made.to_actuators(made.to_pose(actuators, start=start)) - actuators
    turning = [drive.kind == "angle" for drive in mechanism.drives]
    apart[:, turning] = np.angle(np.exp(1j * apart[:, turning]))
    again = off(mechanism, apart, 0.0).max(axis=1)
    singular = pf.singularity(solution)
    clear = np.asarray(singular.forward) > 1e-2 if hasattr(singular, "forward") else np.ones(len(start), bool)
    assert clear.mean() > 0.5
    assert np.median(again[clear]) <= 1e-12
    assert (again[clear] <= 1e-9).mean() > 0.9


@pytest.mark.parametrize("name", SERIES)
def test_joints_give_poses_actuators_and_jacobians_and_come_back(name: str) -> None:
    mechanism, joints = machine(name), series(name)
    path, made = joint_path(mechanism, joints), module(name, joints=joints)
    reach = np.array([0.3 if c.kind == "angle" else 0.2 * mechanism.characteristic_length for c in path.coordinates])
    low, high = np.maximum(path.low, path.home - reach), np.minimum(path.high, path.home + reach)
    corners = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(len(low), -1).T
    q = np.concatenate([corners, np.random.default_rng(3).uniform(low, high, (100, len(low)))])
    poses, twists = path.poses_and_twists(q)
    assert np.abs(made.pose(q) - poses).max() <= 1e-14 * max(1.0, 10.0 * mechanism.characteristic_length)
    solution = pf.solve_ik(mechanism.without_limits(), poses, options=KEEP)
    rows = np.flatnonzero(solution.status == 0)
    assert len(rows) > 75
    q, twists, solution = q[rows], twists[rows], solution[rows]
    actuators, jacobian = made.with_jacobian(q)
    by_twists = library_jacobian(solution)
    expected = by_twists @ twists
    assert (off(mechanism, actuators, solution.actuators) / sharpness(mechanism, by_twists)).max() <= 1e-12
    assert np.abs(jacobian - expected).max() <= 1e-11 * np.abs(expected).max()
    assert np.abs(made.to_joints(actuators) - q).max() <= 1e-9 * reach.max()
    rates, torques = np.ones(q.shape), np.ones(actuators.shape)
    power = (made.velocities(q, rates) * torques).sum(-1) - (made.torques_to_joints(q, torques) * rates).sum(-1)
    assert np.abs(power).max() <= 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["g1_ankle", "delta"])
def test_any_leading_shape_is_taken_and_single_precision_stays(name: str) -> None:
    made, targets = module(name), known(name, 12)[0]
    actuators = made.to_actuators(targets)
    folded = targets.reshape(3, 4, 4, 4).astype(np.float32)
    n_a = actuators.shape[-1]
    for values, shape in (
        (made.to_actuators(folded), (3, 4, n_a)),
        (made.jacobian(folded), (3, 4, n_a, 6)),
        (made.to_pose(made.to_actuators(folded)), (3, 4, 4, 4)),
        (made.margins(folded), (3, 4, len(made.LIMITS))),
    ):
        assert values.shape == shape and values.dtype == np.float32
    np.testing.assert_array_equal(made.to_actuators(targets[0]), actuators[0])
    many = np.stack([made.parameters()] * len(targets))
    np.testing.assert_allclose(made.to_actuators(targets, many), actuators, rtol=1e-14)


@pytest.mark.parametrize("name", NAMES[: len(pf.catalog()) - len(REFUSED)])
def test_nothing_is_ever_nan_and_the_margin_says_what_is_out_of_reach(name: str) -> None:
    mechanism, made = machine(name), module(name)
    random, size = np.random.default_rng(1), np.repeat([[0.1], [3.0]], 30, axis=0)
    steps = random.uniform(-1.0, 1.0, (60, 3)) * size * mechanism.characteristic_length
    wild = pf.pose(mechanism.home_pose[:3, 3] + steps, rotvec=random.uniform(-1.0, 1.0, (60, 3)) * size)
    with np.errstate(all="raise", under="ignore"):
        results = [*made.with_jacobian(wild), made.margins(wild), made.to_pose(made.to_actuators(wild))]
    assert all(np.isfinite(values).all() for values in results)
    margin, place = made.margin(wild)
    assert (margin[np.asarray(pf.feasibility(mechanism, wild).margin) > 0.0] > -1e-9).all()
    assert set(np.unique(place)) <= set(range(len(made.LIMITS)))


def test_at_a_dead_point_the_value_is_clamped_and_the_margin_changes_sign() -> None:
    """A crank of length r and a rod of length l reach r + l: there the margin is 0, beyond the crank points there."""
    made = module("five_bar")
    at = dict(made.DIMENSIONS)
    centre, crank = np.array(at["cranks.centre"][0]), np.array(at["cranks.base_end"][0])
    reach = np.linalg.norm(crank - centre) + at["cranks.length"][0]
    targets = np.tile(np.eye(4), (3, 1, 1))
    direction = np.cross(np.array(at["cranks.axis"][0]), [0.6, 0.7, 0.5])
    direction /= np.linalg.norm(direction)
    targets[:, :3, 3] = centre + np.array([0.99, 1.0, 1.01])[:, None] * reach * direction
    dead = next(place for place, limit in enumerate(made.LIMITS) if limit.startswith("dead point"))
    margins = made.margins(targets)[:, dead]
    assert margins[0] > 1e-3 and abs(margins[1]) < 1e-12 and margins[2] < -1e-3
    assert np.isfinite(made.jacobian(targets)).all()


@pytest.mark.parametrize("name", ["stewart", "g1_ankle", "agile_eye", "canfield", "rrr"])
def test_margins_are_those_measured_on_all_joints(name: str) -> None:
    truths, made, mechanism = truth(name, 100), module(name), machine(name)
    rows = np.flatnonzero(truths.closes)
    measured = made.margins(truths.whole[rows])[:, : truths.slack.shape[1]] / limit_units(mechanism)
    np.testing.assert_allclose(measured, truths.slack[rows], atol=1e-9)


@pytest.mark.filterwarnings("ignore::pfabrik.errors.MobilityWarning")
@pytest.mark.parametrize(("name", "said"), REFUSED.items())
def test_machines_without_closed_forms_are_refused_by_name(name: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(UnsupportedMechanism) as caught:
        pf.export_numpy(machine(name), tmp_path / "machine.py")
    assert said in str(caught.value) and machine(name).name in str(caught.value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("more", "error", "said"),
    [
        ({"joints": ["roll_joint"]}, InvalidArgument, "in series"),
        ({"joints": ["pitch", "roll"]}, UnknownName, "pitch_joint"),
        ({"joints": "task"}, UnknownName, "no joint named 'task'"),
        ({"backend": "tensorflow"}, InvalidArgument, "backend"),
    ],
)
def test_arguments_that_do_not_fit_are_refused_with_the_reason(more: Any, error: Any, said: str) -> None:
    with pytest.raises(error, match=said):
        tensor_source(machine("g1_ankle"), **more)


@pytest.mark.parametrize(("name", "joints"), [("upu", ("U1.1", "P1.2", "U1.3")), ("puu", ("P1.1", "U1.2", "U1.3"))])
def test_joints_that_actuators_do_not_fit_are_refused_as_by_actuation(name: str, joints: tuple[str, ...]) -> None:
    """A leg's joints, which the other legs hold: a reason, and the same sentence as of the map in the library."""
    reasons = []
    for refuse in (lambda: tensor_source(machine(name), joints=joints), lambda: pf.actuation(machine(name), joints)):
        with pytest.raises(UnsupportedMechanism) as caught:
            refuse()
        reasons.append(caught.value.reasons)
    assert reasons[0] == reasons[1]
    assert "not 5" in str(reasons[0])


@pytest.mark.parametrize("backend", ["numpy", "torch", "jax"])
def test_a_file_imports_its_library_alone_and_is_ascii(backend: Any, tmp_path: Path) -> None:
    path = pf.export_tensors(machine("g1_ankle"), tmp_path / "ankle.py", backend=backend, joints=series("g1_ankle"))
    tree = ast.parse(path.read_bytes().decode("ascii"))
    imported = {node.module if isinstance(node, ast.ImportFrom) else node.names[0].name for node in ast.walk(tree)
                if isinstance(node, ast.Import | ast.ImportFrom)}  # fmt: skip
    assert {str(name).split(".")[0] for name in imported} <= {backend, "functools"}


def test_the_names_of_dimensions_are_those_of_their_numbers() -> None:
    made = module("stewart")
    values = dict(zip(made.PARAMETER_NAMES, made.parameters(), strict=True))
    assert values["struts.base_end[0].x"] == made.DIMENSIONS["struts.base_end"][0][0]
    assert values["struts.length[5]"] == made.DIMENSIONS["struts.length"][5]


def test_other_dimensions_are_another_machine() -> None:
    """A rod end moved: the same answers as those of a mechanism described so."""
    mechanism, made = machine("ankle_ups"), module("ankle_ups", joints=series("ankle_ups"))
    shifted = [dataclasses.replace(joint, at=(-82.0, 48.0, 0.0)) if joint.name == "AL" else joint
               for joint in mechanism.joints]  # fmt: skip
    moved = dataclasses.replace(mechanism, joints=tuple(shifted))
    other = module_of(tensor_source(moved, joints=series("ankle_ups")))
    q = np.random.default_rng(0).uniform(-0.3, 0.3, (20, 2))
    np.testing.assert_allclose(made.to_actuators(q, other.parameters()), other.to_actuators(q), rtol=1e-13)
    assert np.abs(made.to_actuators(q) - other.to_actuators(q)).max() > 1e-3


# --- PyTorch and JAX: where they are installed. ---


@cache
def torch() -> Any:
    if importlib.util.find_spec("torch") is None:
        pytest.skip("PyTorch is not installed: pip install 'pfabrik[tensors]'")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return importlib.import_module("torch")


@cache
def jax() -> Any:
    if importlib.util.find_spec("jax") is None:
        pytest.skip("JAX is not installed: pip install 'pfabrik[tensors]'")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = importlib.import_module("jax")
        found.config.update("jax_enable_x64", True)
    return found


def number_of(backend: str, dtype: str = "float64") -> Any:
    """What makes arrays of a backend."""
    if backend == "torch":
        return lambda values: torch().tensor(values, dtype=getattr(torch(), dtype))
    if backend == "jax":
        return lambda values: jax().numpy.asarray(values, dtype=dtype)
    return lambda values: values.astype(dtype)


@pytest.mark.parametrize("backend", ["torch", "jax"])
@pytest.mark.parametrize("name", ["g1_ankle", "stewart", "delta", "agile_eye", "tricept", "prr"])
def test_tensors_answer_as_the_library_does(name: str, backend: str) -> None:
    for dtype in EXACT:
        check_actuators(name, compiled(module(name, backend), backend), number_of(backend, dtype), 100, dtype)


@pytest.mark.campaign
@pytest.mark.parametrize("dtype", list(EXACT))
@pytest.mark.parametrize("backend", ["numpy", "torch", "jax"])
@pytest.mark.parametrize("name", NAMES)
def test_tensors_answer_as_the_library_does_on_many_poses(name: str, backend: str, dtype: str) -> None:
    check_actuators(name, compiled(module(name, backend), backend), number_of(backend, dtype), 20_000, dtype)


def compiled(made: ModuleType, backend: str) -> Any:
    """The functions of a file that are asked by many poses; JAX is asked as it is used."""
    return SimpleNamespace(with_jacobian=jax().jit(made.with_jacobian)) if backend == "jax" else made


def inside(name: str, joints: tuple[str, ...] | None, count: int) -> np.ndarray:
    """Coordinates well within all limits."""
    made = module(name, joints=joints)
    if joints is not None:
        return np.random.default_rng(2).uniform(-0.1, 0.1, (count, len(joints))) + made.DIMENSIONS["joints.home"]
    targets = known(name, 200)[0]
    margins = made.margins(targets)
    n = len(made.LIMITS) - ("legs do not close" in made.LIMITS)
    return targets[(margins[:, :n] > 1e-2).all(axis=1) & (margins > 0.0).all(axis=1)][:count]


OVERCONSTRAINED = ("agile_eye", "five_bar", "prr", "rpr", "rrr", "exechon", "planar_4rpr")
"""Machines whose legs share what they hold, and other dimensions do not let move: no Jacobian by poses is near."""

DIFFERENCED = [*((name, False) for name in NAMES), *((name, True) for name in SERIES if "tricept" not in name)]
DIFFERENCED_JAX = [("g1_ankle", True), ("delta", False), ("stewart", False), ("agile_eye", False)]


def check_gradients(name: str, by_joints: bool, backend: str) -> None:
    """Derivatives by the dimensions, of actuators and where they lead, are those of differences of the NumPy file."""
    joints = series(name) if by_joints else None
    plain, made = module(name, joints=joints), module(name, backend, joints)
    random, q = np.random.default_rng(6), inside(name, joints, 3)
    p, actuators, forward = plain.parameters(), plain.to_actuators(q), "to_joints" if by_joints else "to_pose"
    change = random.normal(size=len(p)) * plain.SIZE
    for ask, given in (("to_actuators", q), ("jacobian", q), (forward, actuators)):
        if ask == "jacobian" and not by_joints and name in OVERCONSTRAINED:
            continue

        def plainly(p: np.ndarray, ask: str = ask, given: np.ndarray = given) -> np.ndarray:
            return np.asarray(getattr(plain, ask)(given, parameters=p))

        weights = random.normal(size=plainly(p).shape)
        step = 1e-6 * change
        expected = ((plainly(p + step) - plainly(p - step)) * weights).sum() / 2e-6
        array = number_of(backend)
        at, factors = array(given), array(weights)

        def weighted(p: Any, ask: str = ask, at: Any = at, factors: Any = factors) -> Any:
            return (getattr(made, ask)(at, parameters=p) * factors).sum()

        if backend == "jax":
            gradient = jax().jit(jax().grad(weighted))(array(p))
        else:
            free = array(p).requires_grad_()
            (gradient,) = torch().autograd.grad(weighted(free), free)
        assert abs(np.asarray(gradient) @ change - expected) <= 1e-4 * np.abs(np.asarray(gradient) * change).sum(), ask


@pytest.mark.parametrize(("name", "by_joints"), DIFFERENCED)
def test_gradients_in_pytorch_are_those_of_differences(name: str, by_joints: bool) -> None:
    check_gradients(name, by_joints, "torch")


@pytest.mark.parametrize(("name", "by_joints"), DIFFERENCED_JAX)
def test_gradients_in_jax_are_those_of_differences(name: str, by_joints: bool) -> None:
    check_gradients(name, by_joints, "jax")


@pytest.mark.campaign
@pytest.mark.parametrize(("name", "by_joints"), [each for each in DIFFERENCED if each not in DIFFERENCED_JAX])
def test_gradients_of_all_machines_in_jax_are_those_of_differences(name: str, by_joints: bool) -> None:
    check_gradients(name, by_joints, "jax")


@pytest.mark.parametrize(
    ("name", "by_joints"), [("g1_ankle", True), ("ankle_ups", True), ("delta", False), ("stewart", False)]
)
def test_no_gradient_is_nan_at_and_beyond_dead_points(name: str, by_joints: bool) -> None:
    joints = series(name) if by_joints else None
    made = module(name, "torch", joints)
    random = np.random.default_rng(4)
    if by_joints:
        wild = random.uniform(-2.0, 2.0, (200, len(made.JOINTS)))
    else:
        home = machine(name).home_pose
        wild = pf.pose(
            home[:3, 3] + 2.0 * made.SIZE * random.uniform(-1, 1, (200, 3)), rotvec=random.uniform(-2, 2, (200, 3))
        )
        wild = np.concatenate([wild, home[None]])
    q, parameters = number_of("torch")(wild).requires_grad_(), made.parameters().requires_grad_()
    actuators = made.to_actuators(q, parameters)
    forward = made.to_joints if by_joints else made.to_pose
    values = [
        actuators,
        made.jacobian(q, parameters),
        made.margins(q, parameters),
        forward(actuators, parameters=parameters),
    ]
    for value in values:
        gradients = torch().autograd.grad(value.sum(), (q, parameters), retain_graph=True)
        assert torch().isfinite(value).all()
        assert all(torch().isfinite(gradient).all() for gradient in gradients)


def test_jax_maps_over_poses_and_differentiates_by_coordinates() -> None:
    """By the joints of an ankle: the Jacobian is the derivative, forward and back."""
    made = module("g1_ankle", "jax", series("g1_ankle"))
    q = number_of("jax")(inside("g1_ankle", series("g1_ankle"), 3))
    jacobian = jax().jit(made.jacobian)(q)
    for derivative in (jax().jacfwd, jax().jacrev):
        np.testing.assert_allclose(
            jax().jit(jax().vmap(derivative(made.to_actuators)))(q), jacobian, rtol=1e-9, atol=1e-12
        )
