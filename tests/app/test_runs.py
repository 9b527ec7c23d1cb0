# SPDX-License-Identifier: MIT
"""What a run does with its options, where it writes, what its summary and its log say."""

import os
import re
import unittest

from results_case import ENERGY_COLUMNS, INPUTS, ResultsTest, read
from support import ANALYSIS, GEOMETRY, PEER_ANALYSIS, h5py

if h5py is not None:
    import numpy as np


class Steps(ResultsTest):
    """How long a run is and which steps become frames."""

    def frames(self, *arguments):
        data, _ = self.run_model("block.dc", "block.df", *arguments)
        return data["frames/step"].tolist(), data

    def test_steps_and_frames(self):
        self.assertEqual(self.frames("--steps", "7", "--save-every", "3")[0], [0, 3, 6, 7])
        self.assertEqual(self.frames("--steps", "6", "--save-every", "3")[0], [0, 3, 6])
        self.assertEqual(self.frames("--steps", "4", "--save-every", "50")[0], [0, 4])
        self.assertEqual(self.frames()[0], list(range(21)))

    def test_no_step(self):
        steps, data = self.frames("--steps", "0")
        self.assertEqual((steps, len(data["history/step"])), ([0], 0))

    def test_usual_number_of_frames(self):
        steps, _ = self.frames("--steps", "1000")
        self.assertEqual(steps, list(range(0, 1001, 10)))

    def test_frames_by_time(self):
        self.write("run.nml", "&run save_dt = 0.035 /\n")
        steps, data = self.frames("--config", "run.nml")
        self.assertEqual(data["history/attempts"].tolist(), [1] * 20)
        # the first step of 0.01 at or after each multiple of 0.035, and the last
        self.assertEqual(steps, [0, 4, 7, 11, 14, 18, 20])
        self.assertEqual(self.frames("--config", "run.nml", "--save-every", "10")[0], [0, 10, 20])

    def test_last_step_lands_on_the_end_time(self):
        data = self.frames("--t-end", "0.0537")[1]
        self.assertEqual(len(data["history/step"]), 6)
        self.assertAlmostEqual(data["history/time"][-1], 0.0537, delta=1e-15)
        self.assertAlmostEqual(data["history/dt"][-1], 0.0037, delta=1e-15)
        # an end time beyond the analysis file's steps extends the run; --steps limits it again
        self.assertAlmostEqual(self.frames("--t-end", "0.3")[1]["history/time"][-1], 0.3, delta=1e-14)
        self.assertEqual(len(self.frames("--t-end", "0.3", "--steps", "4")[1]["history/step"]), 4)

    def test_without_frames_or_contacts(self):
        self.write("run.nml", "&output frames = .false. /\n")
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "run.nml", "--json", "-o", "a.h5")
        data, _ = read(self.path("a.h5"))
        self.assertEqual((len(data["frames/step"]), data["frames/contact_offset"].tolist()), (0, [0]))
        self.assertEqual(outcome.json["frames"], 0)
        self.assertEqual(len(data["history/step"]), 20)
        self.write("run.nml", "&output contacts = .false. /\n")
        steps, data = self.frames("--config", "run.nml")
        self.assertEqual((len(steps), data["frames/contact_offset"].tolist()), (21, [0] * 22))
        self.assertEqual(data["frames/contact_force"].shape, (0, 2))


class Options(ResultsTest):
    def test_solvers_agree(self):
        expected, _ = self.run_model(INPUTS / "stack", "--solver", "dense", "--steps", "20")
        moved = np.abs(expected["frames/vertices"] - expected["model/vertices"]).max()
        for solver in ("auto", "pcg", "cholmod", "sor"):
            if solver == "cholmod" and "with_cholmod=on" not in self.run_program("--version").out.lower():
                continue
            with self.subTest(solver=solver):
                data, _ = self.run_model(INPUTS / "stack", "--solver", solver, "--steps", "20")
                # 20 steps with residuals of 1e-10 of the load; a factor of 5 for what the equations make of them
                error = np.abs(data["frames/vertices"] - expected["frames/vertices"]).max()
                self.assertLess(error, 1e-8 * moved)

    def test_threads_do_not_change_a_bit(self):
        for model, solver, steps in (
            ("jointed_slope", "auto", 5),
            ("jointed_slope", "pcg", 5),
            ("bolted_beam", "sor", 20),
        ):
            with self.subTest(model=model, solver=solver):
                arguments = (INPUTS / model, "--solver", solver, "--steps", str(steps), "--save-every", "1")
                one, _ = self.run_model(*arguments, "--threads", "1")
                two, _ = self.run_model(*arguments, "--threads", "2")
                self.assertSameData(one, two)

    def test_block_file_gives_the_same(self):
        self.assertEqual(self.run_program("cut", "block.dc").code, 0)
        one, _ = self.run_model("block.dc", "block.df")
        two, _ = self.run_model("block.blk", "block.df")
        self.assertSameData(one, two, but=["input/geometry"])
        self.assertEqual(two["input/geometry"].decode(), self.path("block.blk").read_text())

    def test_input_texts_are_kept(self):
        text = GEOMETRY.replace("# e0", "# plus petit écart, supérieur à 0\t").replace("\n", "\r\n")
        self.write("block.dc", text)
        self.write("run.nml", "! nothing\n&run steps = 2 /")
        data, _ = self.run_model("block.dc", "block.df", "--config", "run.nml")
        for name, file in (("geometry", "block.dc"), ("analysis", "block.df"), ("config", "run.nml")):
            self.assertEqual(data["input/" + name], self.path(file).read_bytes())
        data, _ = self.run_model("block.dc", "block.df")
        self.assertEqual(data["input/config"], b"")

    def test_config_overrides_files_and_is_overridden(self):
        self.write("run.nml", "&run steps = 5, title = 'Versuch 1' / &time dt_max = 0.004 / &solver method = 'pcg' /\n")
        data, attributes = self.run_model("block.dc", "block.df", "--config", "run.nml")
        self.assertEqual(data["history/dt"].tolist(), [0.004] * 5)
        self.assertEqual(attributes["/"]["title"], "Versuch 1")
        log = self.path("out.log").read_text()
        self.assertIn("number of steps 5 replaces 20 of the analysis file", log)
        self.assertRegex(log, r"solver += pcg\n")
        outcome = self.run_program(
            "run", "block.dc", "block.df", "--config=run.nml", "--steps=3", "--solver=dense", "--json"
        )
        self.assertEqual((outcome.json["steps"], outcome.json["solver"]), (3, "dense"))

    def test_the_log_names_every_value_of_the_files_that_an_option_replaces(self):
        self.write(
            "run.nml",
            "&run t_end = 0.02 / &time k01 = 0.9, displacement_ratio = 0.02 / &contact stiffness = 2e8 /\n"
            "&solver omega = 1.2 / &load gravity = 9 /\n",
        )
        self.run_model("block.dc", "block.df", "--config", "run.nml")
        log = self.path("out.log").read_text()
        replaced = re.findall(r"^note: (.*) replaces (.*) of the analysis file$", log, re.M)
        self.assertEqual(
            replaced,
            [
                ("end time 0.02", "the number of steps 20"),
                ("k01 0.9", "1"),
                ("displacement ratio (g2) 0.02", "0.01"),
                ("contact stiffness (g0) 2e+08", "1e+08"),
                ("SOR factor 1.2", "1.4"),
                ("gravity 9", "weight over density"),
            ],
        )

    def test_output_of_the_namelist(self):
        self.write("run.nml", "&output file = 'sub/named.h5' /\n")
        self.path("sub").mkdir()
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--config", "run.nml").code, 0)
        named = ["sub/named.ckpt.h5", "sub/named.h5", "sub/named.log"]
        self.assertEqual(self.files(), ["block.dc", "block.df", "run.nml", *named])

    def test_peer_dialect(self):
        self.write("block.df", PEER_ANALYSIS)
        outcome = self.run_program("run", "block.dc", "block.df", "--dialect", "peer", "--quiet")
        self.assertEqual((outcome.code, outcome.err), (0, ""))
        for word in ("peer", "dda_windows"):
            described = self.run_program("info", "block.df", "--dialect", word, "--json").json["files"][0]
            self.assertEqual(described["dialect"], "dda_windows")
        self.write("block.df", ANALYSIS)
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--dialect", "peer", "-o", "x.h5").code, 2)
        self.assertFalse(self.path("x.h5").exists())


class Output(ResultsTest):
    """Where results go, and what is never overwritten."""

    def test_default_name_in_the_current_folder(self):
        self.path("work").mkdir()
        self.write("case.df", ANALYSIS)
        outcome = self.run_program("run", "../block.dc", "../case.df", cwd=self.path("work"))
        self.assertEqual(outcome.code, 0)
        self.assertEqual(
            self.files(), ["block.dc", "block.df", "case.df", "work/case.ckpt.h5", "work/case.h5", "work/case.log"]
        )

    def test_folder(self):
        self.write("model/m.dc", GEOMETRY)
        self.write("model/m.df", ANALYSIS)
        self.write("model/m.nml", "&run steps = 3 /\n")
        outcome = self.run_program("run", "model", "--json")
        self.assertEqual((outcome.code, outcome.json["steps"], outcome.json["output"]), (0, 3, "m.h5"))
        self.assertEqual(self.files()[-3:], ["model/m.dc", "model/m.df", "model/m.nml"])
        self.assertTrue(self.path("m.h5").exists())

    def test_existing_output(self):
        self.write("block.h5", "mine")
        self.write("block.log", "mine too")
        outcome = self.run_program("run", "block.dc", "block.df")
        self.assertFails(outcome, 2, "rockdda: error: block.h5: the file exists; use --force to overwrite it")
        self.assertEqual(self.path("block.h5").read_text() + self.path("block.log").read_text(), "minemine too")
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--force").code, 0)
        self.assertEqual(read(self.path("block.h5"))[1]["/"]["complete"], 1)

    def test_results_of_another_ending_keep_their_checkpoint(self):
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "-o", "a.h5").code, 0)
        before = {name: self.path(name).read_bytes() for name in self.files()}
        for name in ("a.hdf5", "a"):
            outcome = self.run_program("run", "block.dc", "block.df", "-o", name, "--force", "--quiet")
            message = (
                f"{name}: these results would have the checkpoint a.ckpt.h5, which is that of a.h5; take another name"
            )
            self.assertFails(outcome, 2, f"rockdda: error: {message}")
        self.assertEqual({name: self.path(name).read_bytes() for name in self.files()}, before)
        # without those results it is nobody's
        self.path("a.h5").unlink()
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "-o", "a.hdf5").code, 0)
        self.assertEqual(self.run_program("resume", "a.ckpt.h5", "--steps", "2").code, 0)

    def test_bad_input_keeps_the_old_output_even_with_force(self):
        self.write("block.h5", "mine")
        self.write("block.df", ANALYSIS.replace("30 0 0\n", "30 0 -1\n"))
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "--force").code, 2)
        self.assertEqual(self.path("block.h5").read_text(), "mine")

    def test_input_is_never_the_output(self):
        for name in ("block.dc", "./block.df"):
            outcome = self.run_program("run", "block.dc", "block.df", "-o", name, "--force")
            self.assertFails(outcome, 2, f"rockdda: error: {name}: the output would overwrite an input file")
        self.assertEqual(self.path("block.dc").read_text() + self.path("block.df").read_text(), GEOMETRY + ANALYSIS)

    def test_devices_and_pipes_are_no_outputs(self):
        os.mkfifo(self.path("pipe.h5"))
        for force in ([], ["--force"]):
            outcome = self.run_program("run", "block.dc", "block.df", "-o", "pipe.h5", *force)
            message = "pipe.h5: this is no regular file: results cannot be written to it"
            self.assertFails(outcome, 2, "rockdda: error: " + message)
            self.assertTrue(self.path("pipe.h5").is_fifo())
            self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_output_that_cannot_be_created(self):
        outcome = self.run_program("run", "block.dc", "block.df", "-o", "none/x.h5")
        self.assertEqual(outcome.code, 5)
        self.assertIn("none/x.h5: the folder 'none' does not exist", outcome.err)

    def test_locale_and_time_zone_change_nothing(self):
        one, _ = self.run_model("block.dc", "block.df")
        environment = {**os.environ, "LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8", "TZ": "Asia/Tokyo"}
        self.assertEqual(self.run_program("run", "block.dc", "block.df", "-o", "b.h5", env=environment).code, 0)
        self.assertSameData(one, read(self.path("b.h5"))[0])


class Report(ResultsTest):
    """The summary and the log."""

    def test_json(self):
        outcome = self.run_program("run", "block.dc", "block.df", "--json", "--save-every", "6")
        self.assertEqual(outcome.code, 0)
        summary = outcome.json
        data, _ = read(self.path("block.h5"))
        figures = {
            key: summary[key] for key in ("command", "status", "exit_code", "exit_reason", "output", "log", "blocks")
        }
        self.assertEqual(
            figures,
            {
                "command": "run",
                "status": "done",
                "exit_code": 0,
                "exit_reason": "finished",
                "output": "block.h5",
                "log": "block.log",
                "blocks": 2,
            },
        )
        self.assertEqual(summary["steps"], data["history/step"][-1])
        self.assertEqual(summary["time"], data["history/time"][-1])
        self.assertEqual(summary["frames"], len(data["frames/step"]))
        contacts = [summary["contacts"][k] for k in ("open", "sliding", "locked")]
        self.assertEqual(contacts, data["history/contacts"][-1].tolist())
        self.assertEqual(list(summary["energy"]), ENERGY_COLUMNS)
        self.assertEqual(list(summary["energy"].values()), data["history/energy"][-1].tolist())
        self.assertEqual(summary["errors"], 0)

    def test_text(self):
        outcome = self.run_program("run", "block.dc", "block.df", "--steps", "4", "--quiet")
        self.assertEqual(outcome.err, "")
        lines = outcome.out.splitlines()
        self.assertTrue(lines[0].startswith("done: 4 steps to time 0.04, 2 blocks, contacts "), lines)
        self.assertEqual(lines[1:], ["results: block.h5 (5 frames), log: block.log"])

    def logged(self):
        lines = self.path("out.log").read_text().splitlines()
        self.assertTrue(lines[-1].startswith("end: finished after "))
        head = [line.startswith("#") for line in lines].index(True)
        return [line.split() for line in lines[head + 1 : -1] if not line.startswith("#")]  # notes

    def test_log_has_a_line_for_each_reported_step(self):
        data, _ = self.run_model("block.dc", "block.df")
        rows = self.logged()
        self.assertEqual([int(row[0]) for row in rows], data["history/step"].tolist())
        energies = np.array([[float(x) for x in row[-10:]] for row in rows])
        # printed with 14 digits
        scale = np.abs(data["history/energy"]).max()
        self.assertLess(np.abs(energies - data["history/energy"]).max(), 1e-13 * scale)
        self.assertTrue(np.allclose([float(row[1]) for row in rows], data["history/time"], rtol=1e-6, atol=0))

    def test_log_of_a_long_run_reports_some_steps(self):
        data, _ = self.run_model("block.dc", "block.df", "--steps", "2503", "--save-every", "501")
        again = data["history/step"][data["history/attempts"] > 1].tolist()
        steps = {1, 2503, *range(0, 2504, 2), *range(0, 2504, 501), *again} - {0}
        self.assertEqual([int(row[0]) for row in self.logged()], sorted(steps))

    def test_no_terminal_codes_in_a_pipe(self):
        outcome = self.run_program("run", "block.dc", "block.df")
        self.assertEqual(outcome.code, 0)
        self.assertNotRegex(outcome.err, r"[\r\x1b]")


if __name__ == "__main__":
    unittest.main()
