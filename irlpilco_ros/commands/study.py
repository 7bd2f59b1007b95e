"""`irlpilco study`: measure what the project claims, over seeds, with tables and figures."""

from __future__ import annotations

import argparse
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from irlpilco_ros.commands.number_options import whole
from irlpilco_ros.learning.errors import InvalidSettingError

if TYPE_CHECKING:  # studies are loaded when one is run
    from irlpilco_ros.studies.experiment import Experiment
    from irlpilco_ros.studies.result_store import ResultStore

EXPERIMENTS = {
    "baxter": (
        "motion",
        "places",
        "speeds",
        "control_period",
        "headline",
        "perturbations",
        "debris",
        "hands",
        "elbows",
        "second_robot",
        "ablation",
        "reproduce",
        "reading",
        "thesis_perturbations",
    ),
    "cart-pole": ("mc_pilco",),
}
"""The parts of each chapter, in the order in which they are measured."""

EPILOG = """\
baxter     the sweep on a simulated Baxter: the whole path of the arm on robots as they come,
           miscalibrated and late, beside iterative learning control; the sweep at other places
           and speeds; other control periods; robot time, perturbations against replay, tracking and
           cloning, debris in the pan, hand features, demonstrations that differ in an elbow,
           ablation, the thesis's own settings and methods over 15 iterations, and other readings
           of the thesis, one setting changed at a time
cart-pole  classical PILCO on the cart-pole of MC-PILCO's published script, whose numbers are for
           50 seeds (what the thesis did with a cart-pole is irlpilco cart-pole)

Every run is a file OUT/EXPERIMENT/CONDITION/SEED.json; a study that was stopped goes on with those
that are missing. All runs over ten seeds take some hours on two cores; the headline a quarter of
an hour. Tables go to OUT/tables.md, figures to OUT/figures.

examples:
  irlpilco study baxter --experiments motion --seeds 3
  irlpilco study baxter --experiments reproduce --seeds 2 --iterations 4
  irlpilco study baxter --processes 2
  irlpilco study baxter --dask tcp://scheduler:8786
  irlpilco study baxter --document docs/results.md    # fills in its tables
  irlpilco study cart-pole --seeds 50
"""


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parts = "; ".join(f"{chapter}: {', '.join(names)}" for chapter, names in EXPERIMENTS.items())
    parser = subparsers.add_parser(
        "study",
        help="measure over seeds what the project claims",
        description="Run a study and write its tables and figures.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("chapter", choices=EXPERIMENTS, help="what is studied")
    parser.add_argument(
        "--experiments",
        nargs="+",
        choices=[name for names in EXPERIMENTS.values() for name in names],
        metavar="NAME",
        help=f"parts of it (default: all). {parts}",
    )
    parser.add_argument(
        "--seeds", type=whole(1), default=10, metavar="N", help="seeds 0 to N - 1 (default: 10)"
    )
    parser.add_argument(
        "--iterations",
        type=whole(1),
        metavar="N",
        help="learned policies of each run, of reproduce (default: 15) and reading (default: 7); "
        "results of another number have a folder of their own and are in no figure",
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="OUT",
        help="folder of the results (default: runs/study_CHAPTER)",
    )
    parser.add_argument(
        "--processes",
        type=whole(1, 1000),
        default=1,
        metavar="N",
        help="runs at once here (default: 1)",
    )
    parser.add_argument(
        "--dask", metavar="ADDRESS", help="scheduler of a Dask cluster that does the runs instead"
    )
    parser.add_argument(
        "--tables-only", action="store_true", help="compute nothing, show what is there"
    )
    parser.add_argument(
        "--document",
        type=Path,
        metavar="FILE",
        help="Markdown file that takes the tables, between <!-- table: NAME --> and <!-- end -->; "
        "the figures go to figures/ beside it",
    )
    parser.add_argument(
        "--cart-pole",
        type=Path,
        default=Path("runs/cart_pole"),
        metavar="DIR",
        help="results of `irlpilco cart-pole`, whose errors stand beside Baxter's in the figure of "
        "both methods (default: runs/cart_pole)",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Compute what is missing and write the tables and figures."""
    from irlpilco_ros.studies.document import fill_tables
    from irlpilco_ros.studies.result_store import ResultStore
    from irlpilco_ros.studies.run_jobs import run_jobs
    from irlpilco_ros.studies.tables import state_of

    chapter = _parts_of(arguments.chapter)
    names = arguments.experiments or chapter
    _check_names(arguments.chapter, names)
    parts = {name: _learning(chapter[name], name, arguments) for name in names}
    out = arguments.out or Path("runs") / f"study_{arguments.chapter.replace('-', '_')}"
    store, seeds = ResultStore(out), range(arguments.seeds)
    tables: dict[str, str] = {}
    for name, part in parts.items():
        jobs = part.jobs(seeds)
        if not arguments.tables_only:
            run_jobs(jobs, store, arguments.processes, arguments.dask)
        tables[name] = f"{part.table(store, seeds)}\n\n{state_of(store, jobs)}"
        print(f"## {name}\n\n{tables[name]}\n", flush=True)
    store.folder.mkdir(parents=True, exist_ok=True)
    text = "\n".join(f"## {name}\n\n{table}\n" for name, table in tables.items())
    (store.folder / "tables.md").write_text(text, encoding="utf-8")
    if arguments.document is not None:
        fill_tables(arguments.document, tables)
    if arguments.chapter == "baxter":
        _draw(store, seeds, names, arguments)
    return 0


def _parts_of(chapter: str) -> Mapping[str, Experiment]:
    if chapter == "baxter":
        from irlpilco_ros.studies.baxter import results

        return results.EXPERIMENTS
    from irlpilco_ros.studies.cart_pole import experiments

    return experiments.EXPERIMENTS


def _check_names(chapter: str, names: Iterable[str]) -> None:
    """Refuse parts of another chapter.

    Raises:
        InvalidSettingError: names them, and those that there are.
    """
    unknown = [name for name in names if name not in EXPERIMENTS[chapter]]
    if unknown:
        raise InvalidSettingError(
            f"{', '.join(unknown)} is no part of the chapter {chapter}; choose from: "
            + ", ".join(EXPERIMENTS[chapter])
        )


def _draw(
    store: ResultStore,
    seeds: Sequence[int],
    experiments: Collection[str],
    arguments: argparse.Namespace,
) -> None:
    """Draw the figures of these experiments beside the tables, and beside the document."""
    from irlpilco_ros.studies.baxter.figures import write_figures

    folders = [store.folder / "figures"]
    if arguments.document is not None:
        folders.append(arguments.document.parent / "figures")
    for folder in folders:
        for figure in write_figures(store, seeds, folder, arguments.cart_pole, experiments):
            print(f"figure: {figure}")


def _learning(part: Experiment, name: str, arguments: argparse.Namespace) -> Experiment:
    """Return the experiment with as many learned policies in each run as are asked for.

    Raises:
        InvalidSettingError: it has a number of its own.
    """
    if arguments.iterations is None:
        return part
    if part.learned is None:
        raise InvalidSettingError(
            f"the experiment {name} has a number of iterations of its own; give --iterations with "
            "--experiments reproduce or reading, or leave it out"
        )
    return part.learned(arguments.iterations)
