# SPDX-License-Identifier: MIT
"""Help, version, and mistakes on the command line."""

import json
import os
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from support import PROGRAM, ProgramTest

COMMANDS = ["cut", "run", "check", "info"]


class Help(ProgramTest):
    def test_program_help_names_commands_and_exit_codes(self):
        for arguments in (["--help"], ["-h"], ["help"]):
            outcome = self.run_program(*arguments)
            self.assertEqual(outcome.code, 0)
            self.assertEqual(outcome.err, "")
            for command in COMMANDS:
                self.assertIn(f"\n  {command} ", outcome.out)
            self.assertIn("exit codes:", outcome.out)
            self.assertLessEqual(max(map(len, outcome.out.splitlines())), 110)

    def test_each_command_has_help_with_examples(self):
        for command in COMMANDS:
            outcome = self.run_program(command, "--help")
            self.assertEqual(outcome.code, 0)
            self.assertTrue(outcome.out.startswith(f"usage: rockdda {command}"))
            self.assertIn(f"examples:\n  rockdda {command} ", outcome.out)

    def test_version(self):
        outcome = self.run_program("--version")
        self.assertEqual(outcome.code, 0)
        self.assertRegex(outcome.out, r"^rockdda \d+\.\d+\.\d+\n")
        for word in ("compiler:", "options:", "HDF5"):
            self.assertIn(word, outcome.out)
        data = self.run_program("--version", "--json").json
        self.assertRegex(data["version"], r"^\d+\.\d+\.\d+$")


class Mistakes(ProgramTest):
    def check(self, arguments, *messages):
        outcome = self.run_program(*arguments)
        self.assertFails(outcome, 2, *["rockdda: error: " + m for m in messages])
        self.assertEqual(outcome.out, "")
        self.assertEqual(self.files(), ["block.dc", "block.df"])

    def test_nothing(self):
        outcome = self.run_program()
        self.assertEqual(outcome.code, 2)
        self.assertTrue(outcome.err.endswith("\nrockdda: error: no command given\n"))
        self.assertIn("usage: rockdda COMMAND", outcome.err)
        summary = self.run_program("--json").json
        self.assertEqual((summary["status"], summary["exit_code"]), ("error", 2))

    def test_results_instead_of_a_model(self):
        """The command that was meant is named."""
        outcome = self.run_program("run", "block.dc", "block.df", "-o", "out.h5", "--steps", "1")
        self.assertEqual(outcome.code, 0)
        self.assertRegex(outcome.out, r"^done: 1 step to time .*, 2 blocks, contacts ")
        for name, text in (
            ("out.ckpt.h5", "found a checkpoint file; 'rockdda resume out.ckpt.h5' continues its run"),
            ("out.h5", "found an HDF5 file, such as the results of a run ('rockdda info' describes it, 'rockdda-post' "
             "draws results); 'rockdda resume out.ckpt.h5' continues its run"),
        ):  # fmt: skip
            for command in ("run", "fos"):
                outcome = self.run_program(command, name)
                self.assertEqual(outcome.code, 2)
                self.assertRegex(
                    outcome.err, rf"^{re.escape(name)}: error: expected a labelled file .*, {re.escape(text)}\n$"
                )
        self.path("out.ckpt.h5").unlink()
        self.assertNotIn("resume", self.run_program("run", "out.h5").err)

    def test_notes_are_no_noise_before_an_error_of_the_output(self):
        self.write("out.h5", "mine")
        text = (
            "&model geometry = 'block.dc' /\n&block_material number = 1, density = 2500, young = 1e9, poisson = 0.2 /\n"
            "&joint_material number = 1, friction = 30 /\n&run steps = 1 /\n"
            "&load gravity = 9.81 /\n&boundary along = 0,0, 4,0, kind = 'fixed' /\n"
        )
        self.write("a.nml", text)
        self.assertIn("note: ", self.run_program("check", "a.nml").err)
        outcome = self.run_program("run", "a.nml", "-o", "out.h5")
        self.assertFails(outcome, 2, "rockdda: error: out.h5: the file exists; use --force to overwrite it")
        # beside errors of the input they help
        self.write("a.nml", text + "&boundary along = 7,7, 8,8, kind = 'fixed' /\n")
        self.assertIn("note: ", self.run_program("run", "a.nml").err)

    def test_what_the_geometry_file_holds_is_no_group(self):
        self.write("a.nml", "&hole at = 0,0 /\n&boundarry kind = 'fixed' /\n")
        outcome = self.run_program("check", "a.nml")
        self.assertIn(
            "a.nml:1:1: error: unknown group &hole; lines and points stand in the geometry file\n", outcome.err
        )
        self.assertIn("unknown group &boundarry; did you mean '&boundary'?", outcome.err)

    def test_few_of_many_files_of_a_folder_are_named(self):
        folder = self.path("many")
        folder.mkdir()
        for k in range(9):
            (folder / f"m{k}.nml").write_text("&model geometry = 'a.dc' /\n")
        self.assertFails(
            self.run_program("run", "many"),
            2,
            "many: error: a model folder must hold at most one labelled file (.nml with &model); found 9 labelled "
            "files (m0.nml, m1.nml, m2.nml, m3.nml, m4.nml and 4 more): name the one to take",
        )

    def test_unknown_command(self):
        self.check(["rnu", "x"], "unknown command 'rnu'; did you mean 'run'?")
        self.check(["explode"], "unknown command 'explode'")

    def test_unknown_option(self):
        self.check(["run", "--stpes", "4", "a"], "unknown option --stpes; did you mean '--steps'?")
        self.check(["run", "--zzzzzzzz=4", "a"], "unknown option --zzzzzzzz")

    def test_several_mistakes_are_all_reported(self):
        self.check(
            ["run", "--steps", "4.5", "--t-end=soon", "--threads", "0", "--frce"],
            "option --steps: expected a whole number, found '4.5'",
            "option --t-end: expected a number, found 'soon'",
            "option --threads: must be 1 or more, found 0",
            "unknown option --frce; did you mean '--force'?",
        )

    def test_missing_and_superfluous_values(self):
        self.check(["run", "a", "b", "--steps"], "option --steps needs a value")
        self.check(["run", "a", "b", "-o", "--quiet"], "option --output needs a value")
        self.check(["run", "a", "b", "--force=yes"], "option --force takes no value")
        self.check(["run", "a", "b", "--output="], "option --output: expected a file name, found nothing")

    def test_option_of_another_command(self):
        self.check(["cut", "block.dc", "--steps", "3"], "option --steps does not belong to 'rockdda cut'")
        self.check(["info", "block.dc", "-o", "x"], "option --output does not belong to 'rockdda info'")

    def test_unknown_dialect(self):
        self.check(["check", "block.df", "--dialect", "shi"], "option --dialect: 'shi' is neither dda_windows nor g0")

    def test_number_of_files(self):
        self.check(["cut"], "'rockdda cut' needs one geometry file, found 0; see 'rockdda cut --help'")
        self.check(
            ["run", "block.dc"],
            "'rockdda run' needs a geometry or block file and an analysis file, one labelled file, or one folder with "
            "them; "
            "found 1 file, see 'rockdda run --help'",
        )
        self.assertFails(self.run_program("run", "nowhere"), 2, "nowhere: error: no such file")
        self.check(["check"], "'rockdda check' needs at least one file; see 'rockdda check --help'")
        self.check(["info"], "'rockdda info' needs at least one file; see 'rockdda info --help'")

    def test_unknown_solver(self):
        self.check(
            ["run", "block.dc", "block.df", "--solver", "magic"],
            "unknown solver 'magic', expected one of auto, cholmod, pcg, sor, dense",
        )

    def test_json_tells_of_mistakes_too(self):
        outcome = self.run_program("run", "--stpes", "--json")
        self.assertEqual(outcome.code, 2)
        self.assertEqual(outcome.json["exit_code"], 2)
        self.assertEqual(outcome.json["status"], "error")
        self.assertIn("--stpes", outcome.json["messages"][0]["message"])


class Completion(ProgramTest):
    def complete(self, *words):
        """What bash proposes for the last of these words."""
        script = (
            'eval "$("$PROGRAM" completion bash)"; complete -p rockdda >/dev/null || exit 1\n'
            'COMP_WORDS=(rockdda "$@") COMP_CWORD=$#\n_rockdda\nprintf "%s\\n" "${COMPREPLY[@]}"'
        )
        process = subprocess.run(
            ["bash", "-c", script, "bash", *words],
            cwd=self.folder,
            capture_output=True,
            text=True,
            env={**os.environ, "PROGRAM": PROGRAM},
            timeout=60,
        )
        self.assertEqual((process.returncode, process.stderr), (0, ""))
        return process.stdout.split("\n")[:-1]

    def test_commands_options_values_and_files(self):
        self.write("two words.dc", "")
        self.assertEqual(self.complete("re"), ["resume"])
        self.assertEqual(self.complete("compl"), ["completion"])
        self.assertEqual(self.complete("completion", ""), ["bash", "zsh", "fish"])
        self.assertEqual(self.complete("new", "t"), ["tunnel"])
        self.assertEqual(self.complete("help", "joint_m"), ["joint_material"])
        self.assertEqual(self.complete("help", "fos"), ["fos"])
        self.assertEqual(self.complete("cut", "--d"), ["--dialect"])
        self.assertEqual(self.complete("cut", "--st"), [""])
        self.assertEqual(self.complete("run", "--st"), ["--steps", "--strict"])
        self.assertEqual(self.complete("run", "--solver", "ch"), ["cholmod"])
        self.assertEqual(self.complete("check", "two"), ["two words.dc"])
        self.assertEqual(self.complete("run", "-o", "block.dc"), ["block.dc"])

    def test_every_option_that_help_names_is_proposed(self):
        for command in COMMANDS:
            named = set(re.findall(r"--[a-z-]+(?= )", self.run_program(command, "--help").out)) - {"--version"}
            self.assertLessEqual(named, set(self.complete(command, "--")), command)

    def in_shell(self, shell, script):
        if not shutil.which(shell):
            self.skipTest(f"there is no {shell} here")
        environment = {**os.environ, "PROGRAM": PROGRAM, "HOME": str(self.folder)}
        process = subprocess.run(
            [shell, "-c", script], cwd=self.folder, capture_output=True, text=True, env=environment, timeout=60
        )
        self.assertEqual((process.returncode, process.stderr), (0, ""))
        return [line.split("\t")[0] for line in process.stdout.splitlines()]

    def test_fish_completes_commands_options_values_and_files(self):
        self.write("two words.dc", "")
        for words, expected in (
            ("res", ["resume"]),
            ("help joint_m", ["joint_material"]),
            ("new t", ["tunnel"]),
            ("run --st", ["--steps", "--strict"]),
            ("cut --st", []),
            ("run --solver ch", ["cholmod"]),
            ("check two", ["two words.dc"]),
            ("run -o tw", ["two words.dc"]),
        ):
            script = f'"$PROGRAM" completion fish | source; complete -C "rockdda {words}"'
            self.assertEqual([found.replace("\\ ", " ") for found in self.in_shell("fish", script)], expected, words)

    def test_zsh_takes_the_script(self):
        self.assertEqual(
            self.in_shell("zsh", 'eval "$("$PROGRAM" completion zsh)"; whence -w _rockdda'), ["_rockdda: function"]
        )

    def test_the_former_option_gives_the_same_script(self):
        for shell in ("bash", "zsh", "fish"):
            scripts = {self.run_program(*words, shell).out for words in (["completion"], ["--completion"])}
            self.assertEqual(len(scripts), 1)

    def test_mistakes(self):
        outcome = self.run_program("completion", "fihs")
        self.assertFails(
            outcome, 2, "rockdda: error: completion: 'fihs' is none of bash, zsh, fish; did you mean 'fish'?"
        )
        self.assertFails(
            self.run_program("completion"), 2, "rockdda: error: 'rockdda completion' needs a shell: bash, zsh or fish"
        )
        for words in (["help", "completion"], ["completion", "--help"]):
            outcome = self.run_program(*words)
            self.assertEqual((outcome.code, outcome.out.split("\n")[0]), (0, "usage: rockdda completion bash|zsh|fish"))


class Escapes(ProgramTest):
    """Control characters of the input are shown, never sent to the terminal."""

    NASTY = "\x1b]0;owned\x07\x1b[2J\x9b1m\x7f"

    def assertHarmless(self, text):
        self.assertNotRegex(text, "[\x00-\x08\x0b-\x1f\x7f-\x9f]")

    def test_file_names_words_and_source_lines(self):
        name = self.NASTY.replace("/", "") + ".dc"
        self.write(name, f"0.01 {self.NASTY} 1\n")
        for command in ("check", "info", "cut"):
            outcome = self.run_program(command, name)
            self.assertHarmless(outcome.out + outcome.err)
            self.assertIn("\\x1b[2J\\x9b1m\\x7f", outcome.out + outcome.err)
        outcome = self.run_program("check", name, "--json")
        self.assertHarmless(outcome.out + outcome.err)
        self.assertEqual(outcome.json["files"][0]["file"], name)

    def test_arguments(self):
        outcome = self.run_program("run", "--" + self.NASTY)
        self.assertHarmless(outcome.err)
        self.assertIn("unknown option --\\x1b]0;owned\\x07", outcome.err)

    def test_title_and_name_of_results(self):
        self.write("run.nml", f"&run title = '{self.NASTY}', steps = 1 /\n")
        outcome = self.run_program("run", "block.dc", "block.df", "--config", "run.nml", "-o", self.NASTY + ".h5")
        self.assertEqual(outcome.code, 0)
        self.assertHarmless(outcome.out + outcome.err + self.path(self.NASTY + ".log").read_text())
        outcome = self.run_program("info", self.NASTY + ".h5")
        self.assertHarmless(outcome.out + outcome.err)

    def test_mark_stands_under_its_word(self):
        self.write("x.nml", "&run title = '\x1b[1m', stpes = 1 /\n")
        lines = self.run_program("check", "x.nml", "--quiet").err.splitlines()
        self.assertEqual(lines[2].index("^"), lines[1].index("stpes"))


class Json(ProgramTest):
    def test_odd_file_names_are_escaped(self):
        for name in ['qu"ote\\.dc', "tab\there.dc", "grüße.dc", "newline\n.dc"]:
            self.write(name, self.path("block.dc").read_bytes())
            data = self.run_program("info", name, "--json").json
            self.assertEqual(data["files"][0]["file"], name)

    def test_bytes_that_are_not_utf8_still_give_valid_json(self):
        name = os.fsdecode(b"latin\xe9.dc")
        try:
            self.write(name, "")
        except OSError:
            self.skipTest("this file system takes no such names")
        outcome = self.run_program("info", name, "--json")
        data = json.loads(outcome.out.encode("utf-8", "surrogateescape").decode("utf-8", "strict"))
        self.assertEqual(data["files"][0]["file"], "latin\ufffd.dc")

    def test_full_standard_output_is_an_output_error(self):
        if not Path("/dev/full").exists():
            self.skipTest("no /dev/full")
        with Path("/dev/full").open("wb") as full:
            self.assertEqual(self.run_program("--help", stdout=full).code, 5)
            self.assertEqual(self.run_program("info", "block.dc", stdout=full).code, 5)


if __name__ == "__main__":
    unittest.main()
