"""SDF files of the program's user: the same robot as in URDF, and what is refused."""

import json

from harness import AssayTest, main

INERTIA = {"ixx": 0.02, "iyy": 0.03, "izz": 0.025}


def urdf(mass=1):
    inertia = " ".join(f'{key}="{value}"' for key, value in (INERTIA | {"ixy": 0, "ixz": 0, "iyz": 0}).items())
    link = ('<link name="{}"><inertial><origin xyz="0.1 0 0" rpy="0 0 0.3"/><mass value="{}"/>'
            f"<inertia {inertia}/></inertial></link>")
    joint = ('<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/><origin xyz="{}" rpy="{}"/><axis xyz="{}"/>'
             '<limit lower="-1" upper="2" effort="30" velocity="3"/><dynamics damping="0.2" friction="0.1"/>{}</joint>')
    return "\n".join([
        '<robot name="arm"><link name="base"/>', link.format("upper", 2), link.format("fore", mass), link.format("hand", 0.5),
        joint.format("shoulder", "revolute", "base", "upper", "0 0 1", "0 0 0", "0 1 0", ""),
        joint.format("elbow", "revolute", "upper", "fore", "0.3 0 0", "0 0.4 0", "0 0.6 0.8", ""),
        joint.format("slide", "prismatic", "fore", "hand", "0.2 0 0", "0.1 0 0", "1 0 0",
                     '<mimic joint="elbow" multiplier="0.05" offset="0.01"/>'), "</robot>"])


def sdf(mass=1, joint="revolute"):
    inertia = "".join(f"<{key}>{value}</{key}>" for key, value in INERTIA.items())
    link = ('<link name="{}"><pose relative_to="{}"/><inertial><pose>0.1 0 0 0 0 0.3</pose><mass>{}</mass>'
            f"<inertia>{inertia}</inertia></inertial></link>")
    one = ('<joint name="{}" type="{}"><pose relative_to="{}">{}</pose><parent>{}</parent><child>{}</child><axis><xyz>{}</xyz>'
           "<limit><lower>-1</lower><upper>2</upper><effort>30</effort><velocity>3</velocity></limit><dynamics><damping>0.2"
           "</damping><friction>0.1</friction></dynamics>{}</axis></joint>")
    return "\n".join([
        '<sdf version="1.11"><model name="arm">', link.format("upper", "shoulder", 2), link.format("fore", "elbow", mass),
        link.format("hand", "slide", 0.5),
        one.format("shoulder", joint, "__model__", "0 0 1 0 0 0", "world", "upper", "0 1 0", ""),
        one.format("elbow", "revolute", "upper", "0.3 0 0 0 0.4 0", "upper", "fore", "0 0.6 0.8", ""),
        one.format("slide", "prismatic", "fore", "0.2 0 0 0.1 0 0", "fore", "hand", "1 0 0",
                   '<mimic joint="elbow"><multiplier>0.05</multiplier><offset>0.01</offset></mimic>'), "</model></sdf>"])


class Sdf(AssayTest):
    def compared(self, a, b, status):
        done = self.run_assay("parity", a, b, "--json")
        self.assertEqual(done.returncode, status, done.stderr)
        return json.loads(done.stdout)

    def test_is_the_robot_of_its_urdf(self):
        self.write("arm.urdf", urdf())
        self.write("arm.sdf", sdf())
        result = self.compared("arm.urdf", "arm.sdf", status=0)
        self.assertEqual((result["verdict"], result["findings"], result["differences"]), ("same", [], []))
        self.write("heavy.sdf", sdf(mass=1.05))
        first = self.compared("arm.urdf", "heavy.sdf", status=1)["differences"][0]
        self.assertEqual((first["element"], first["parameter"]), ("body 'fore'", "mass"))

    def test_is_converted(self):
        self.write("arm.sdf", sdf())
        for to, ending in (("mjcf", "xml"), ("urdf", "urdf")):
            self.assay("convert", "arm.sdf", "--to", to, "--out", f"converted.{ending}")
            self.assertEqual(self.compared("arm.sdf", f"converted.{ending}", status=0)["verdict"], "same")

    def test_mistakes_name_their_line(self):
        self.write("arm.sdf", sdf(joint="hinge"))
        self.refused("check", "arm.sdf", naming=["joint 'shoulder'", "line 5", "the type 'hinge'"])
        self.write("two.sdf", '<sdf version="1.9"><model name="a"><link name="l"/></model><model name="b"><link name="l"/></model></sdf>')
        self.refused("check", "two.sdf", naming=["'a', 'b'", "--sdf-model"])
        self.write("elsewhere/model.sdf", sdf())
        self.write("here/model.sdf", '<sdf version="1.9"><model name="m"><include><uri>../elsewhere/model.sdf</uri></include></model></sdf>')
        self.refused("check", "here/model.sdf", naming=["outside the model's folder", "--allow-external-files"])


if __name__ == "__main__":
    main()
