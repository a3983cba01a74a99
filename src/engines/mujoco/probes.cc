// What a release of MuJoCo does in small scenes of one mechanism each, through its own parser and its own API alone: a
// program that setup/releases.sh compiles for each release, and `assay bisect` compares between two of them
// (docs/releases.md). It prints a line "PROBE<tab>CONDITION<tab>QUANTITY<tab>UNIT<tab>VALUE" for each value.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <mujoco/mujoco.h>

namespace {

std::string number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

void tell(const char* probe, const std::string& condition, const char* quantity, const char* unit, double value) {
  std::printf("%s\t%s\t%s\t%s\t%s\n", probe, condition.c_str(), quantity, unit, number(value).c_str());
}

// A compiled scene at its start. A scene that a release refuses ends the program with MuJoCo's words.
struct Scene {
  explicit Scene(const std::string& inside) {
    char error[1000] = "";
    mjSpec* spec = mj_parseXMLString(("<mujoco>" + inside + "</mujoco>").c_str(), nullptr, error, sizeof error);
    model = spec == nullptr ? nullptr : mj_compile(spec, nullptr);
    if (model == nullptr) {
      std::fprintf(stderr, "%s\n", spec == nullptr ? error : mjs_getError(spec));
      std::exit(1);
    }
    mj_deleteSpec(spec);
    data = mj_makeData(model);
  }
  ~Scene() {
    mj_deleteData(data);
    mj_deleteModel(model);
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  void run(double seconds) {
    const int steps = static_cast<int>(std::lround(seconds / model->opt.timestep));
    for (int i = 0; i < steps; ++i) mj_step(model, data);
  }
  double kinetic_energy() {
    mj_forward(model, data);
    std::vector<mjtNum> momentum(static_cast<size_t>(model->nv));
    mj_mulM(model, data, momentum.data(), data->qvel);
    double twice = 0;
    for (int i = 0; i < model->nv; ++i) twice += momentum[static_cast<size_t>(i)] * data->qvel[i];
    return twice / 2;
  }
  double energy() {
    const double kinetic = kinetic_energy();
    double potential = 0;
    for (int i = 1; i < model->nbody; ++i) {
      for (int k = 0; k < 3; ++k) potential -= model->body_mass[i] * model->opt.gravity[k] * data->xipos[3 * i + k];
    }
    return kinetic + potential;
  }

  mjModel* model = nullptr;
  mjData* data = nullptr;
};

const std::vector<std::pair<const char*, int>> kIntegrators = {
    {"Euler", mjINT_EULER}, {"RK4", mjINT_RK4}, {"implicitfast", mjINT_IMPLICITFAST}, {"implicit", mjINT_IMPLICIT}};

// A body with three unequal moments, spun about an axis near the middle one, with nothing acting on it.
void free_flight() {
  for (const auto& [name, integrator] : kIntegrators) {
    Scene scene(R"(<option timestep="0.005" gravity="0 0 0"/><worldbody><body pos="0 0 1"><freejoint/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.02 0.028"/></body></worldbody>)");
    scene.model->opt.integrator = integrator;
    const double spin[3] = {0.2, 8, 0.2};
    for (int i = 0; i < 3; ++i) scene.data->qvel[3 + i] = spin[i];
    const double before = scene.kinetic_energy();
    scene.run(10);
    tell("free flight", name, "kinetic energy after 10 s at 5 ms, relative change", "1",
         scene.kinetic_energy() / before - 1);
  }
}

// Two links that swing in a plane, without damping.
void joints() {
  for (const auto& [name, integrator] : kIntegrators) {
    Scene scene(R"(<option timestep="0.002"/><worldbody><body pos="0 0 2"><joint type="hinge" axis="0 1 0"/>
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="1"/><body pos="0.4 0 0">
      <joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="1"/></body></body>
      </worldbody>)");
    scene.model->opt.integrator = integrator;
    scene.model->opt.disableflags |= mjDSBL_CONTACT;
    const double before = scene.energy();
    scene.run(5);
    tell("joints", name, "energy after 5 s of a double pendulum, change", "J", scene.energy() - before);
  }
  for (const auto& [name, integrator] : kIntegrators) {
    Scene scene(R"(<option timestep="0.002"/><worldbody><body pos="0 0 2">
      <joint type="hinge" axis="0 1 0" damping="0.3" stiffness="2" armature="0.02"/>
      <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="1"/></body></worldbody>)");
    scene.model->opt.integrator = integrator;
    scene.run(0.5);
    tell("joints", name, "angle after 0.5 s with spring, damper and armature", "rad", scene.data->qpos[0]);
  }
}

// A crank, a coupler and a rocker closed by `connect`, driven by its own speed.
void loop() {
  Scene scene(R"(<option timestep="0.002" gravity="0 0 0"/><worldbody>
    <body name="crank" pos="0 0 0"><joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.1" size="0.01" mass="0.2"/>
      <body name="coupler" pos="0 0 0.1"><joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0.3 0 0.1" size="0.01" mass="0.3"/>
      </body></body>
    <body name="rocker" pos="0.3 0 0"><joint type="hinge" axis="0 1 0"/><geom type="capsule" fromto="0 0 0 0 0 0.2" size="0.01" mass="0.3"/></body>
    </worldbody><equality><connect body1="coupler" body2="rocker" anchor="0.3 0 0.1"/></equality>)");
  scene.model->opt.disableflags |= mjDSBL_CONTACT;
  scene.data->qvel[0] = 10;
  scene.data->qvel[1] = -10;
  scene.data->qvel[2] = 5;
  double largest = 0;
  for (int i = 0; i < 1000; ++i) {
    mj_step(scene.model, scene.data);
    double squares = 0;
    for (int k = 0; k < 3 && k < scene.data->nefc; ++k) squares += scene.data->efc_pos[k] * scene.data->efc_pos[k];
    if (i > 100) largest = std::fmax(largest, std::sqrt(squares));
  }
  tell("connect", "four-bar", "largest gap of a turning four-bar", "m", largest);
}

std::string shape(const char* type) {
  const std::string name = type;
  if (name == "sphere") return R"(type="sphere" size="0.1")";
  if (name == "box") return R"(type="box" size="0.1 0.1 0.1")";
  if (name == "mesh") return R"(type="mesh" mesh="hull")";
  if (name == "ellipsoid") return R"(type="ellipsoid" size="0.1 0.08 0.1")";
  return R"(type=")" + name + R"(" size="0.08 0.1")";
}

// Two shapes 1 mm inside each other along the vertical, turned a little about it, and what the detection finds.
void pairs() {
  const std::vector<const char*> shapes = {"sphere", "capsule", "box", "cylinder", "ellipsoid", "mesh"};
  const std::string mesh = R"(<asset><mesh name="hull" vertex="-0.1 -0.1 -0.1 0.1 -0.1 -0.1 0.1 0.1 -0.1 -0.1 0.1 -0.1
    -0.08 -0.08 0.1 0.08 -0.08 0.1 0.08 0.08 0.1 -0.08 0.08 0.1"/></asset>)";
  const auto height = [](const std::string& name) { return name == "capsule" ? 0.18 : 0.1; };
  const auto detect = [](Scene& scene, const std::string& pair) {
    mj_forward(scene.model, scene.data);
    double deepest = 0, moment = 0;
    for (int i = 0; i < scene.data->ncon; ++i) {
      const mjContact& contact = scene.data->contact[i];
      deepest = std::fmin(deepest, contact.dist);
      for (int k = 0; k < 2; ++k) moment += contact.pos[k] * contact.pos[k];
    }
    tell("contact pairs", pair, "contacts", "1", scene.data->ncon);
    tell("contact pairs", pair, "smallest distance", "m", deepest);
    tell("contact pairs", pair, "sum of squared distances of points from the axis", "m^2", moment);
  };
  for (size_t a = 0; a < shapes.size(); ++a) {
    Scene on_plane(mesh + R"(<worldbody><geom type="plane" size="5 5 1"/><body pos="0 0 )" +
                   number(height(shapes[a]) - 0.001) + R"("><freejoint/><geom )" + shape(shapes[a]) +
                   "/></body></worldbody>");
    detect(on_plane, std::string("plane and ") + shapes[a]);
    for (size_t b = a; b < shapes.size(); ++b) {
      Scene scene(mesh + R"(<worldbody><body><geom )" + shape(shapes[a]) +
                  R"(/></body><body euler="0 0 20" pos="0.002 0.003 )" +
                  number(height(shapes[a]) + height(shapes[b]) - 0.001) + R"("><freejoint/><geom )" + shape(shapes[b]) +
                  "/></body></worldbody>");
      detect(scene, std::string(shapes[a]) + " and " + shapes[b]);
    }
  }
  // 15 mm apart with margins of 10 mm each: the larger of both does not reach, their sum does
  Scene margins(R"(<worldbody><geom type="sphere" size="0.1" margin="0.01"/><body pos="0 0 0.215"><freejoint/>
    <geom type="sphere" size="0.1" margin="0.01"/></body></worldbody>)");
  mj_forward(margins.model, margins.data);
  tell("margins", "10 mm each, surfaces 15 mm apart", "contacts", "1", margins.data->ncon);
}

void limits() {
  Scene scene(R"(<option timestep="0.002"/><worldbody><body pos="0 0 1">
    <joint type="hinge" axis="0 1 0" limited="true" range="-10 10"/>
    <geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.03" mass="1"/></body></worldbody>)");
  scene.run(3);
  tell("limits", "hinge under its weight", "violation after 3 s", "rad",
       std::fabs(scene.data->qpos[0]) - std::acos(-1.0) / 18);
}

// Four boxes on each other, no two of the same weight, and a ball that rests on them: where solvers are compared.
std::string pile() {
  std::string text = R"(<option timestep="0.002"/><worldbody><geom type="plane" size="5 5 1"/>)";
  for (int i = 0; i < 4; ++i) {
    text += R"(<body pos=")" + number(0.004 * i) + R"( 0 )" + number(0.0995 + 0.199 * i) +
            R"("><freejoint/><geom type="box" size="0.1 0.1 0.1" mass=")" + number(1 + 0.25 * i) + R"("/></body>)";
  }
  return text + R"(<body pos="0.02 0 0.89"><freejoint/><geom type="sphere" size="0.1" mass="1"/></body></worldbody>)";
}

// Forces of the constraints on the bodies.
std::vector<double> forces(int solver, int iterations) {
  Scene scene(pile());
  scene.model->opt.solver = mjSOL_NEWTON;
  scene.model->opt.iterations = 200;
  scene.run(0.1);  // the same state for all
  scene.model->opt.solver = solver;
  scene.model->opt.iterations = iterations;
  scene.model->opt.tolerance = 0;
  scene.model->opt.disableflags |= mjDSBL_WARMSTART;
  mj_forward(scene.model, scene.data);
  return {scene.data->qfrc_constraint, scene.data->qfrc_constraint + scene.model->nv};
}

void solvers() {
  const std::vector<double> exact = forces(mjSOL_NEWTON, 1000);
  const auto error = [&](const std::vector<double>& found) {
    double squares = 0, scale = 0;
    for (size_t i = 0; i < exact.size(); ++i) {
      squares += (found[i] - exact[i]) * (found[i] - exact[i]);
      scale += exact[i] * exact[i];
    }
    return std::sqrt(squares / scale);
  };
  for (const auto& [name, solver] :
       {std::pair{"PGS", mjSOL_PGS}, std::pair{"CG", mjSOL_CG}, std::pair{"Newton", mjSOL_NEWTON}}) {
    for (const int iterations : {2, 20, 200}) {
      tell("solver", std::string(name) + ", " + std::to_string(iterations) + " iterations",
           "error of the forces in a pile, relative", "1", error(forces(solver, iterations)));
    }
  }
}

// A box thrown over the ground, and one that stands on it.
void friction() {
  Scene scene(
      R"(<option timestep="0.002"/><worldbody><geom type="plane" size="5 5 1"/><body pos="0 0 0.0999"><freejoint/>
    <geom type="box" size="0.1 0.1 0.1" mass="1" friction="0.5"/></body></worldbody>)");
  scene.data->qvel[0] = 2;
  scene.run(1.5);
  tell("friction", "box thrown at 2 m/s", "way", "m", scene.data->qpos[0]);
  tell("friction", "box thrown at 2 m/s", "depth at rest", "m", 0.1 - scene.data->qpos[2]);
}

void defaults() {
  Scene scene(R"(<worldbody><body><freejoint/><geom type="sphere" size="0.1"/></body></worldbody>)");
  const mjOption& option = scene.model->opt;
  for (const auto& [name, value] :
       std::vector<std::pair<const char*, double>>{{"timestep", option.timestep},
                                                   {"integrator", option.integrator},
                                                   {"solver", option.solver},
                                                   {"iterations", option.iterations},
                                                   {"tolerance", option.tolerance},
                                                   {"ls_iterations", option.ls_iterations},
                                                   {"ls_tolerance", option.ls_tolerance},
                                                   {"cone", option.cone},
                                                   {"jacobian", option.jacobian},
                                                   {"impratio", option.impratio},
                                                   {"disableflags", option.disableflags},
                                                   {"enableflags", option.enableflags},
                                                   {"solref 1", scene.model->geom_solref[0]},
                                                   {"solref 2", scene.model->geom_solref[1]},
                                                   {"solimp 1", scene.model->geom_solimp[0]},
                                                   {"solimp 2", scene.model->geom_solimp[1]},
                                                   {"solimp 3", scene.model->geom_solimp[2]},
                                                   {"condim", scene.model->geom_condim[0]},
                                                   {"friction 1", scene.model->geom_friction[0]}}) {
    tell("defaults", "a file that says nothing", name, "", value);
  }
}

}  // namespace

int main() {
  std::printf("version\t\t\t\t%s\n", mj_versionString());
  free_flight();
  joints();
  loop();
  pairs();
  limits();
  solvers();
  friction();
  defaults();
}
