# SPDX-License-Identifier: MIT
"""Pictures, by what they hold: polygons, limits, labels, widths, colours."""

import itertools
import time

import matplotlib

matplotlib.use("Agg")

import h5py
import matplotlib.pyplot as plt
import numpy as np
import pytest
import rockdda
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.patches import PathPatch
from matplotlib.quiver import Quiver
from places import INPUTS
from rockdda import plot as pictures
from rockdda.plot.style import STATES, Units, limits_of, style
from synthetic import write_wall


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def wall(tmp_path_factory):
    """5 × 4 squares, 3 frames."""
    return rockdda.open(write_wall(tmp_path_factory.mktemp("wall") / "wall.h5", 5, 4))


def artists(axes, kind):
    return [artist for artist in axes.get_children() if isinstance(artist, kind)]


def test_blocks_show_every_polygon_where_it_is(wall):
    axes = wall.plot("stress_x")
    (drawn,) = artists(axes, PolyCollection)
    assert len(drawn.get_paths()) == wall.n_blocks
    np.testing.assert_allclose(drawn.get_paths()[7].vertices[:4], wall.polygons(-1)[7])
    np.testing.assert_array_equal(drawn.get_array(), wall.field("stress_x", -1))
    assert axes.get_aspect() == 1
    low, high = wall.frames[-1].vertices.min(axis=0), wall.frames[-1].vertices.max(axis=0)
    assert axes.get_xlim()[0] < low[0] < high[0] < axes.get_xlim()[1]
    assert axes.get_ylim()[0] < low[1] < high[1] < axes.get_ylim()[1]
    assert axes.get_title(loc="left") == "wall, t = 0.2"
    assert axes.get_xlabel() == "x [length]"


def test_the_start_is_outlined_where_blocks_have_moved(wall):
    (outline,) = artists(wall.plot("material"), PathPatch)
    assert np.sum(outline.get_path().codes == 1) == wall.n_blocks  # one MOVETO for each
    assert not artists(wall.plot("material", frame=0), PathPatch)
    assert not artists(wall.plot("material", outline=False), PathPatch)


def test_colour_scales(wall):
    def scale(field, **options):
        (drawn,) = artists(wall.plot(field, **options), PolyCollection)
        return (*drawn.get_clim(), drawn.get_cmap().name)

    assert scale("stress_x") == (-9.0, -1.0, "viridis_r")  # all compression
    assert scale("displacement")[0] > 0
    # both signs: symmetric, white at zero
    assert limits_of("stress_x", np.array([-1.0, 0.5]), None) == (-1.0, 1.0, "RdBu_r")
    assert scale("stress_x", limits=(-20, 0))[:2] == (-20, 0)
    assert scale("stress_xy") == (0.5, 1.5, "viridis")  # one value everywhere


def test_colour_bar_says_what_and_in_which_unit(wall):
    def label(units):
        axes = wall.plot("stress_x", units=units)
        return next(a for a in axes.child_axes).get_ylabel()

    assert label(None) == r"$\sigma_x$ [force/length²]"
    assert label("m,s,N") == r"$\sigma_x$ [Pa]"
    assert label("m,s,kN") == r"$\sigma_x$ [kPa]"
    assert label("ft,s,lbf") == r"$\sigma_x$ [lbf/ft²]"
    with pytest.raises(ValueError, match="expected length, time, force"):
        wall.plot("stress_x", units="m,s")


@pytest.mark.parametrize("flat", [1, 4, 16])
def test_labels_of_colour_bars_neither_leave_flat_pictures_nor_squeeze_them(wall, flat):
    """A beam 16 times as long as high: the bar is shorter than its label."""
    import matplotlib.pyplot as plt
    from matplotlib.collections import PolyCollection
    from rockdda.plot.block_maps import add_colour_bar
    from rockdda.plot.style import new_axes, size_of, style

    with style():
        figure, axes = new_axes(None, size_of(float(flat), 1.0))
        drawn = PolyCollection([[(0, 0), (flat, 0), (flat, 1), (0, 1)]], array=np.array([3.0]))
        axes.add_collection(drawn)
        axes.set(xlim=(0, flat), ylim=(0, 1), aspect="equal")
        add_colour_bar(axes, drawn, Units(), "normal stress of joints", "stress")
        figure.canvas.draw()
        label = axes.child_axes[0].yaxis.label.get_window_extent()
        inside, outer = axes.get_window_extent(), figure.bbox
    assert outer.x0 <= label.x0 and label.x1 <= outer.x1 and outer.y0 <= label.y0 and label.y1 <= outer.y1
    # what size_of leaves beside the map, and the label in a few lines; squeezed it was a third of the figure
    assert inside.height > 0.5 * outer.height if flat == 1 else inside.width > 0.6 * outer.width
    plt.close(figure)


def test_materials_have_a_legend(wall):
    axes = wall.plot("material")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["block material 1", "block material 2"]


def test_materials_have_their_names(wall, tmp_path):
    path = tmp_path / "named.h5"
    path.write_bytes(wall.path.read_bytes())
    with h5py.File(path, "a") as file:
        del file["input/config"]
        file["input/config"] = "&block_material number = 2, name = 'marl' /"
    axes = rockdda.open(path).plot("material")
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["block material 1", "marl"]


def test_displacements_can_be_enlarged(wall):
    axes = wall.plot(scale=10)
    drawn = artists(axes, PolyCollection)[0].get_paths()[19].vertices[2]
    start = wall.polygons(0)[19][2]
    np.testing.assert_allclose(drawn, start + 10 * (wall.polygons(-1)[19][2] - start))
    assert "displacements × 10" in axes.get_title(loc="left")


def test_stress_crosses_have_directions_sizes_and_signs(wall):
    axes = pictures.stress_crosses(wall)
    (crosses,) = artists(axes, LineCollection)
    segments = np.array(crosses.get_segments())
    assert len(segments) == 2 * wall.n_blocks
    principal, angle = wall.frames[-1].principal_stress()
    # find the arms of block 13 by their middle
    middle = segments.mean(axis=1)
    mine = np.flatnonzero(np.hypot(*(middle - wall.frames[-1].centroid[13]).T) < 1e-9)
    arms = segments[mine][:, 1] - segments[mine][:, 0]
    lengths = np.hypot(*arms.T)
    ratio = np.sort(np.abs(principal[13]))
    assert np.sort(lengths)[1] / np.sort(lengths)[0] == pytest.approx(ratio[1] / ratio[0])
    along = arms[np.argmin(np.abs(np.arctan(arms[:, 1] / arms[:, 0]) - angle[13]))]
    assert np.arctan(along[1] / along[0]) == pytest.approx(angle[13])
    tension = sum(np.all(colour == to_rgba("#D55E00")) for colour in crosses.get_colors())
    assert tension == np.sum(principal > 0)


def test_contact_forces_have_widths_and_colours(wall):
    axes = pictures.contact_forces(wall)
    (strokes,) = artists(axes, LineCollection)
    assert len(strokes.get_segments()) == 2  # the open one is a dot
    widths = strokes.get_linewidths()
    assert widths[0] > widths[1]  # the larger force first
    np.testing.assert_allclose(strokes.get_colors()[0], to_rgba(STATES["locked"]))
    np.testing.assert_allclose(strokes.get_colors()[1], to_rgba(STATES["sliding"]))
    ends = strokes.get_segments()[0]
    np.testing.assert_allclose(ends.mean(axis=0), [1.5, 1.0])
    assert ends[0][0] == ends[1][0]  # upright, as the force
    assert [t.get_text() for t in axes.get_legend().get_texts()] == ["sliding (1)", "locked (1)", "open (1)"]


def test_arrows_are_displacements(wall):
    axes = pictures.displacements(wall, scale=5)
    (arrows,) = artists(axes, Quiver)
    np.testing.assert_allclose(np.column_stack([arrows.U, arrows.V]), 5 * wall.frames[-1].displacement)
    np.testing.assert_allclose(arrows.XY, wall.block_centroid)
    assert axes.get_title(loc="left").endswith("arrows × 5")


def test_history_of_measured_points(wall):
    axes = pictures.history(wall, units="m,s,N")
    curves = [line for line in axes.lines if len(line.get_xdata()) > 2]
    assert [line.get_label() for line in curves] == ["displacement x, point 1", "displacement y, point 1"]
    np.testing.assert_allclose(curves[1].get_ydata(), [0, -0.02, -0.04])
    assert axes.get_ylabel() == "displacement [m]"
    assert len(pictures.history(wall, "fixed_force").lines) == 2
    with pytest.raises(ValueError, match="no column 'speed'; the columns are: time, dt"):
        pictures.history(wall, "speed")
    with pytest.raises(ValueError, match="of different kinds"):
        pictures.history(wall, ["dt", "energy_kinetic"])


def test_profile_is_exact_for_affine_motion(wall):
    distance, values, owner = pictures.profile_data(wall, "displacement_x", (0, 0.25, 5, 3.25))
    assert list(owner[::2]) == list(owner[1::2])
    assert distance[-1] == pytest.approx(np.hypot(5, 3))
    y = 0.25 + distance / distance[-1] * 3
    np.testing.assert_allclose(values, 2 * y / 100, atol=1e-14)  # u = 2 y/100 in frame 2; rounding
    distance, values, owner = pictures.profile_data(wall, "stress_x", (-1, 1.5, 6, 1.5))
    np.testing.assert_array_equal(owner, np.repeat([5, 6, 7, 8, 9], 2))
    np.testing.assert_allclose(distance, [1, 2, 2, 3, 3, 4, 4, 5, 5, 6])
    np.testing.assert_allclose(values, np.repeat(-2 * (np.arange(5) + 0.5), 2))
    axes = pictures.profile(wall, "displacement_y", frames=(1, -1))
    assert [line.get_label() for line in axes.lines] == ["t = 0.1", "t = 0.2"]
    with pytest.raises(ValueError, match="meets no block"):
        pictures.profile(wall, line=(0, 9, 5, 9))


@pytest.mark.parametrize("field", ["displacement_x", "stress_x"])
def test_excavated_blocks_are_gaps_of_a_profile(tmp_path, field):
    """The line ran on at zero."""
    path = write_wall(tmp_path / "wall.h5", 5, 4)
    with h5py.File(path, "a") as file:
        there = np.ones((3, 20), dtype="i4")
        there[1:, [6, 7]] = 0  # x from 1 to 3 of the second row
        file.create_dataset("frames/active", data=there, maxshape=(None, 20))
    axes = pictures.profile(rockdda.open(path), field, (0, 1.5, 5, 1.5), frames=(0, -1))
    whole, dug = ((line.get_xdata(), line.get_ydata()) for line in axes.lines)
    assert not np.isnan(whole[1]).any()
    np.testing.assert_allclose(dug[0], [0, 1, np.nan, 3, 4, 4, 5])
    assert np.isnan(dug[1]).tolist() == [False, False, True, False, False, False, False]


@pytest.mark.parametrize("kind", ["joints", "contacts"])
def test_contacts_that_were_not_saved_are_not_drawn(tmp_path, kind):
    """The picture was empty, with a scale of its own."""
    path = write_wall(tmp_path / "wall.h5", 3, 2)
    with h5py.File(path, "a") as file:
        del file["input/config"]
        file["input/config"] = "&output contacts = .false. /"
    assert rockdda.open(path).has_contacts  # whatever the options say
    with h5py.File(path, "a") as file:
        file["frames/contact_offset"][:] = 0
    with pytest.raises(rockdda.InputError, match="there are no contacts in it: they were not saved"):
        rockdda.open(path).plot(kind=kind)
    with pytest.raises(rockdda.InputError, match="they were not saved"):
        rockdda.export.to_csv(rockdda.open(path), tmp_path / "a.csv", kind)


def test_colour_bars_of_flat_pictures_have_room_for_their_numbers(wall):
    """A strip 600 times as long as high: its numbers stood in one another, and in the label."""
    from rockdda.plot.block_maps import add_colour_bar
    from rockdda.plot.style import new_axes, size_of

    with style():
        figure, axes = new_axes(None, size_of(1060.0, 61.5))
        drawn = PolyCollection([[(0, 0), (1000, 0), (1000, 1.5), (0, 1.5)]], array=np.array([3.0]))
        axes.add_collection(drawn)
        axes.set(xlim=(-30, 1030), ylim=(-30, 31.5), aspect="equal")
        add_colour_bar(axes, drawn, Units(), "displacement", "length")
        figure.canvas.draw()
        bar = axes.child_axes[0].yaxis
        texts = sorted((t.get_window_extent() for t in bar.get_ticklabels() if t.get_text()), key=lambda box: box.y0)
        label = bar.label.get_window_extent()
    assert len(texts) > 1
    assert all(low.y1 <= high.y0 for low, high in itertools.pairwise(texts))
    assert all(text.x1 <= label.x0 for text in texts) and label.x1 <= figure.bbox.x1


def test_energy_ledger_shows_all_columns(wall):
    panels = pictures.energy(wall)
    names = {line.get_label().split(" (")[0].strip("|").replace(" ", "_") for panel in panels for line in panel.lines}
    assert set(wall.energy_names) <= names


@pytest.mark.parametrize("config", ["&output energy = .false. /", "&output energy=T /\n&OUTPUT Energy = F /"])
def test_energies_that_were_not_computed_are_not_drawn(tmp_path, config):
    path = write_wall(tmp_path / "wall.h5", 3, 2)
    with h5py.File(path, "a") as file:
        del file["input/config"]
        file["input/config"] = config
    assert rockdda.open(path).has_energies  # whatever the options say
    with h5py.File(path, "a") as file:
        file["history/energy"][:] = 0
    results = rockdda.open(path)
    assert not results.has_energies
    for draw in (pictures.energy, lambda results: pictures.history(results, "energy_kinetic")):
        with pytest.raises(rockdda.InputError, match="the energy balance was switched off"):
            draw(results)


def test_energies_of_a_model_at_rest_are_drawn(tmp_path):
    path = write_wall(tmp_path / "wall.h5", 3, 2)
    with h5py.File(path, "a") as file:
        file["history/energy"][:] = 0
    assert len(pictures.energy(rockdda.open(path))) == 2


def test_iterations(wall):
    panels = pictures.iterations(wall)
    np.testing.assert_array_equal(panels[1].lines[0].get_ydata(), wall["history/open_close_iterations"])
    assert len(panels[2].collections) == 3
    assert panels[0].get_ylim()[1] > 1.05 * wall["history/dt"].max()  # the line is not on the frame


@pytest.mark.usefixtures("native")
def test_iterations_of_a_solver_stand_clear_of_the_legend(tmp_path):
    results = rockdda.run(INPUTS / "flat_arch", solver="pcg", steps=3, output=tmp_path / "pcg.h5")
    panels = pictures.iterations(results)
    figure = panels[1].figure
    figure.canvas.draw()
    (beside,) = [axes for axes in figure.axes if axes not in panels]
    legend = panels[1].get_legend()
    assert [text.get_text() for text in legend.get_texts()][-1] == "solver iterations (right)"
    numbers = [text.get_window_extent() for text in beside.get_yticklabels()]
    assert max(box.x1 for box in numbers) < legend.get_window_extent().x0


def test_small_multiples_share_one_scale(wall, flat_arch):
    arch = rockdda.open(flat_arch)
    grid = pictures.small_multiples([wall, arch, wall], "stress_y", labels=["a", "b", "c"])
    scales = {artists(axes, PolyCollection)[0].get_clim() for axes in grid}
    assert len(scales) == 1
    low, high = scales.pop()
    assert low <= min(wall.field("stress_y").min(), arch.field("stress_y").min())
    assert high >= max(wall.field("stress_y").max(), arch.field("stress_y").max())
    assert [axes.get_title(loc="left") for axes in grid] == ["a", "b", "c"]
    with pytest.raises(ValueError, match="1 runs, but 2 labels"):
        pictures.small_multiples([wall], labels=["a", "b"])


def test_plot_draws_every_kind_of_a_real_run(flat_arch, tmp_path):
    results = rockdda.open(flat_arch)
    for kind in pictures.KINDS:
        if kind in ("ground-reaction", "water", "bolts", "liner", "capacity", "mechanism", "factor", "joint-profile"):
            continue  # of other runs: test_stage_pictures, _plot_water, _plot_bolts, _plot_liners, _critical, …
        axes = results.plot(kind=kind)
        for ending in ("pdf", "svg", "png") if kind == "blocks" else ("svg",):
            path = pictures.save(axes, tmp_path / f"{kind}.{ending}")
            assert path.stat().st_size > 1000
            if ending == "svg":
                assert "</svg>" in path.read_text()
    assert results.plot("stress_min") is not None  # the three lines of the README


def test_wrong_requests_name_what_there_is(wall):
    with pytest.raises(ValueError, match="no kind of picture 'pie'; the kinds are: blocks, contours, stress"):
        wall.plot(kind="pie")
    with pytest.raises(ValueError, match="there is no field 'colour'"):
        wall.plot("colour")
    with pytest.raises(rockdda.InputError, match="has no option 'scala'; it has: results, field"):
        wall.plot(scala=3)
    with pytest.raises(IndexError, match="has 3 frames"):
        wall.plot(frame=7)


def test_units():
    assert Units.parse("m,s,N") == Units("m", "s", "N")
    assert Units.parse("SI").text(2.5e5, "stress") == "250 kPa"
    assert Units.parse("mm,s,N").of("stress") == "MPa"
    assert Units().of("speed") == "length/time"


def test_a_hundred_thousand_blocks_are_drawn_in_time(tmp_path):
    results = rockdda.open(write_wall(tmp_path / "large.h5", 400, 250, frames=2))
    begin = time.process_time()
    pictures.save(results.plot("stress_y"), tmp_path / "large.png")
    # 1.7 s of processor time, 2.5 s on a busy machine, and a margin for slower ones
    assert time.process_time() - begin < 15


def test_interactive_mesh(wall):
    pyvista = pytest.importorskip("pyvista")
    from rockdda.plot.window import polygons_mesh

    mesh = polygons_mesh(wall)
    assert isinstance(mesh, pyvista.PolyData)
    assert mesh.n_cells == wall.n_blocks
    np.testing.assert_allclose(mesh.compute_cell_sizes()["Area"], 1, rtol=1e-3)  # the wall shears by 2 %


def test_interactive_mode_that_begins_with_the_first_figure_stays(wall):
    before = matplotlib.is_interactive()
    try:
        matplotlib.interactive(False)
        with style():
            matplotlib.interactive(True)  # as notebooks do when pyplot is first used
        assert matplotlib.is_interactive()
        wall.plot()
        assert matplotlib.is_interactive()
        assert matplotlib.rcParams["axes.labelsize"] == matplotlib.rcParamsDefault["axes.labelsize"]
    finally:
        matplotlib.interactive(before)


def test_unknown_fields_are_named_with_the_known_ones(wall):
    for draw in (wall.plot, wall.frames[-1].field, lambda field: pictures.profile(wall, field)):
        with pytest.raises(rockdda.InputError, match="there is no field 'strain'; the fields are: displacement, "):
            draw("strain")


@pytest.fixture(scope="module")
def splinter(tmp_path_factory):
    """10 × 10 squares that move a little, one of which has shrunk to a splinter that has fallen out of sight."""
    path = write_wall(tmp_path_factory.mktemp("splinter") / "wall.h5", 10, 10)
    with h5py.File(path, "a") as file:
        file["frames/centroid"][1:, :, 1] -= np.linspace(0, 0.1, 100)
        file["frames/centroid"][1:, 5, 1] -= 1e6
    return rockdda.open(path)


def test_one_splinter_does_not_take_the_colours_of_a_picture(splinter):
    """As in the viewer; a tip of the colour bar says that there are values beyond it."""
    axes = splinter.plot("displacement_y")
    (drawn,) = artists(axes, PolyCollection)
    low, high = drawn.get_clim()
    assert -1 < low < high < 1
    assert next(iter(axes.child_axes))._colorbar.extend == "both"
    (drawn,) = artists(splinter.plot("displacement_y", limits=(-1e6, 0)), PolyCollection)
    assert drawn.get_clim() == (-1e6, 0)
    several = pictures.small_multiples([splinter, splinter], "displacement_y")
    assert artists(several[0], PolyCollection)[0].get_clim()[0] > -1


def test_where_nothing_flies_the_scale_is_that_of_all_values(wall):
    """100 equal blocks: the outermost two are no splinters."""
    axes = wall.plot("stress_x")
    assert artists(axes, PolyCollection)[0].get_clim() == (-9.0, -1.0)
    assert next(iter(axes.child_axes))._colorbar.extend == "neither"


@pytest.mark.parametrize("kind", ["blocks", "stress", "contacts", "displacements"])
def test_a_window_is_what_a_map_shows(wall, kind, tmp_path):
    axes = wall.plot(kind=kind, window=(1, 0.5, 3, 2))
    assert (axes.get_xlim(), axes.get_ylim()) == ((1, 3), (0.5, 2))
    width, height = axes.get_figure().get_size_inches()
    assert 0.6 < (height - 0.75) / (width - 1.1) < 0.9  # the shape of the window
    outside = [
        artist for artist in axes.get_children()
        if not artist.get_clip_on() and artist.get_gid() != "scale"
        and artist.get_transform().contains_branch(axes.transData)
    ]  # fmt: skip
    assert outside == []
    assert pictures.save(axes, tmp_path / "a.png", 40).stat().st_size > 1000


@pytest.mark.parametrize("window", [(1, 0, 1, 2), (0, 2, 1, 1), (0, 0, np.nan, 1), (0, 0, np.inf, 1)])
def test_a_window_without_area_is_refused(wall, window):
    with pytest.raises(rockdda.InputError, match="expected x0,y0,x1,y1 with x0 < x1 and y0 < y1"):
        wall.plot(window=window)


def test_curves_have_no_window(wall):
    with pytest.raises(
        rockdda.InputError, match="a picture of kind 'history' has no window; these have: blocks, contours, stress"
    ):
        wall.plot(kind="history", window=(0, 0, 1, 1))


def test_a_window_of_several_runs(wall):
    for axes in pictures.small_multiples([wall, wall], window=(1, 0.5, 3, 2)):
        assert (axes.get_xlim(), axes.get_ylim()) == ((1, 3), (0.5, 2))


def test_a_window_of_the_input(native, tmp_path):
    for kind in ("lines", "blocks"):
        axes = pictures.input_plot(INPUTS / "jointed_slope/jointed_slope.dc", kind, window=(5, 0, 15, 10))
        assert (axes.get_xlim(), axes.get_ylim()) == ((5, 15), (0, 10))
