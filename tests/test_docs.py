"""The documentation says what the code does: names, parameters, commands and links."""

from __future__ import annotations

import ast
import importlib.util
import re
import subprocess
from pathlib import Path

import pytest
from rcl_interfaces.srv import ListParameters

ROOT = Path(__file__).resolve().parent.parent
INTERFACES = ROOT / "msgs_docs"
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = sorted(
    ROOT / line
    for line in subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    if (ROOT / line).is_file()
)
NODE_FILES = {
    "demonstration_recorder": ROOT / "irlpilco_ros/nodes/demonstration_recorder.py",
    "controller": ROOT / "irlpilco_ros/nodes/controller.py",
    "learner": ROOT / "irlpilco_ros/nodes/learner.py",
    "baxter_simulator": ROOT / "sim_bridge/baxter_simulator_node.py",
    "cart_pole_simulator": ROOT / "sim_bridge/cart_pole_simulator_node.py",
    "demonstrator": ROOT / "sim_bridge/demonstrator_node.py",
}
SHARED = {
    "controller": ROOT / "irlpilco_ros/ros/command_output.py",
    "learner": ROOT / "irlpilco_ros/ros/progress_numbers.py",
    "baxter_simulator": ROOT / "sim_bridge/simulator_node.py",
    "cart_pole_simulator": ROOT / "sim_bridge/simulator_node.py",
}
"""What nodes have in common is in a file of its own."""
# Made by helpers of the nodes, or by rclpy itself.
OTHERWISE_MADE = {
    "/diagnostics",
    "/tf",
    "/tf_static",
    "controller/set_parameters_atomically",
    "robot_description",
}


def interfaces_of(node: str) -> set[str]:
    """Return the topics and services that a node's source names."""
    files = {NODE_FILES[node], SHARED.get(node, NODE_FILES[node])}
    tree = ast.parse(
        "\n".join(
            re.sub(r"^from __future__.*$", "", file.read_text(encoding="utf-8"), flags=re.MULTILINE)
            for file in files
        )
    )
    constants = {
        target.id: assignment.value.value
        for assignment in ast.walk(tree)
        if isinstance(assignment, ast.Assign) and isinstance(assignment.value, ast.Constant)
        for target in assignment.targets
        if isinstance(target, ast.Name)
    }
    names = set()
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute):
            maker = call.func.attr
            if maker in {"create_publisher", "create_subscription", "create_service"}:
                name = call.args[1]
                if isinstance(name, ast.Constant):
                    names.add(str(name.value).replace("~", node))
                else:
                    names.add(str(constants[ast.unparse(name)]).replace("~", node))
    return names


def page_of(name: str) -> Path:
    return INTERFACES / f"{name.strip('/').replace('/', '.')}.md"


def test_every_topic_and_service_has_a_page_and_every_page_a_topic_or_service():
    made = set.union(OTHERWISE_MADE, *(interfaces_of(node) for node in NODE_FILES))
    assert {"joint_states", "controller/run_trial", "learn_iteration"} <= made
    titles = {
        page.read_text(encoding="utf-8").splitlines()[0].strip("# `"): page
        for page in INTERFACES.glob("*.md")
        if page.name not in {"README.md", "parameters.md"}
    }
    assert set(titles) == made
    assert {name: page_of(name) for name in titles} == titles


@pytest.mark.parametrize("node", NODE_FILES)
def test_pages_name_the_nodes_that_take_part(node):
    for name in interfaces_of(node):
        assert f"`{node}`" in page_of(name).read_text(encoding="utf-8"), page_of(name)


def test_the_index_lists_every_page():
    index = (INTERFACES / "README.md").read_text(encoding="utf-8")
    pages = {page.name for page in INTERFACES.glob("*.md")} - {"README.md"}
    assert pages == set(re.findall(r"\(([\w.]+\.md)\)", index))


def test_every_page_tells_type_and_failures():
    for page in INTERFACES.glob("*.md"):
        if page.name in {"README.md", "parameters.md"}:
            continue
        text = page.read_text(encoding="utf-8")
        assert re.search(r"^\| type \| `\w+/(msg|srv)/\w+` \|$", text, re.MULTILINE), page
        assert "\n## Failures\n" in text, page
        if "/msg/" in text:
            for line in ("QoS", "rate", "units", "frame", "sent by", "heard by"):
                assert f"\n| {line} | " in text, f"{page} does not tell {line}"


def test_the_parameter_tables_are_those_of_the_code():
    spec = importlib.util.spec_from_file_location("tables", ROOT / "tools/parameter_tables.py")
    assert spec is not None
    tables = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tables)
    assert tables.PAGE.read_text(encoding="utf-8") == tables.page(), "run `make docs`"
    assert tables.NAMES.read_text(encoding="utf-8") == tables.names(), "run `make docs`"


@pytest.mark.dds
def test_running_nodes_have_the_parameters_of_the_page(ros, tmp_path):
    page = (INTERFACES / "parameters.md").read_text(encoding="utf-8")
    sections = dict(re.findall(r"^## (\w+)\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL))
    assert set(sections) == set(NODE_FILES)
    for path in NODE_FILES.values():
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        ros.start(
            module,
            files=["config/baxter.yaml"],
            parameters={"run_directory": str(tmp_path / "run")},
            wait=False,
        )
    for node, section in sections.items():
        ros.wait_for_node(node)
        answer = ros.call(ListParameters, f"{node}/list_parameters", ListParameters.Request())
        running = {
            name
            for name in answer.result.names
            if name not in {"use_sim_time", "start_type_description_service"}
        }
        documented = set(re.findall(r"^\| `([\w.]+)`", section, re.MULTILINE))
        assert documented == running, f"parameters of {node}"


def test_the_two_commands_come_first():
    first = README.splitlines()[:6]
    assert any(line.startswith("make demo") for line in first)
    assert any(line.startswith("make test") for line in first)


def test_the_make_targets_of_the_documents_exist():
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        named = set(re.findall(r"(?:`|^)make ([a-z-]+)", text, re.MULTILINE))
        assert named <= targets, page


def commands(text: str, prefix: str) -> list[str]:
    """Return what follows the prefix on the command lines of a document, comments left out."""
    blocks = re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    lines = "\n".join(blocks).replace("\\\n", " ").splitlines()
    return [line.split("#")[0].removeprefix(prefix) for line in lines if line.startswith(prefix)]


def test_the_irlpilco_commands_of_the_readme_are_understood():
    from irlpilco_ros.cli import build_parser

    lines = commands(README, "irlpilco ") + commands(README, "ros2 run irlpilco_ros irlpilco ")
    assert len(lines) >= 5
    for line in lines:
        build_parser().parse_args(line.split())


def test_the_executables_and_services_of_the_readme_exist():
    executables = {path.name for path in (ROOT / "executables").iterdir()}
    started = {line.split()[0] for line in commands(README, "ros2 run irlpilco_ros ")}
    assert started == executables
    for line in commands(README, "ros2 service call /"):
        assert page_of(line.split()[0]).is_file(), line


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_page_holds_both_sides_of_a_merge(page):
    assert not re.search(r"^(<{7} |>{7} |={7}$)", page.read_text(encoding="utf-8"), re.MULTILINE)


def test_no_link_leads_nowhere():
    dead = []
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if not target.startswith(("http://", "https://")):
                path = (page.parent / target).resolve()
                if not path.exists():
                    dead.append(f"{page.relative_to(ROOT)}: {target}")
    assert dead == []
