"""Models and campaigns of the guard: what loads, and what is refused, each as small as it can be."""

BOX = "<geom type='box' size='.1 .1 .1' mass='1'/>"
ARM = ("<body name='upper' pos='0 0 1'><joint name='shoulder' axis='0 1 0' {upper}/>"
       "<geom type='capsule' size='.03' fromto='0 0 0 .3 0 0' mass='1'/>"
       "<body name='lower' pos='.3 0 0'><joint name='elbow' axis='0 1 0' {lower}/>"
       "<geom type='capsule' size='.02' fromto='0 0 0 .2 0 0' mass='.5'/></body></body>")
FLOOR = "<geom name='floor' type='plane' size='0 0 1'/>"


def mjcf(world, rest="", before=""):
    return f"<mujoco model='m'>{before}<worldbody>{world}</worldbody>{rest}</mujoco>\n"


def arm(upper="", lower="", rest="", before=""):
    return mjcf(FLOOR + ARM.format(upper=upper, lower=lower), rest, before)


def free(geom=BOX, rest="", height=1):
    return mjcf(f"{FLOOR}<body name='b' pos='0 0 {height}'><freejoint/>{geom}</body>", rest)


LINK = ("<link name='{name}'><inertial><mass value='1'/><inertia ixx='.01' iyy='.01' izz='.01' ixy='0' ixz='0' iyz='0'/>"
        "</inertial><collision><geometry><box size='.1 .1 .1'/></geometry></collision></link>")


def urdf(joint="<limit lower='-1' upper='1' effort='5' velocity='2'/>", links=("a", "b"), kind="revolute", more=""):
    text = "".join(LINK.format(name=name) for name in links)
    return (f"<robot name='r'>{text}<joint name='j' type='{kind}'><parent link='a'/><child link='b'/><origin xyz='0 0 .3'/>"
            f"<axis xyz='0 1 0'/>{joint}</joint>{more}</robot>\n")


MODELS = {
    # what loads
    "ball.xml": free("<geom type='sphere' size='.1' mass='2'/>"),
    "box.xml": free(),
    "capsule.xml": free("<geom type='capsule' size='.05 .1' mass='1'/>"),
    "cylinder.xml": free("<geom type='cylinder' size='.05 .1' mass='1'/>"),
    "ellipsoid.xml": free("<geom type='ellipsoid' size='.05 .1 .2' mass='1'/>"),
    "arm.xml": arm(),
    "arm-limits.xml": arm("range='-30 30' limited='true'", "range='-60 10' limited='true'"),
    "arm-springs.xml": arm("stiffness='3' damping='.1' armature='.01'", "stiffness='1' frictionloss='.05'"),
    "arm-ball-joint.xml": arm("type='ball'"),
    "arm-slide.xml": arm("type='slide'"),
    "arm-two-joints.xml": mjcf("<body name='b' pos='0 0 1'><joint name='x' type='slide' axis='1 0 0'/>"
                               f"<joint name='y' type='slide' axis='0 1 0'/>{BOX}</body>"),
    "arm-motor.xml": arm(rest="<actuator><motor joint='elbow' gear='2' ctrlrange='-1 1'/></actuator>"),
    "arm-position.xml": arm("damping='.1'", rest="<actuator><position joint='shoulder' kp='20'/></actuator>"
                            "<keyframe><key name='bent' qpos='.3 -.2' ctrl='.1'/></keyframe>"),
    "arm-velocity.xml": arm(rest="<actuator><velocity joint='shoulder' kv='2'/></actuator>"),
    "arm-coupled.xml": arm(rest="<equality><joint joint1='shoulder' joint2='elbow' polycoef='0 .5 0 0 0'/></equality>"),
    "arm-tendon.xml": arm(rest="<tendon><fixed name='t' stiffness='5'><joint joint='shoulder' coef='1'/>"
                          "<joint joint='elbow' coef='-1'/></fixed></tendon>"),
    "arm-degrees.xml": arm("range='-30 30'", before="<compiler angle='degree' autolimits='true'/>"),
    "arm-radians.xml": arm("range='-.5 .5'", before="<compiler angle='radian' autolimits='true'/>"),
    "defaults.xml": arm(before="<default><joint damping='.2'/><geom friction='.4 .01 .001'/></default>"),
    "excluded.xml": arm(rest="<contact><exclude body1='upper' body2='lower'/></contact>"),
    "pair.xml": arm(rest="<contact><pair geom1='floor' geom2='g'/></contact>").replace(
        "<body name='lower' pos='.3 0 0'>", "<body name='lower' pos='.3 0 0'><geom name='g' type='sphere' size='.05' mass='.1'/>"),
    "weld.xml": mjcf(f"<body name='a' pos='0 0 1'><freejoint/>{BOX}</body><body name='b' pos='.5 0 1'><freejoint/>{BOX}</body>",
                     "<equality><weld body1='a' body2='b'/></equality>"),
    "connect.xml": mjcf(f"<body name='a' pos='0 0 1'><freejoint/>{BOX}</body>",
                        "<equality><connect body1='a' anchor='.1 0 0'/></equality>"),
    "no-gravity.xml": free(rest="<option gravity='0 0 0'/>"),
    "hfield.xml": mjcf(f"<geom type='hfield' hfield='h'/><body name='b' pos='0 0 1'><freejoint/>{BOX}</body>",
                       before="<asset><hfield name='h' nrow='3' ncol='3' size='1 1 .1 .1' elevation='0 1 0 1 0 1 0 1 0'/></asset>"),
    "mesh.xml": mjcf("<body name='b' pos='0 0 1'><freejoint/><geom type='mesh' mesh='m' mass='1'/></body>",
                     before="<asset><mesh name='m' vertex='0 0 0 .1 0 0 0 .1 0 0 0 .1'/></asset>"),
    "arm.urdf": urdf(),
    "prismatic.urdf": urdf(kind="prismatic"),
    "continuous.urdf": urdf("", kind="continuous"),
    "fixed-link.urdf": urdf(links=("a", "b", "c"), more="<joint name='k' type='fixed'><parent link='b'/><child link='c'/></joint>"),
    "mimic.urdf": urdf(links=("a", "b", "c"),
                       more="<joint name='k' type='revolute'><parent link='b'/><child link='c'/><axis xyz='0 1 0'/>"
                       "<limit lower='-1' upper='1' effort='5' velocity='2'/><mimic joint='j' multiplier='2'/></joint>"),
    # what is refused, or needs a switch
    "empty.xml": "",
    "not-xml.xml": "<mujoco><worldbody>\n",
    "html.xml": "<html></html>\n",
    "nothing-moves.xml": mjcf(FLOOR),
    "unknown-attribute.xml": free("<geom sise='.1'/>"),
    "negative-mass.xml": free("<geom type='sphere' size='.1' mass='-1'/>"),
    "no-mass.xml": free("<geom type='sphere' size='.1' mass='0'/>"),
    "muscle.xml": arm(rest="<actuator><muscle joint='elbow'/></actuator>"),
    "spatial-tendon.xml": mjcf(f"<site name='s'/><body name='b' pos='0 0 1'><freejoint/>{BOX}<site name='t'/></body>",
                               "<tendon><spatial stiffness='1'><site site='s'/><site site='t'/></spatial></tendon>"),
    "fluid.xml": free(rest="<option density='1.2' viscosity='.1'/>"),
    "flex.xml": mjcf(FLOOR, "<worldbody><flexcomp name='f' type='grid' count='3 3 1' spacing='.1 .1 .1' mass='1' radius='.01'/></worldbody>"),
    "missing-mesh.xml": mjcf("<body><freejoint/><geom type='mesh' mesh='m'/></body>",
                             before="<asset><mesh name='m' file='none.stl'/></asset>"),
    "two-roots.urdf": urdf(links=("a", "b", "c")),
    "no-limit.urdf": urdf(""),
    "loop.urdf": urdf(more="<joint name='k' type='revolute'><parent link='b'/><child link='a'/><limit effort='1' velocity='1'/></joint>"),
    "impossible-inertia.urdf": urdf().replace("izz='.01'", "izz='.1'"),
    "swapped-limits.urdf": urdf("<limit lower='1' upper='-1' effort='5' velocity='2'/>"),
    "outside.urdf": urdf().replace("<box size='.1 .1 .1'/>", "<mesh filename='/etc/passwd'/>"),
    "package.urdf": urdf().replace("<box size='.1 .1 .1'/>", "<mesh filename='package://none/a.stl'/>"),
}

CAMPAIGN = """name = "guard"
contenders = ["mujoco-euler", "bullet-si-f64", "ode-step"]
timesteps_ms = [4, 1]
reference_ms = "1/4"
[timing]
rounds = 2
batch_ms = 1
[[system]]
name = "arm"
model = "./arm.xml"
control = "hold"
duration_s = 0.512
pieces = 2
piece_ms = 64
timing_ms = [1]
measures = ["raw_speed", "consistency", "violation"]
[[system]]
name = "box"
model = "./box.xml"
duration_s = 0.512
pieces = 2
piece_ms = 64
timing_ms = [1]
measures = ["raw_speed", "consistency", "agreement"]
[[system]]
name = "planar-chain"
duration_s = 0.512
pieces = 2
piece_ms = 64
timing_ms = [1]
measures = ["raw_speed", "consistency", "truth", "drift"]
"""

# What is planted into a campaign, as pairs of a text and its replacement; the first of a pair has to be there.
CAMPAIGN_FAULTS = {
    "no-name": ('name = "guard"\n', ""),
    "unknown-key": ('name = "guard"', 'name = "guard"\ntimesteps = [1]'),
    "unknown-contender": ("ode-step", "ode-stop"),
    "contender-twice": ("ode-step", "mujoco-euler"),
    "no-contender": ('["mujoco-euler", "bullet-si-f64", "ode-step"]', "[]"),
    "unknown-setting": ("ode-step", "ode-step,speed=3"),
    "setting-out-of-range": ("bullet-si-f64", "bullet-si-f64,iterations=-1"),
    "zero-timestep": ("[4, 1]", "[0]"),
    "timestep-twice": ("[4, 1]", "[1, 1]"),
    "text-timestep": ("[4, 1]", '["fast"]'),
    "no-timestep": ("[4, 1]", "[]"),
    "reference-too-coarse": ('"1/4"', "16"),
    "unknown-measure": ('"drift"', '"drifts"'),
    "measure-without-its-table": ('"drift"', '"transfer"'),
    "measure-that-the-system-lacks": ('"drift"', '"grasp"'),
    "no-measure": ('["raw_speed", "consistency", "violation"]', "[]"),
    "no-system": ("[[system]]", "[[sistem]]"),
    "system-twice": ('name = "box"', 'name = "arm"'),
    "missing-model": ("./box.xml", "./none.xml"),
    "outside-model": ("./box.xml", "/etc/passwd"),
    "refused-model": ("./box.xml", "./flex.xml"),
    "negative-duration": ("duration_s = 0.512", "duration_s = -1"),
    "odd-duration": ("duration_s = 0.512", "duration_s = 0.0013"),
    "odd-piece": ("piece_ms = 64", "piece_ms = 0.3"),
    "text-contacts": ('control = "hold"', 'contacts = "no"'),
    "no-toml": ("[[system]]", "[[system"),
    "unknown-control": ('"hold"', '"dance"'),
    "unknown-keyframe": ('control = "hold"', 'keyframe = "none"'),
    "no-rounds": ("rounds = 2", "rounds = 0"),
    "nan": ('"1/4"', "nan"),
}
