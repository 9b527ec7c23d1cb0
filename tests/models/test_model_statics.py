# SPDX-License-Identifier: MIT
"""Models at rest: support forces, stresses and thrusts against statics."""

import math

import numpy as np
import pytest
from model_runs import INPUTS, G, Run, run_program

GAMMA = 2500 * G


def test_stack_stresses_and_reactions(run_model, near):
    run = run_model("stack")
    stress = run["history/measured_stress"][-1, :, 1]
    for block in range(5):
        # mean stress = weight above the middle; the area changes by the strain, 1e-5
        near(f"stack, mean stress of block {block + 1} [Pa]", stress[block], -GAMMA * (4.5 - block), 1e-4)
    near("stack, support force [N]", run.support_forces()[:, 1].sum(), run.weight(), 1e-9)


def test_flat_arch_thrust(run_model, near):
    run = run_model("flat_arch")
    left, right = run.support_forces()[:3].sum(axis=0), run.support_forces()[3:].sum(axis=0)
    near("flat_arch, vertical reaction [N]", left[1], run.weight() / 2, 1e-6)
    near("flat_arch, sum of thrusts over thrust", (left + right)[0] / left[0], 0.0, 1e-5, absolute=True)
    # the joints open until the left three voussoirs hang between two corners: the springing's lower one, A, and the
    # keystone's upper one, B. Moments about A give the thrust.
    skew = 4.6 / 3.6

    def first_moment(x):  # of the part of the arch from its axis to the joint at x, about the axis
        return x**2 / 2 * (1 + skew + skew**2) / 3

    def area(x):
        return x * (1 + skew) / 2

    key = GAMMA * area(0.3)
    arm = 2.1 * (area(2.1) - area(0.3)) - (first_moment(2.1) - first_moment(0.3))
    thrust = GAMMA * arm + key * (2.1 - 0.3 * skew)
    # joints of finite stiffness are pressed beside the corners too, and the thrust line is that much flatter: with
    # joints a hundred times as stiff corners move by 1e-4 m in an arch 1 m high, and the elastic keystone takes part
    assert thrust < left[0] < 1.1 * thrust
    rigid = run_model("flat_arch", "&contact stiffness = 1e12 /").support_forces()
    near("flat_arch, thrust [N]", rigid[:3].sum(axis=0)[0], thrust, 1e-3)
    assert left[0] / (left[1] - GAMMA * _abutment_area()) > 1 / math.tan(math.radians(60 - 35 + 30))


def _abutment_area():
    return 2.9 * 2.5 - 0.5 * (2.1 * 4.6 / 3.6 - 2.1)


def test_six_block_beam_is_a_three_hinged_arch(run_model, near):
    run = run_model("six_block_beam")
    left, right = run.support_forces()[:4].sum(axis=0), run.support_forces()[4:].sum(axis=0)
    near("six_block_beam, vertical reaction [N]", left[1], run.weight() / 2, 1e-6)
    near("six_block_beam, sum of thrusts over thrust", (left + right)[0] / left[0], 0.0, 1e-6, absolute=True)
    # hinges: the lower corner at the abutment and the upper one at mid-span, where they are now
    offset, corners = run["model/vertex_offset"], run["frames/vertices"][-1]

    def corners_of(x):
        block = run.block_at(x, 0.5)
        return corners[offset[block] : offset[block + 1]]

    outer, inner = corners_of(-2.5), corners_of(-0.5)
    foot = outer[np.argmin(outer @ [1, 1])]
    crown = inner[np.argmax(inner @ [1, 1])]
    thrust = GAMMA * 6**2 / 8 / (crown[1] - foot[1])
    # the joints are pressed beside the corners too: the arch is that much flatter
    assert thrust < left[0] < 1.05 * thrust
    # the arms of the weights change by the shortening, 1e-5 m of 1.5 m
    rigid = run_model("six_block_beam", "&contact stiffness = 1e12 /").support_forces()
    near("six_block_beam, thrust w L^2 / 8 z [N]", rigid[:4].sum(axis=0)[0], thrust, 1e-3)
    assert run["history/max_displacement"][-1] < 1e-12  # at rest
    # a half of the arch, 3 m long and 1 m high, shortens by 3 H/E = 6.6e-5 m and in each of 3.5 joints by H over the
    # stiffness of the joint where all of it is closed, of a sixth of it where a corner bears alone: the middle sinks by
    # 3 times as much
    joint = thrust / run.joint_stiffness(1e10)
    assert 3 * (3 * thrust / 5e9 + 3.5 * joint) < -run.displacement(0)[-1, 1] < 3 * (3 * thrust / 5e9 + 3.5 * 6 * joint)


def test_layered_roof_carries_its_weight(run_model, near):
    run = run_model("layered_roof")
    assert len(run["model/block_area"]) == 166
    left, right = run.support_forces()[:4].sum(axis=0), run.support_forces()[4:].sum(axis=0)
    # at rest to 1e-7 m per step
    assert run["history/max_displacement"][-1] < 1e-7
    near("layered_roof, support force [N]", (left + right)[1], run.weight(), 1e-4)
    near("layered_roof, sum of thrusts over thrust", (left + right)[0] / left[0], 0.0, 1e-4, absolute=True)
    # friction at the abutments: V <= H tan(phi)
    weight_of_roof = GAMMA * 40
    assert weight_of_roof / 2 <= left[0] * math.tan(math.radians(40))
    assert 0 < -run.displacement(0)[-1, 1] < 0.02


def test_bolted_beam_moments(run_model, near):
    run = run_model("bolted_beam")
    ends = run["history/measured_displacement"][-1, :2]
    bolt = 2e5 + 1e7 * (ends[1, 0] - ends[0, 0])
    # the bolt's force is the only axial one, and the mean stress of a block 1 m high
    near("bolted_beam, axial stress of the middle blocks [Pa]", run["history/measured_stress"][-1, 2, 0], -bolt, 1e-4)
    near("bolted_beam, support force [N]", run.support_forces()[:, 1].sum(), run.weight(), 1e-9)
    # moment at mid-span: W/2 at the knife edge (2.8 m), the half beam's weight at 1.5 m; its couple is bolt - joint
    left, right = run.block_at(-0.5, 0.5), run.block_at(0.5, 0.5)
    pressed = [(place[1], force[0]) for blocks, place, force in run.contacts() if set(blocks) == {left, right}]
    total = sum(abs(f) for _, f in pressed)
    height = sum(y * abs(f) for y, f in pressed) / total
    moment = GAMMA * 3 * (2.8 - 1.5)
    near("bolted_beam, force through the middle joint [N]", total, bolt, 1e-4)
    # the bolt ends sink with the beam by 1e-4 m
    near("bolted_beam, height of that force [m]", height, 0.3 + moment / bolt, 1e-3)
    assert 0 < height < 1


def test_bolted_beam_falls_without_its_bolt(program, tmp_path):
    text = (INPUTS / "bolted_beam" / "bolted_beam.dc").read_text(encoding="utf-8")
    lines = text.replace("1   # bolts", "0   # bolts").splitlines()
    del lines[lines.index("# bolts: x1 y1 x2 y2 stiffness pretension strength") + 1]
    (tmp_path / "beam.dc").write_text("\n".join(lines), encoding="utf-8")
    arguments = ["run", "beam.dc", str(INPUTS / "bolted_beam" / "bolted_beam.df"), "-o", "beam.h5", "--quiet"]
    outcome = run_program(program, arguments, tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    # the blocks between the knife edges fall freely: n g dt^2 / 2 in static steps
    run = Run(tmp_path / "beam.h5")
    middle = -run.displacement(2)[:, 1]
    assert middle[-1] > 0.5 * 0.5 * G * np.sum(run["history/dt"] ** 2)


def test_gravity_dam_reaction(run_model, near):
    run = run_model("gravity_dam")
    thrust = 0.5 * 9810 * 6**2
    total = run.support_forces().sum(axis=0)
    near("gravity_dam, horizontal support force [N]", total[0], -thrust, 1e-4)
    near("gravity_dam, vertical support force [N]", total[1], run.weight(), 1e-6)
    # where the base presses: moments of weight and water about the heel
    dam_area = (5 + 1.5) / 2 * 6
    arm = (1.5 * 6 * 0.75 + 0.5 * 3.5 * 6 * (1.5 + 3.5 / 3)) / dam_area
    expected = arm + thrust * 2 / (GAMMA * dam_area)
    rock, base = run.block_at(2.5, -1), run.block_at(2.2, 1)
    joint = [(place[0], force[1]) for blocks, place, force in run.contacts() if set(blocks) == {rock, base}]
    pressed = sum(abs(f) for _, f in joint)
    near("gravity_dam, force on the base [N]", pressed, GAMMA * dam_area, 1e-6)
    # places move by 1e-4 m of 5 m
    near("gravity_dam, its distance from the heel [m]", sum(x * abs(f) for x, f in joint) / pressed, expected, 1e-3)
    assert expected < 2 * 5 / 3  # in the middle third


def test_cantilever_of_tied_cells_bends_as_a_beam(program, run_model, near, tmp_path):
    run = run_model("cantilever")
    modulus, span, weight = 1e10, 5.0, GAMMA
    bending = weight * span**4 / (8 * modulus / 12)
    shear = weight * span**2 / (2 * 5 / 6 * modulus / (2 * 1.25))
    tip = -run.displacement(0)[-1, 1]
    # cells of a quarter of the height are too stiff by 0.4 %
    near("cantilever, deflection of the tip [m]", tip, bending + shear, 0.006)
    force, place = run.support_forces(), run["model/fixed_points"]
    near("cantilever, support force [N]", force[:, 1].sum(), run.weight(), 1e-9)
    # of the beam and of the wall, about the foot of the joint between them; the beam's centre moves by 1e-6 m
    moment = (place[:, 0] * force[:, 1] - place[:, 1] * force[:, 0]).sum()
    near("cantilever, moment of the supports [N m]", moment, weight * (span**2 / 2 - 1 / 2), 1e-6)
    assert run["history/attempts"].max() == 1
    # half the size: 0.3 %, the wall that is clamped on its whole side
    options = (INPUTS / "cantilever" / "cantilever.nml").read_text(encoding="utf-8")
    (tmp_path / "fine.nml").write_text(options.replace("size = 0.25", "size = 0.125"), encoding="utf-8")
    files = [str(INPUTS / "cantilever" / f"cantilever.{ending}") for ending in ("dc", "df")]
    outcome = run_program(program, ["run", *files, "--config", "fine.nml", "-o", "fine.h5", "--quiet"], tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    tip = -Run(tmp_path / "fine.h5").displacement(0)[-1, 1]
    near("cantilever, deflection with cells of half the size [m]", tip, bending + shear, 0.004)


def test_tunnel_stands(run_model, near):
    run = run_model("tunnel")
    horseshoe = 5 * 2 + sum(0.5 * 2.5**2 * math.sin(math.radians(20)) for _ in range(9))
    near("tunnel, area left by the opening [m2]", run["model/block_area"].sum(), 22 * 19 - horseshoe, 1e-9)
    near("tunnel, support force [N]", run.support_forces()[:, 1].sum(), run.weight(), 1e-6)
    assert run["history/max_displacement"][-1] < 1e-9
    # the roof comes down by less than a millimetre; the walls carry more than the overburden at their height
    assert 0 < -run.displacement(0)[-1, 1] < 1e-3
    wall = run["frames/stress"][-1, run.block_at(-2.9, 2.5), 1]
    assert wall < -GAMMA * (12 - 2.5)
    assert np.abs(run["frames/rotation"][-1]).max() < 1e-3


def test_crossed_joints_settle_in_full_steps(run_model, near):
    run = run_model("crossed_joints")
    near("crossed joints, support force [N]", run.support_forces()[:, 1].sum(), run.weight(), 1e-6)
    assert run["history/max_displacement"][-1] < 1e-9
    # four blocks at every crossing, all pressed together from the start: no step is cut, and friction, which settles
    # anew in hundreds of contacts at the start, needs few rounds soon
    assert run["history/attempts"].max() == 1
    assert abs(run["history/dt"][:] - 0.02).max() < 1e-12
    rounds = run["history/open_close_iterations"][:]
    assert rounds[0] <= 16
    assert rounds[1:].max() <= 8
    assert rounds[1:].mean() < 2
    # nearly all joints are closed, the roof comes down by less than a millimetre
    first, last = run["frames/contact_offset"][-2:]
    assert (run["frames/contact_state"][first:last] > 0).sum() > 450
    assert 0 < -run.displacement(0)[-1, 1] < 1e-3


def test_island_rests_in_its_hole(run_model, near):
    run = run_model("island")
    areas = np.sort(run["model/block_area"])
    assert np.allclose(areas, [4, 32], rtol=1e-12)
    near("island, support force [N]", run.support_forces()[:, 1].sum(), G * (2500 * 32 + 3000 * 4), 1e-9)
    # the floor of the hole pushes with the island's weight, the rest of the hole does not
    inside = int(np.argmin(run["model/block_area"]))
    lifted = sum(force[1] * (1 if blocks[0] == inside else -1) for blocks, _, force in run.contacts())
    near("island, force between island and block [N]", lifted, G * 3000 * 4, 1e-6)


@pytest.mark.parametrize(
    "options",
    [
        "method = 'sor'",
        "method = 'dense'",
        "method = 'auto'",
        *(f"method = 'pcg', preconditioner = '{name}'" for name in ("block_jacobi", "ssor", "block_ic0")),
    ],
)
def test_solvers_of_the_options_file_carry_the_stack(program, tmp_path, near, options):
    (tmp_path / "solver.nml").write_text(f"&solver {options} /\n", encoding="utf-8")
    files = [str(INPUTS / "stack" / f"stack.{ending}") for ending in ("dc", "df")]
    outcome = run_program(program, ["run", *files, "--config", "solver.nml", "-o", "stack.h5", "--quiet"], tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    run = Run(tmp_path / "stack.h5")
    # the default tolerance of the iterative solvers is 1e-10 of the loads, in each of 60 steps
    near(f"stack with {options}, support force [N]", run.support_forces()[:, 1].sum(), run.weight(), 1e-6)


@pytest.mark.parametrize(("n", "stiffness"), [(1, 2e10), (1, 1e13), (2, 2e10)])
def test_layers_with_a_strong_joint_bend_as_one_beam(program, tmp_path, near, n, stiffness):
    """Two layers of tied cells, 10 m long, each of n cells across 1 m, held at the left, pushed down at the right end:
    with a slip at each end of an interval they bent by 0.81, 0.03 and 0.99 of a beam."""
    young, push, length = 1e10, 1e4, 10
    cells = [(i / n, j / n) for j in range(2 * n) for i in range(-1, length * n)]
    corners = [(0, 0), (1 / n, 0), (1 / n, 1 / n), (0, 1 / n)]
    held = [number for number, (x, _) in enumerate(cells, 1) if x < 0]
    rows = ["rockdda-blocks 1", "e0 1e-5", f"blocks {len(cells)}", f"vertices {4 * len(cells)}"]
    rows += [f"fixed {4 * len(held)}", "loading 0", "measured 1", "bolts 0"]
    for number, (x, y) in enumerate(cells, 1):
        rows.append(f"block {number} 1 4")
        # edge 3 of the lower and edge 1 of the upper layer meet in the joint between the layers
        between = {2} if y + 1 / n == 1 else {0} if y == 1 else set()
        rows += [f"{x + a} {y + b} {2 if x >= 0 and k in between else 1}" for k, (a, b) in enumerate(corners)]
    rows += ["fixed_points", *(f"{a - 1 / n} {cells[k - 1][1] + b} {k}" for k in held for a, b in corners)]
    rows += ["loading_points", "measured_points", f"{length} 1 {len(cells) // 2}", "bolt_list", "end"]
    (tmp_path / "beam.blk").write_text("\n".join(rows) + "\n")
    loads = "".join(
        f"&loading_point at = {length - 1e-3}, {(j + 0.5) / n}, force = 0, {-push / (2 * n)} /\n" for j in range(2 * n)
    )
    (tmp_path / "beam.nml").write_text(
        f"""&model geometry = 'beam.blk', units = 'none' /
&block_material number = 1, density = 1, young = {young}, poisson = 0, unit_weight = 0 /
&joint_material number = 1, friction = 35, tie = .true. /
&joint_material number = 2, friction = 45, cohesion = 1e12, tension = 1e12,
                normal_stiffness = {stiffness}, shear_stiffness = {stiffness} /
{loads}&time k01 = 0 /
&stage name = 's', until = 'equilibrium' /
"""
    )
    outcome = run_program(program, ["run", "beam.nml", "-o", "beam.h5"], tmp_path)
    assert outcome.returncode == 0, outcome.stderr
    deflection = push * length**3 / (3 * young * 2**3 / 12) + 1.2 * push * length / (young / 2 * 2)
    bent = -Run(tmp_path / "beam.h5").displacement(0)[-1, 1] / deflection
    # cells of constant strain; the joint gives way by a part in 200
    near("deflection over that of a beam", bent, 1, 0.01)
