"""Universal joints whose cross weighs something: imported, they weigh what MuJoCo has of the file itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pfabrik as pf
from in_mujoco import Model, notes_of
from test_dynamics import by_mujoco


def crossed_ankle(seed: int, cross: float = 0.8, pin: float = 0.05) -> str:
    """An ankle of two cranks as others model it, with random masses; those of its crosses are some times larger."""
    random = np.random.default_rng(seed)

    def inertial(scale: float) -> str:
        moments = np.sort(random.uniform(1.0, 1.9, 3)) * 1e-3 * scale
        turn, place, mass = random.standard_normal(4), 0.05 * random.standard_normal(3), random.uniform(0.5, 1.5)
        words = (" ".join(map(repr, each.tolist())) for each in (place, turn, moments))
        keys = ("pos", "quat", "diaginertia")
        said = " ".join(f'{key}="{text}"' for key, text in zip(keys, words, strict=True))
        return f'<inertial mass="{scale * mass!r}" {said}/>' if scale else ""

    legs, loops, motors = "", "", ""
    for side, name in ((0.03, "L"), (-0.03, "R")):
        legs += f"""<body name="crank{name}" pos="0 {side} 0.25"><joint name="motor{name}" axis="0 1 0"/>{inertial(0.1)}
          <body name="pin{name}" pos="-0.04 0 0"><joint name="u{name}" axis="0 1 0"/>{inertial(pin)}
          <body name="rod{name}"><joint name="v{name}" axis="1 0 0"/>{inertial(0.2)}
            <site name="top{name}" pos="0 0 -0.25"/></body></body></body>"""
        loops += f'<connect name="t{name}" site1="top{name}" site2="end{name}"/>'
        motors += f'<motor joint="motor{name}"/>'
    ends = "".join(f'<site name="end{name}" pos="-0.04 {y} 0"/>' for name, y in (("L", 0.03), ("R", -0.03)))
    return f"""<mujoco><compiler angle="radian"/><option gravity="1 -2 -9"/><worldbody><body name="shank">
      {inertial(1.0)}
      <body name="cross"><joint name="pitch" axis="0.1 1 0"/>{inertial(cross)}
      <body name="foot"><joint name="roll" axis="1 0.2 0.1"/>{inertial(1.2)}{ends}</body></body>{legs}
      </body></worldbody><equality>{loops}</equality><actuator>{motors}</actuator></mujoco>"""


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("pin", [0.05, 1e-9, 0.0])
def test_a_cross_weighs_what_it_weighs_in_the_file(seed: int, pin: float) -> None:
    """In motion, and as mass, MuJoCo on the file itself has what the machine has; pins of nothing are none."""
    text = crossed_ankle(seed, pin=pin)
    machine = pf.interop.from_mjcf(text, base="shank", end_effector="foot").mechanism
    assert {"pitch", "roll"} <= {joint.name for joint in machine.joints}
    assert ("uL+vL" in [joint.name for joint in machine.joints]) == (pin < 0.05)
    random = np.random.default_rng(seed)
    values, rates, gains = random.uniform(-0.3, 0.3, 2), *3.0 * random.standard_normal((2, 2))
    solution = pf.solve_fk(machine, values)
    if pin == 0.0:  # MuJoCo moves no body that weighs nothing
        text = crossed_ankle(seed, pin=1e-12)
    model = Model.of(text)
    assert model.lead(machine.actuator_names, values) < 1e-13
    forces, mass = by_mujoco(text, model.data.qpos.copy(), rates, gains)
    motion: dict[str, Any] = {"twists": rates, "accelerations": gains, "gravity": (1.0, -2.0, -9.0)}
    found = pf.inverse_dynamics(solution, at="actuators", **motion)
    np.testing.assert_allclose(found.actuators, forces, atol=1e-8 * np.abs(forces).max())
    np.testing.assert_allclose(pf.mass_matrix(solution, "actuators"), mass, atol=1e-8 * np.abs(mass).max())


def test_at_rest_a_cross_is_held_by_virtual_work() -> None:
    """Foot and cross ahead of the pitch axis, rods behind it as far as cranks are long: both motors alike."""
    inertial = (
        '<inertial><origin xyz="{} 0 0"/><mass value="{}"/><inertia ixx="1e-3" iyy="1e-3" izz="1e-3"/></inertial>'
    )

    def link(name: str, mass: float, ahead: float = 0.0) -> str:
        return f'<link name="{name}">{inertial.format(ahead, mass)}</link>'

    def hinge(name: str, links: tuple[str, str], at: str, axis: str) -> str:
        parent, child = links
        limit = '<limit lower="-1" upper="1" effort="40" velocity="9"/>'
        return (
            f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="{at}"/><axis xyz="{axis}"/>{limit}</joint>'
        )

    text = link("shank", 1) + link("cross", 0.8, 0.06) + link("foot", 1.2, 0.08)
    text += hinge("pitch", ("shank", "cross"), "0 0 0", "0 1 0") + hinge("roll", ("cross", "foot"), "0 0 0", "1 0 0")
    loops = []
    for side, n in ((0.03, "L"), (-0.03, "R")):
        text += link(f"crank{n}", 0.1) + link(f"pin{n}", 1e-9) + link(f"rod{n}", 0.2)
        text += hinge(f"motor{n}", ("shank", f"crank{n}"), f"0 {side} 0.25", "0 1 0")
        text += hinge(f"u{n}", (f"crank{n}", f"pin{n}"), "-0.04 0 0", "0 1 0")
        text += hinge(f"v{n}", (f"pin{n}", f"rod{n}"), "0 0 0", "1 0 0")
        points = [[0, 0, -0.25], [-0.04, side, 0]]
        loops.append({"name": f"t{n}", "type": "ball", "links": [f"rod{n}", "foot"], "at": points})
    file: dict[str, Any] = {"loops": loops, "actuated": ["motorL", "motorR"]}
    found = pf.interop.from_urdf(f'<robot name="ankle">{text}</robot>', file, end_effector="foot")
    assert "hinges whose axes cross are a universal joint: uL+vL, uR+vR" in notes_of(found)
    machine = found.mechanism
    at_rest = pf.inverse_dynamics(pf.solve_ik(machine, machine.home_pose), gravity=(0.0, 0.0, -9.81))
    expected = 9.81 * (0.08 * 1.2 + 0.06 * 0.8) / 2 - 9.81 * 0.04 * 0.2
    np.testing.assert_allclose(np.abs(at_rest.actuators), [expected, expected], rtol=1e-8)
