"""`irlpilco cart-pole`: the thesis's first experiment, over seeds, in one process."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import Any

from irlpilco_ros.commands.number_options import whole
from irlpilco_ros.commands.settings_files import read_learning_settings
from irlpilco_ros.commands.terminal import ProgressDisplay

EPILOG = """\
The expert learns a swing-up by classical PILCO; then the demonstration that comes with the package
(an expert's trial) is imitated by feature matching and by feature expectations, without looking
at its commands. OUT/index.md has the table and the figures; a second call goes on where an
interrupted one stood, and more seeds or iterations only add to what is there.

examples:
  irlpilco cart-pole --seeds 1 --iterations 2     a few minutes, to see it work
  irlpilco cart-pole                              the whole chapter: hours
"""

METHODS = ("feature_matching", "feature_expectations")


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser(
        "cart-pole",
        help="the cart-pole chapter: expert, imitation, figures",
        description="Learn to swing up a pole, as an expert and by imitation, over seeds.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--seeds", type=whole(1), default=10, metavar="N", help="(default: 10)")
    parser.add_argument("--first-seed", type=whole(0), default=0, metavar="S", help="(default: 0)")
    parser.add_argument(
        "--iterations",
        type=whole(1),
        default=15,
        metavar="N",
        help="of imitation (default: 15)",
    )
    parser.add_argument(
        "--expert-trials",
        type=whole(1),
        default=7,
        metavar="N",
        help="after which an expert gives up (default: 7)",
    )
    parser.add_argument(
        "--methods",
        nargs="*",
        choices=METHODS,
        default=METHODS,
        metavar="METHOD",
        help=f"which to run besides the expert (default: {' '.join(METHODS)})",
    )
    parser.add_argument(
        "--demonstration", type=Path, metavar="BAG", help="to imitate (default: the package's)"
    )
    parser.add_argument(
        "--settings",
        type=Path,
        metavar="FILE",
        help="parameters file of imitation (default: the package's config/swing_up.yaml)",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("runs/cart_pole"), help="(default: runs/cart_pole)"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the chapter, going on where it stands, and write its page."""
    from irlpilco_ros.experience.bag_reader import read_bag
    from irlpilco_ros.resources import config_file, recording
    from irlpilco_ros.studies.cart_pole import page, results, runs
    from sim_bridge.cart_pole_simulation import CART_POLE_JOINTS

    out: Path = arguments.out
    demonstration = read_bag(arguments.demonstration or recording("cart_pole/expert")).rollout(
        CART_POLE_JOINTS, runs.HORIZON
    )
    settings = read_learning_settings(arguments.settings or config_file("swing_up.yaml"))
    runs.claim(out, demonstration, settings)
    done = results.Runs(demonstration, {}, {method: {} for method in arguments.methods})
    for seed in range(arguments.first_seed, arguments.first_seed + arguments.seeds):
        with ProgressDisplay(f"expert, seed {seed}") as display:
            done.expert[seed] = runs.run_expert(
                out / "expert" / f"seed_{seed:02d}", seed, arguments.expert_trials, display.update
            )
        print(results.expert_line(seed, done.expert[seed]), flush=True)
        for method in arguments.methods:
            with ProgressDisplay(f"{method}, seed {seed}") as display:
                done.imitation[method][seed] = runs.run_imitation(
                    out / method / f"seed_{seed:02d}",
                    demonstration,
                    dataclasses.replace(settings, imitation=method),
                    seed,
                    arguments.iterations,
                    display.update,
                )
            line = results.imitation_line(method, seed, demonstration, done.imitation[method][seed])
            print(line, flush=True)
    print(f"page: {page.write_page(out, done)}")
    return 0
