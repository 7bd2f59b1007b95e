"""`make benchmark`: every benchmark in this folder, one after the other, or those that are named.

python -m benchmarks [NAME...]
"""

from __future__ import annotations

import argparse
import importlib
from pathlib import Path


def names() -> list[str]:
    """Return the modules of this folder that can be run: those with a function `main`."""
    folder = Path(__file__).parent
    return sorted(
        path.stem
        for path in folder.glob("*.py")
        if path.name != "__main__.py" and "\ndef main()" in path.read_text(encoding="utf-8")
    )


def main() -> None:
    """Run the benchmarks; each prints its own table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="one of: " + ", ".join(names()))
    chosen = parser.parse_args().names or names()
    unknown = sorted(set(chosen) - set(names()))
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; available: {', '.join(names())}")
    for name in chosen:
        print(f"== {name}", flush=True)
        importlib.import_module(f"benchmarks.{name}").main()


if __name__ == "__main__":
    main()
