"""python -m berth_tools.campaign: see docs/campaigns.md."""

from __future__ import annotations

import argparse
import contextlib
import os
import re
import sys
from typing import Optional

from .run import local_client, remote_client, run_tasks
from .summary import summarize
from .tasks import CampaignError, accuracy_tasks, berth_version, evaluation_tasks, render_tasks

EXAMPLES = """examples:
  python -m berth_tools.campaign accuracy noise2 --seeds 1-200 -- --only z,rz --noise 2
  python -m berth_tools.campaign render sets/approach --seeds 1-50 --frames 140 scenarios/approach.toml
  python -m berth_tools.campaign evaluate flights recordings/*.mcap -- --corners photometric
  python -m berth_tools.campaign accuracy big --seeds 1-5000 --scheduler tcp://10.0.0.1:8786

What stands behind -- goes to the berth command. The same call again goes on where it ended.
Exit codes: 0 all well; 1 tasks failed; 2 bad input."""


def seeds_of(text: str) -> list[int]:
    """ "1-5,9": 1, 2, 3, 4, 5 and 9."""
    seeds: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"(\d{1,18})(?:-(\d{1,18}))?", part)
        last = int(match[2] or match[1]) if match else -1
        if not match or last < int(match[1]) or last - int(match[1]) > 1_000_000:
            raise argparse.ArgumentTypeError(f"'{text}': give numbers and ranges, e.g. 1-100 or 1-5,9")
        seeds += range(int(match[1]), last + 1)
    if len(set(seeds)) != len(seeds):
        raise argparse.ArgumentTypeError(f"'{text}': a seed comes twice; leave one out")
    return seeds


def count_of(text: str) -> int:
    if not re.fullmatch(r"\d{1,6}", text):
        raise argparse.ArgumentTypeError(f"'{text}': give a whole number, 0 or more")
    return int(text)


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="python -m berth_tools.campaign", epilog=EXAMPLES,
                                  description="Many seeded tasks over Berth, spread by Dask, with one result.",
                                  formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = top.add_subparsers(dest="kind", required=True, metavar="KIND")
    shared = argparse.ArgumentParser(add_help=False)
    shared.add_argument("out", metavar="OUT", help="folder of the results; the same again goes on with it")
    shared.add_argument("--berth", default="berth", metavar="COMMAND", help="the berth command, on every worker [berth]")
    shared.add_argument("--workers", type=count_of, default=os.cpu_count() or 1, metavar="N",
                        help="processes on this machine; 0: one task after the other, without Dask [its cores]")
    shared.add_argument("--scheduler", metavar="ADDRESS", help="a Dask scheduler that runs already, in place of --workers")
    seeded = argparse.ArgumentParser(add_help=False)
    seeded.add_argument("--seeds", type=seeds_of, required=True, metavar="A-B", help="a task for each, e.g. 1-100")
    kinds.add_parser("accuracy", parents=[shared, seeded], help="berth table for each seed: errors of every axis")
    rendering = kinds.add_parser("render", parents=[shared, seeded], help="simulated images with their truth")
    rendering.add_argument("scenarios", nargs="+", metavar="SCENARIO", help="scenario file (docs/simulator.md)")
    rendering.add_argument("--frames", type=count_of, default=0, metavar="N", help="frames of each, 0 for all [0]")
    evaluating = kinds.add_parser("evaluate", parents=[shared], help="recordings, searched and held to their truth")
    evaluating.add_argument("recordings", nargs="+", metavar="FILE.mcap", help="recording, under this path on every worker")
    return top


def main(argv: Optional[list[str]] = None) -> int:
    argv = sys.argv[1:] if argv is None else argv
    cut = argv.index("--") if "--" in argv else len(argv)
    more = argv[cut + 1:]
    options = parser().parse_args(argv[:cut])
    try:
        if more and options.kind == "render":
            raise CampaignError("-- is for the berth command, which rendering does not use; leave it out")
        version = berth_version(options.berth)
        if options.kind == "accuracy":
            tasks = accuracy_tasks(options.seeds, more, version)
        elif options.kind == "render":
            tasks = render_tasks(options.scenarios, options.seeds, options.frames, version)
        else:
            tasks = evaluation_tasks(options.recordings, more, version)

        def write(text: str) -> None:
            sys.stderr.write(text)
            sys.stderr.flush()

        with contextlib.ExitStack() as stack:
            client = None
            if options.scheduler:
                client = stack.enter_context(remote_client(options.scheduler))
            elif options.workers > 0:
                client = stack.enter_context(local_client(options.workers))
            failures = run_tasks(tasks, options.out, options.berth, client, write, sys.stderr.isatty())
        for failure in failures:
            write(f"berth campaign: {failure.task.name}: {failure.why}\n")
        if failures:
            write(f"berth campaign: {len(failures)} of {len(tasks)} tasks failed; the same call again tries them again\n")
            return 1
        sys.stdout.write(summarize(tasks, options.out))
        return 0
    except CampaignError as error:
        sys.stderr.write(f"berth campaign: {error}\n")
        return 2


if __name__ == "__main__":
    sys.exit(main())
