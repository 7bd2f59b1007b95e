"""URDFs of small robots, as vendors write them: an arm with a gripper, two arms on a torso."""

from __future__ import annotations


def joint(name, kind, parent, child, *, limit="", rest=""):
    """A <joint>; its `limit` is the attributes of that tag."""
    tag = f"<limit {limit}/>" if limit else ""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>{tag}{rest}</joint>'
    )


def robot(joints, name="arm", more=""):
    """A <robot> of these joints and the links that they name; nobody has its meshes."""
    links = {word.partition('"')[0]: None for text in joints for word in text.split('link="')[1:]}
    mesh = '<visual><geometry><mesh filename="package://nobody/none.dae"/></geometry></visual>'
    bodies = "".join(f'<link name="{link}">{mesh}</link>' for link in links)
    return f'<?xml version="1.0"?><robot name="{name}">{bodies}{"".join(joints)}{more}</robot>'


FINGERS = 'lower="0" upper="0.04" velocity="0.1" effort="20"'

ARM = robot(
    [
        joint("lift", "prismatic", "world", "post", limit='lower="0" upper="0.4" velocity="0.2"'),
        joint(
            "shoulder",
            "revolute",
            "post",
            "upper_arm",
            limit='lower="-1.5707963267948966" upper="2.1" velocity="1.5" effort="87"',
        ),
        joint("elbow", "continuous", "upper_arm", "lower_arm", limit='velocity="2" effort="12"'),
        joint("flange", "fixed", "lower_arm", "flange"),
        joint("camera_mount", "fixed", "flange", "camera"),
        joint("tool_mount", "fixed", "flange", "tool0"),
        joint("left_finger", "prismatic", "flange", "left_tip", limit=FINGERS),
        joint(
            "right_finger",
            "prismatic",
            "flange",
            "right_tip",
            limit=FINGERS,
            rest='<mimic joint="left_finger"/>',
        ),
    ]
)
"""A lift, a shoulder, an elbow without end, and a gripper whose second finger follows the first."""

LIMIT = 'lower="-1" upper="1" velocity="1" effort="5"'

TORSO = robot(
    [
        joint("waist", "revolute", "base", "torso", limit=LIMIT),
        *(
            joint(f"{side}_{part}", "revolute", above, f"{side}_{below}", limit=LIMIT)
            for side in ("left", "right")
            for part, above, below in (
                ("shoulder", "torso", "upper"),
                ("elbow", f"{side}_upper", "lower"),
                ("wrist", f"{side}_lower", "hand"),
            )
        ),
    ],
    name="torso",
)
"""A waist, and two arms of three joints."""
