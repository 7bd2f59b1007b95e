"""Installs the package for colcon and for pip alike, in the layout that `ros2 run` looks for.

The executables are small files that are installed as data under lib/irlpilco_ros: as entry points
pip would put them into bin/ only, where `ros2 run` does not look.
"""

from glob import glob

from setuptools import find_packages, setup

NAME = "irlpilco_ros"

setup(
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*", "sim_bridge", "sim_bridge.*"]),
    package_data={
        NAME: ["py.typed", "**/templates/*"],
        "sim_bridge": ["py.typed", "**/*.xml", "**/*.yaml", "**/*.md", "**/*.png"],
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml", "LICENSE"]),
        (f"share/{NAME}/config", sorted(glob("config/*.*"))),
        (f"share/{NAME}/launch", sorted(glob("launch/*.launch.py"))),
        (f"share/{NAME}/bags/cart_pole/expert", sorted(glob("bags/cart_pole/expert/*"))),
        (f"lib/{NAME}", sorted(glob("executables/*"))),
    ],
    # rclpy and the messages come from a ROS 2 that is installed, or from requirements/.
    install_requires=[
        "jinja2>=3.1",
        "joblib>=1.4",
        "lz4",
        "matplotlib",
        "mcap>=1.2",
        "mujoco>=4.0",
        "numpy>=1.26",
        "pyyaml",
        "rosbags>=0.11",
        "scipy>=1.14",
        "threadpoolctl>=3.8",
        "tqdm",
        "zstandard",
    ],
    extras_require={
        "dask": ["distributed"],  # irlpilco study --dask
        "lerobot": ["pyarrow"],  # irlpilco export --lerobot
        "study": ["movement_primitives", "pytransform3d"],  # a baseline of its experiment places
        "view": ["viser>=1.0", "pycollada"],  # irlpilco view
    },
    entry_points={
        "console_scripts": [f"irlpilco = {NAME}.entry:irlpilco"],
    },
    zip_safe=False,
)
