"""The house as it is meant to be: who may import whom, and what no file may say."""

from __future__ import annotations

import ast
import graphlib
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import irlpilco_ros.learning

ROOT = Path(__file__).resolve().parent.parent
SOURCES = sorted([*ROOT.glob("irlpilco_ros/**/*.py"), *ROOT.glob("sim_bridge/**/*.py")])

YAML_READER = ROOT / "irlpilco_ros/experience/plain_files.py"
"""The only file that reads YAML: within bounds, without aliases."""

ROS_PACKAGES = (
    "ament_index_python",
    "builtin_interfaces",
    "diagnostic_msgs",
    "launch",
    "geometry_msgs",
    "launch_ros",
    "rcl_interfaces",
    "rclpy",
    "rosgraph_msgs",
    "sensor_msgs",
    "std_msgs",
    "std_srvs",
    "tf2_msgs",
    "trajectory_msgs",
)
THIRD_PARTY_OF_LEARNING = ("numpy", "scipy", "threadpoolctl")

OURS = ("irlpilco_ros", "sim_bridge")
BELOW_CONTROL = (
    "irlpilco_ros.learning",
    "irlpilco_ros.kinematics",
    "irlpilco_ros.experience",
    "irlpilco_ros.resources",
)
WITH_ROS = ("irlpilco_ros.ros", "irlpilco_ros.nodes")

# A layer may import itself and what is below it. A longer name wins over a shorter one.
MAY_IMPORT = {
    "irlpilco_ros.learning": (),
    "irlpilco_ros.kinematics": ("irlpilco_ros.learning", "irlpilco_ros.resources"),
    "irlpilco_ros.experience": ("irlpilco_ros.learning", "irlpilco_ros.kinematics"),
    "irlpilco_ros.resources": ("irlpilco_ros.learning",),
    "irlpilco_ros.control": ("irlpilco_ros.learning", "irlpilco_ros.experience"),
    "irlpilco_ros.ros": (*BELOW_CONTROL, "irlpilco_ros.control"),
    "irlpilco_ros.nodes": (*BELOW_CONTROL, "irlpilco_ros.control", "irlpilco_ros.ros"),
    "irlpilco_ros.report": (*BELOW_CONTROL, "irlpilco_ros.__version__", "sim_bridge"),
    "irlpilco_ros.view": (*BELOW_CONTROL, "irlpilco_ros.report"),
    "irlpilco_ros.studies": (
        *BELOW_CONTROL,
        "irlpilco_ros.control",
        "irlpilco_ros.report",
        "sim_bridge",
    ),
    "sim_bridge": (*BELOW_CONTROL, "irlpilco_ros.control"),
    "sim_bridge nodes": (
        *BELOW_CONTROL,
        "irlpilco_ros.control",
        "irlpilco_ros.ros",
        "sim_bridge",
    ),
    "irlpilco_ros": OURS,
}


# The rooms and files of learning/, lowest first: each may import those before it, and itself.
LEARNING = (
    "errors",
    "settings",
    "registry",
    "numerics",
    "rollout",
    "weight_rules",
    "gp",
    "moments",
    "state_layout",
    "joints",
    "features",
    "costs",
    "task",
    "pace",
    "policies",
    "imitation",
    "learning_settings",
    "prediction",
    "starts",
    "search",
    "lag",
    "judgement",
    "iteration",
    "measured_band",
    "second_search",
    "conclusion",
    "inferred_steps",
    "learn",
    "elsewhere",
    "adapt",
    "apprenticeship",
)


def name_of(path: Path) -> str:
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imports(path: Path) -> Iterator[str]:
    """Yield every module that a file imports, at its top, inside functions or for types only."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), str(path))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name_of(path)}: import by full name, not by dots"
            # `from package import module` imports package.module.
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def is_within(module: str, layer: str) -> bool:
    return module == layer or module.startswith(layer + ".")


def layer_of(module: str) -> str:
    if module.startswith("sim_bridge.") and module.endswith("_node"):
        return "sim_bridge nodes"
    return max((layer for layer in MAY_IMPORT if is_within(module, layer)), key=len)


def importers_of(packages: tuple[str, ...]) -> set[str]:
    """Return the names of our modules that import any of these top-level packages."""
    return {
        name_of(path)
        for path in SOURCES
        if any(module.split(".")[0] in packages for module in imports(path))
    }


def test_the_walk_sees_the_sources():
    names = {name_of(path) for path in SOURCES}
    assert {"irlpilco_ros.cli", "irlpilco_ros.learning", "irlpilco_ros.ros.runtime"} <= names
    assert "irlpilco_ros.ros.runtime" in importers_of(("rclpy",))


@pytest.mark.parametrize("path", SOURCES, ids=name_of)
def test_imports_run_downwards_only(path):
    layer = layer_of(name_of(path))
    allowed = (layer.removesuffix(" nodes"), *MAY_IMPORT[layer])
    upwards = [
        module
        for module in imports(path)
        if module.split(".")[0] in OURS and not any(is_within(module, name) for name in allowed)
    ]
    assert upwards == [], f"{name_of(path)} belongs to {layer}, which may import only {allowed}"


def room_of(module: str) -> int | None:
    """Return the place in LEARNING of a module; None for the package itself and what is outside."""
    parts = module.split(".")
    if parts[:2] != ["irlpilco_ros", "learning"] or len(parts) < 3:
        return None
    assert parts[2] in LEARNING, f"{module}: give {parts[2]} its place in LEARNING"
    return LEARNING.index(parts[2])


@pytest.mark.parametrize(
    "path", [path for path in SOURCES if room_of(name_of(path)) is not None], ids=name_of
)
def test_imports_within_learning_run_downwards_only(path):
    own = room_of(name_of(path))
    upwards = [
        module for module in imports(path) if (room := room_of(module)) is not None and room > own
    ]
    assert upwards == [], f"{LEARNING[own]} may import only {LEARNING[: own + 1]} of learning/"


def test_no_module_of_learning_needs_itself():
    names = {name_of(path) for path in SOURCES if is_within(name_of(path), "irlpilco_ros.learning")}

    def module_of(imported: str) -> str:
        return imported if imported in names else imported.rpartition(".")[0]

    graph = {
        name_of(path): {module_of(imported) for imported in imports(path)} - {name_of(path)}
        for path in SOURCES
        if name_of(path) in names
    }
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError


def test_learning_needs_only_numpy_scipy_and_threadpoolctl():
    allowed = {*sys.stdlib_module_names, *THIRD_PARTY_OF_LEARNING, "irlpilco_ros"}
    foreign = [
        f"{name_of(path)}: {module}"
        for path in SOURCES
        if is_within(name_of(path), "irlpilco_ros.learning")
        for module in imports(path)
        if module.split(".")[0] not in allowed
    ]
    assert foreign == []


def test_examples_need_only_the_public_learning_api_and_numpy():
    allowed = {*sys.stdlib_module_names, "numpy"}
    foreign = [
        f"{path.name}: {module}"
        for path in sorted(ROOT.glob("examples/*.py"))
        for module in imports(path)
        if module.split(".")[0] not in allowed
        and module.removeprefix("irlpilco_ros.learning.") not in irlpilco_ros.learning.__all__
    ]
    assert foreign == []


def test_ros_is_used_by_the_toolkit_and_nodes_only():
    outside = {
        name
        for name in importers_of(ROS_PACKAGES)
        if layer_of(name) not in (*WITH_ROS, "sim_bridge nodes")
    }
    assert outside == set()


def test_mujoco_is_used_by_the_simulation_and_for_kinematics_only():
    outside = {name for name in importers_of(("mujoco",)) if not is_within(name, "sim_bridge")}
    assert outside == {"irlpilco_ros.kinematics.robot_kinematics"}


def run_python(code: str) -> set[str]:
    """Run code in a new interpreter; return the words that it prints."""
    result = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(result.stdout.split())


def test_all_of_learning_loads_without_ros_simulation_and_files_of_experience():
    modules = [
        name_of(path)
        for path in SOURCES
        if is_within(name_of(path), "irlpilco_ros.learning") and path.name != "__main__.py"
    ]
    code = f"import sys, {', '.join(modules)}; print(*sys.modules)"
    loaded = {module.split(".")[0] for module in run_python(code)}
    assert loaded.isdisjoint({*ROS_PACKAGES, "mujoco", "mcap", "rosbags", "matplotlib"})
    assert "numpy" in loaded


def test_the_command_line_starts_without_ros_and_simulation():
    loaded = run_python("import sys, irlpilco_ros.cli; print(*sys.modules)")
    assert loaded.isdisjoint({"rclpy", "mujoco", "matplotlib.pyplot"})


def test_a_robots_settings_load_no_simulation():
    """Its features may be named `tools`, which MuJoCo finds once they are compared."""
    code = (
        "import sys; from irlpilco_ros.experience.robot_settings import RobotSettings; "
        "from irlpilco_ros.learning.settings import declarations; "
        "print(*declarations(RobotSettings)['features'].choices, *sys.modules)"
    )
    loaded = run_python(code)
    assert {"joints", "tools"} <= loaded
    assert loaded.isdisjoint({"rclpy", "mujoco"})


# Joined from pieces, so that this file does not say them.
FORBIDDEN = {
    "an absolute path of somebody's machine": ("(?<![\\w.$}])/(work|home|root|tmp/venv)", "/"),
    "a folder outside the project": (r"\.\./", "shared"),
    "the address of a package index": ("(python", "hosted|index-", "url|https?://[^ ]*/simple/)"),
    "unfinished work": (r"\b(TO", "DO|FIX", r"ME)\b"),
    "a left-over debugger": (r"\b(set_", r"trace|breakpoint)\("),
}


def tracked_files() -> list[Path]:
    result = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    return [path for line in result.stdout.splitlines() if (path := ROOT / line).is_file()]


@pytest.mark.parametrize("what", FORBIDDEN)
def test_no_file_names(what):
    pattern = re.compile("".join(FORBIDDEN[what]))
    hits = []
    for path in tracked_files():
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:
            continue  # binary: recordings, golden arrays, pictures
        hits += [
            f"{path.relative_to(ROOT)}:{number}: {line.strip()[:100]}"
            for number, line in enumerate(lines, 1)
            if pattern.search(line)
        ]
    assert hits == [], f"no file may name {what}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: str(path.relative_to(ROOT)))
def test_yaml_is_read_in_one_place(path):
    calls = re.findall(r"\byaml\.\w*load\w*\(", path.read_text(encoding="utf-8"))
    assert not calls or path == YAML_READER
