# Reads a USD file as a robot: the task is an object with path, root (the folder below which its files have to lie),
# allow_external, drop_unsupported; the answer, on standard output, one with `mjcf` (absent where the file is refused),
# `notes`, `problems`, `places` (prims of MJCF's elements, by their labels) and `layers` (the files that were read).
import json
import os

from pxr import Tf, UsdPhysics

from document import Document
from robot import Robot
from stage import Refusal, file_of, open_scene


def require_robot(scene, robot):
    if robot.bodies or robot.fixed:
        return
    if any(prim.IsA(UsdPhysics.Joint) for prim in scene.prims()):
        raise Refusal("has joints, but no prim with PhysicsRigidBodyAPI", "apply PhysicsRigidBodyAPI to the links")
    default = scene.stage.GetDefaultPrim()
    kinds = sorted({str(prim.GetTypeName()) for prim in scene.prims() if prim.GetTypeName()})
    holds = f" (it holds {', '.join(kinds[:6])})" if kinds else ""
    raise Refusal(
        f"has no UsdPhysics joint or rigid body{holds}",
        "name the file with the physics: a robot needs PhysicsRigidBodyAPI and joints"
        + ("" if default or kinds else "; the stage is empty, so its prims may be in a layer that defines none"),
    )


def read(task):
    scene = None
    try:
        scene = open_scene(task["path"], task["root"], task["allow_external"], task["drop_unsupported"])
        robot = Robot(scene)
        require_robot(scene, robot)
        robot.build()
        default = scene.stage.GetDefaultPrim()
        name = default.GetName() if default else os.path.splitext(os.path.basename(task["path"]))[0]
        document = Document(scene, robot, name)
        text = document.text()
        scene.finish_notes()
    except Refusal as refusal:
        return {"problems": [{"element": "", "left_out": False, **refusal.problem}], "notes": [] if scene is None else scene.notes}
    answer = {"notes": scene.notes, "problems": scene.problems, "places": document.places}
    answer["layers"] = sorted({file_of(layer.realPath) for layer in scene.stage.GetUsedLayers() if layer.realPath})
    if all(problem["left_out"] for problem in scene.problems):
        answer["mjcf"] = text
    return answer


def main(task):
    try:
        answer = read(task)
    except Tf.ErrorException as error:
        words = " ".join(str(error).split())[:300]
        answer = {"problems": [{"element": "", "message": f"OpenUSD cannot read it: {words}", "mend": "", "option": "", "left_out": False}], "notes": []}
    return json.dumps(answer)
