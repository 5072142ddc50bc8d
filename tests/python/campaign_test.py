"""Campaigns: the same bytes come of the same tasks, whoever did them, in whichever order, and whatever was lost.

    python -m unittest campaign_test, with BERTH set to the command and berth_tools on PYTHONPATH
"""

import contextlib
import io
import os
import pathlib
import shlex
import signal
import stat
import sys
import tempfile
import threading
import time
import unittest

from berth_tools import campaign
from berth_tools.campaign import __main__ as command
from berth_tools.campaign.run import local_client, store
from berth_tools.campaign.tasks import berth_version, pose_errors, with_seed

BERTH = os.environ["BERTH"]
SCENARIO = """seed = 7
[camera]
width = 160
height = 120
[trajectory]
kind = "approach"
frames = 3
from_range_m = 0.6
to_range_m = 0.4
to_offset_m = [0.0, 0.0]
[[marker]]
family = "tag36h11"
id = 3
size_m = 0.1
position_m = [0, 0, 0]
"""
SMALL = ["--only", "still", "--frames", "2", "--fineness", "1"]


def bytes_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


class Campaign(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = pathlib.Path(scratch.name)

    def run_command(self, *arguments):
        """Exit code, standard output and error of the module's command, without Dask."""
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = command.main([str(one) for one in arguments])
        return code, out.getvalue(), err.getvalue()

    def counted_berth(self, before=""):
        """The command, whose work is counted in a file; and how often it was asked for. `before`: shell, run at first."""
        path, calls = self.folder / "counted_berth", self.folder / "calls"
        path.write_text(f'#!/bin/sh\n[ "$1" = --version ] || {{ echo "$*" >>{calls}\n{before}\n}}\nexec {BERTH} "$@"\n')
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return str(path), lambda: len(calls.read_text().splitlines())

    def test_a_worker_that_is_killed_changes_nothing(self):
        tasks = campaign.accuracy_tasks([1, 2, 3], SMALL, berth_version(BERTH))
        alone, spread, victim = self.folder / "alone", self.folder / "spread", self.folder / "victim"
        self.assertEqual(campaign.run_tasks(list(reversed(tasks)), alone, BERTH), [])
        campaign.summarize(tasks, alone)
        # The second task to begin names its worker and waits to be killed with it.
        berth, calls = self.counted_berth(
            f'[ "$(wc -l <{self.folder}/calls)" -lt 2 ] || ! mkdir {victim}.taken || '
            f'{{ echo $PPID >{victim}.part; mv {victim}.part {victim}; while kill -0 $PPID; do sleep 0.05; done; exit 1; }}')

        def kill():
            while not victim.exists():
                time.sleep(0.02)
            os.kill(int(victim.read_text()), signal.SIGKILL)

        threading.Thread(target=kill, daemon=True).start()
        with local_client(2) as client:
            self.assertEqual(campaign.run_tasks(tasks, spread, berth, client), [])
        self.assertTrue(victim.exists())
        self.assertGreater(calls(), len(tasks), "nothing was lost with the worker")
        campaign.summarize(tasks, spread)
        self.assertEqual(bytes_of(spread), bytes_of(alone))

    def test_goes_on_where_it_ended(self):
        counted, calls = self.counted_berth()
        tasks = campaign.accuracy_tasks([1, 2], SMALL, berth_version(BERTH))
        self.assertEqual(campaign.run_tasks(tasks[:1], self.folder, counted), [])
        (self.folder / ".part-x").mkdir()  # of one that was ended by force
        said = []
        self.assertEqual(campaign.run_tasks(tasks, self.folder, counted, write=said.append), [])
        self.assertEqual(calls(), 2)
        self.assertEqual(said[0], "1 of 2 tasks are there already\n")
        self.assertRegex(said[-1], r"^2 of 2 tasks \(100 %\), 0 s left\n$")
        self.assertFalse((self.folder / ".part-x").exists())
        # Another specification's result does not count.
        other = campaign.accuracy_tasks([1], [*SMALL, "--noise", "3"], berth_version(BERTH))
        self.assertFalse(campaign.is_done(self.folder, other[0]))
        before = bytes_of(self.folder / "results" / "accuracy-000001")
        self.assertEqual(campaign.run_tasks(other, self.folder, counted), [])
        self.assertNotEqual(bytes_of(self.folder / "results" / "accuracy-000001"), before)
        self.assertEqual(calls(), 3)

    def test_tells_what_failed_and_keeps_the_rest(self):
        code, _, err = self.run_command("accuracy", self.folder / "out", "--berth", BERTH, "--workers", 0, "--seeds", "1,3",
                                        "--", *SMALL, "--noise", "-1")
        self.assertEqual(code, 1)
        self.assertIn("accuracy-000003: ", err)
        self.assertIn("--noise", err)
        self.assertIn("2 of 2 tasks failed; the same call again", err)
        version = berth_version(BERTH)
        good, bad = campaign.accuracy_tasks([1], SMALL, version)[0], campaign.accuracy_tasks([2], SMALL, "berth 0")[0]
        failures = campaign.run_tasks([bad, good], self.folder / "both", BERTH)
        self.assertEqual([failure.task for failure in failures], [bad])
        self.assertIn("install the same everywhere", failures[0].why)
        self.assertTrue(campaign.is_done(self.folder / "both", good))

    def test_renders_and_evaluates(self):
        scenario = self.folder / "near.toml"
        scenario.write_text(SCENARIO)
        code, out, err = self.run_command("render", self.folder / "set", "--berth", BERTH, "--workers", 0, "--seeds", "1-2",
                                          "--frames", 2, scenario)
        self.assertEqual(code, 0, err)
        rows = [line.split() for line in out.splitlines()]
        self.assertEqual([row[:4] for row in rows[1:]], [["near", "1", "2", "2"], ["near", "2", "2", "2"]])
        self.assertNotEqual(rows[1][4], rows[2][4], "seeds make no difference")
        image = (self.folder / "set/results/render-near-000001/000000.pgm").read_bytes()
        self.assertTrue(image.startswith(b"P5\n160 120\n255\n"))
        self.assertEqual(len(image), len(b"P5\n160 120\n255\n") + 160 * 120)
        again = campaign.perform(campaign.render_tasks([str(scenario)], [1], 2, berth_version(BERTH))[0], BERTH)
        self.assertEqual(again["000000.pgm"], image)

        recording = self.folder / "near.mcap"
        os.system(f"{BERTH} run --source sim:{scenario} --backend simd --record {recording} >{self.folder}/log")
        code, out, err = self.run_command("evaluate", self.folder / "eval", "--berth", BERTH, "--workers", 0, recording)
        self.assertEqual(code, 0, err)
        names, values = (line.split() for line in out.splitlines())
        row = dict(zip(names, values))
        self.assertEqual([row[name] for name in ("recording", "frames", "shown", "found", "not_there")],
                         ["near.mcap", "3", "3", "3", "0"])
        self.assertGreater(float(row["rms_mm"]), 0)
        self.assertLess(float(row["max_mm"]), 5)

    def test_says_what_is_wrong(self):
        def complaint(*arguments):
            code, _, err = self.run_command(*arguments)
            self.assertEqual(code, 2)
            return err

        out = self.folder / "out"
        self.assertIn("no/such/berth: it does not run", complaint("accuracy", out, "--berth", "no/such/berth", "--seeds", "1"))
        self.assertIn("none.toml: cannot be read", complaint("render", out, "--berth", BERTH, "--seeds", "1", "none.toml"))
        self.assertIn("none.mcap: cannot be read", complaint("evaluate", out, "--berth", BERTH, "none.mcap"))
        self.assertIn("-- is for the berth command", complaint("render", out, "--seeds", "1", "s.toml", "--", "--noise", "1"))
        for seeds in ["", "a", "5-1", "1,1", "-3", "0-9999999"]:
            with self.assertRaises(SystemExit), contextlib.redirect_stderr(io.StringIO()) as err:
                command.main(["accuracy", str(out), f"--seeds={seeds}"])
            self.assertIn(f"'{seeds}'", err.getvalue())
        for name in ["a/near.toml", "b/near.toml"]:
            (self.folder / name).parent.mkdir()
            (self.folder / name).write_text(SCENARIO)
        self.assertIn("called alike", complaint("render", out, "--berth", BERTH, "--seeds", "1", self.folder / "a/near.toml",
                                                self.folder / "b/near.toml"))

    def test_the_documents_commands_run(self):
        recording, scenario = self.folder / "near.mcap", self.folder / "near.toml"
        scenario.write_text(SCENARIO)
        os.system(f"{BERTH} run --source sim:{scenario} --backend simd --record {recording} >{self.folder}/log")
        lines = (pathlib.Path(__file__).parents[2] / "docs/campaigns.md").read_text().splitlines()
        commands = [shlex.split(line)[3:] for line in lines if line.startswith("python -m berth_tools.campaign ")]
        self.assertEqual([words[0] for words in commands], ["accuracy", "render", "evaluate"])
        for words in commands:
            # As it stands, but small.
            for option, value in {"--seeds": "1", "--only": "still", "--frames": "1"}.items():
                if option in words:
                    words[words.index(option) + 1] = value
            words[1] = str(self.folder / words[1])
            words = [str(scenario) if word.endswith(".toml") else str(recording) if word.endswith(".mcap") else word
                     for word in words] + (["--frames", "2", "--fineness", "1"] if words[0] == "accuracy" else [])
            code, out, err = self.run_command(*words[:2], "--berth", BERTH, "--workers", 0, *words[2:])
            self.assertEqual(code, 0, err)
            self.assertGreater(len(out.splitlines()), 1)

    def test_parts(self):
        self.assertEqual(with_seed("# c\nseed = 7\n[a]\nseed = 9\n", 3), "seed = 3\n# c\n[a]\nseed = 9\n")
        self.assertEqual(with_seed("a = 1\n", 3), "seed = 3\na = 1\n")
        turned = {"t": [0, 0, 1.002], "R": [0, -1, 0, 1, 0, 0, 0, 0, 1]}
        straight = {"t": [0, 0, 1], "R": [1, 0, 0, 0, 1, 0, 0, 0, 1]}
        mm, degrees = pose_errors(turned, straight)
        self.assertAlmostEqual(mm, 2)
        self.assertAlmostEqual(degrees, 90)
        task = campaign.Task("one", {"kind": "accuracy"})
        (self.folder / "results").mkdir()
        store(self.folder, task, {"a": b"1", "b": b"2"})
        store(self.folder, task, {"a": b"3"})
        self.assertEqual(sorted(bytes_of(self.folder)), ["results/one/a", "results/one/task.json"])


if __name__ == "__main__":
    sys.exit(unittest.main())
