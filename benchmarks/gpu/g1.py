"""Makes the G1 that run.py measures: g1.py FOLDER OUT, FOLDER is unitree_g1 of MuJoCo Menagerie, with g1_mjx.xml and scene_mjx.xml.

OUT gets scene.xml: the model's primitives and its 49 pairs of them, which Menagerie made for MJX, without what is only drawn, motors, sensors
and options. Joint ranges are those of the robot, which some versions of the file narrow.
"""

import pathlib
import re
import sys

RANGES = {"hip_pitch": (-2.5307, 2.8798), "hip_yaw": (-2.7576, 2.7576), "knee": (-0.087267, 2.8798), "ankle_pitch": (-0.87267, 0.5236),
          "ankle_roll": (-0.2618, 0.2618), "waist_yaw": (-2.618, 2.618), "waist_roll": (-0.52, 0.52), "waist_pitch": (-0.52, 0.52),
          "shoulder_pitch": (-3.0892, 2.6704), "shoulder_yaw": (-2.618, 2.618), "elbow": (-1.0472, 2.0944),
          "wrist_roll": (-1.97222, 1.97222), "wrist_pitch": (-1.61443, 1.61443), "wrist_yaw": (-1.61443, 1.61443),
          "left_hip_roll": (-0.5236, 2.9671), "right_hip_roll": (-2.9671, 0.5236), "left_shoulder_roll": (-1.5882, 2.2515),
          "right_shoulder_roll": (-2.2515, 1.5882)}


def without(text, *patterns):
    for pattern in patterns:
        text = re.sub(r"\s*" + pattern, "", text, flags=re.S)
    return text


def ranged(match):
    name = match.group(1)
    low, high = RANGES.get(name) or RANGES[re.sub("^(left|right)_", "", name)]
    return f'<joint name="{name}_joint" range="{low} {high}" class='


def main(folder, out):
    out.mkdir(parents=True, exist_ok=True)
    robot = without((folder / "g1_mjx.xml").read_text("utf-8"), r'<geom\b[^>]*class="visual"[^>]*/>', r"<mesh name=[^>]*/>",
                    r'<default class="visual">.*?</default>', "<sensor>.*?</sensor>", "<option.*?</option>", "<actuator>.*?</actuator>",
                    "<position [^>]*/>")
    robot = re.sub(r'<joint name="(\w+)_joint" (?:range="[^"]*" )?class=', ranged, robot)
    (out / "g1.xml").write_text(robot, "utf-8")
    scene = without((folder / "scene_mjx.xml").read_text("utf-8"), "<asset>.*?</asset>", "<visual>.*?</visual>", 'ctrl="[^"]*"')
    (out / "scene.xml").write_text(scene.replace("g1_mjx.xml", "g1.xml").replace(' material="groundplane"', ""), "utf-8")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*map(pathlib.Path, sys.argv[1:]))
