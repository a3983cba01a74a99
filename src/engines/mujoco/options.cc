#include "options.h"

#include <algorithm>
#include <tuple>
#include <utility>

#include "engines/adapter.h"
#include "release.h"

namespace assay::mujoco {
namespace {

constexpr std::array<std::pair<const char*, mjtSolver>, 3> kSolvers = {
    {{"newton", mjSOL_NEWTON}, {"cg", mjSOL_CG}, {"pgs", mjSOL_PGS}}};

constexpr std::array<std::pair<const char*, mjtJacobian>, 3> kJacobians = {
    {{"sparse", mjJAC_SPARSE}, {"dense", mjJAC_DENSE}, {"auto", mjJAC_AUTO}}};

constexpr std::array kSolverNames = {"projected Gauss-Seidel", "conjugate gradients", "Newton"};  // by mjtSolver

// A compliant contact's impedance is the least that MuJoCo has (compliant_reference), and that of its friction follows
// from it by impratio: with this factor friction is as stiff as with the contacts' own impedance of 0.9.
constexpr double kFrictionOfCompliance = (0.9 / (1 - 0.9)) / (mjMINIMP / (1 - mjMINIMP));

template <typename Table>
auto choice(const Table& table, const std::string& name) {
  return std::ranges::find(table, name, [](const auto& entry) { return std::string(entry.first); })->second;
}

template <typename Table>
std::vector<std::string> names(const Table& table) {
  std::vector<std::string> found;
  for (const auto& entry : table) found.emplace_back(entry.first);
  return found;
}

}  // namespace

std::vector<Setting> declared_settings() {
  std::vector<Setting> settings = {
      {.name = "integrator",
       .default_value = std::string("euler"),
       .unit = "",
       .meaning = "semi-implicit Euler, Runge-Kutta 4, implicit in velocity without or with Coriolis derivatives, or "
                  "the discrete step map that also takes stiffness implicitly",
       .choices = names(kIntegrators)},
      {.name = "solver",
       .default_value = std::string("newton"),
       .unit = "",
       .meaning = "constraint solver",
       .choices = {"newton", "cg", "pgs"}},
      {.name = "jacobian",
       .default_value = std::string("sparse"),
       .unit = "",
       .meaning = "form of the constraint Jacobian; auto is MuJoCo's own: dense below 60 DOF and sparse above",
       .choices = {"sparse", "dense", "auto"}},
      {.name = "cone",
       .default_value = std::string("pyramidal"),
       .unit = "",
       .meaning = "friction cone: a pyramid inside Coulomb's cone (MuJoCo's default) or the cone itself",
       .choices = {"pyramidal", "elliptic"}},
      {.name = "pd",
       .default_value = std::string("native"),
       .unit = "",
       .meaning =
           "springs, dampers and actuators: MuJoCo's own, with what the integrator takes implicitly, or explicit: "
           "a torque from the state at the step's start",
       .choices = {"native", "explicit"}},
      {.name = "iterations",
       .default_value = 100LL,
       .unit = "",
       .meaning = "most iterations of the constraint solver in a step",
       .minimum = 1},
      {.name = "tolerance",
       .default_value = 1e-8,
       .unit = "",
       .meaning = "scaled improvement below which the constraint solver stops",
       .minimum = 0},
      {.name = "ls_iterations",
       .default_value = 50LL,
       .unit = "",
       .meaning = "most iterations of the line search of newton and cg",
       .minimum = 1},
      {.name = "ls_tolerance",
       .default_value = 0.01,
       .unit = "",
       .meaning = "relative tolerance of the line search of newton and cg",
       .minimum = 0},
      {.name = "noslip_iterations",
       .default_value = 0LL,
       .unit = "",
       .meaning = "iterations of the extra solver that takes slip out of friction; 0: off",
       .minimum = 0},
      {.name = "impratio",
       .default_value = 1.0,
       .unit = "",
       .meaning = "ratio of frictional to normal impedance of contacts; larger creeps less; with the pyramid it "
                  "stiffens contacts too",
       .minimum = 1e-6},
      {.name = "warmstart",
       .default_value = true,
       .unit = "",
       .meaning = "start the constraint solver from the last step's accelerations"},
      {.name = "islands",
       .default_value = kIslandsByDefault,
       .unit = "",
       .meaning = "solve groups of bodies that do not touch each other apart"},
      {.name = "euler_damping",
       .default_value = true,
       .unit = "",
       .meaning = "integrator euler takes the damping of joints implicitly"},
      {.name = "refsafe",
       .default_value = true,
       .unit = "",
       .meaning = "raise time constants of contacts and limits to two timesteps"},
      {.name = "contact_pairs",
       .default_value = std::string("auto"),
       .unit = "",
       .meaning =
           "how contacts are found: by MuJoCo's broad phase where its filter gives exactly the model's pairs, or "
           "from an explicit list of pairs always",
       .choices = {"auto", "explicit"}},
  };
  // MuJoCo's solref and solimp, one number a setting
  for (const auto& [kind, of, unit] : {std::tuple<std::string, std::string, std::string>{"contact", "of contacts", "m"},
                                       {"limit", "of limits of joints and tendons", "rad or m"},
                                       {"equality", "of couplings, connects and welds", "rad or m"}}) {
    settings.insert(settings.end(), {{.name = kind + "_timeconst",
                                      .default_value = 0.02,
                                      .unit = "s",
                                      .meaning = "time constant " + of + " (solref 1)",
                                      .minimum = 1e-6},
                                     {.name = kind + "_dampratio",
                                      .default_value = 1.0,
                                      .unit = "",
                                      .meaning = "damping ratio " + of + " (solref 2)",
                                      .minimum = 1e-6},
                                     {.name = kind + "_impedance_min",
                                      .default_value = 0.9,
                                      .unit = "",
                                      .meaning = "impedance " + of + " at no violation (solimp 1)",
                                      .minimum = 1e-4,
                                      .maximum = 0.9999},
                                     {.name = kind + "_impedance_max",
                                      .default_value = 0.95,
                                      .unit = "",
                                      .meaning = "impedance " + of + " beyond the width (solimp 2)",
                                      .minimum = 1e-4,
                                      .maximum = 0.9999},
                                     {.name = kind + "_impedance_width",
                                      .default_value = 0.001,
                                      .unit = unit,
                                      .meaning = "violation over which the impedance " + of + " rises (solimp 3)",
                                      .minimum = 0}});
  }
  settings.insert(settings.end(), {{.name = "dry_friction_timeconst",
                                    .default_value = 0.02,
                                    .unit = "s",
                                    .meaning = "time constant of dry friction in joints and tendons (solref 1)",
                                    .minimum = 1e-6},
                                   {.name = "dry_friction_impedance",
                                    .default_value = 0.9,
                                    .unit = "",
                                    .meaning = "impedance of dry friction in joints and tendons (solimp 1); larger "
                                               "creeps less",
                                    .minimum = 1e-4,
                                    .maximum = 0.9999}});
  add_contact_compliance(settings, "the contact_ settings above, each pair from a list (contact_pairs=explicit)",
                         {{"cone", "elliptic"}});
  give_role(settings, "iterations", SettingRole::kIterations);
  give_role(settings, "tolerance", SettingRole::kTolerance);
  give_role(settings, "contact_timeconst", SettingRole::kContactSoftness);
  give_role(settings, "contact_dampratio", SettingRole::kContactRebound);
  return settings;
}

void set_options(const Settings& s, const Vec3& gravity, mjOption& option) {
  option.timestep = s.timestep;
  Eigen::Map<Vec3>(option.gravity) = gravity;
  option.integrator = choice(kIntegrators, s.get<std::string>("integrator"));
  option.solver = choice(kSolvers, s.get<std::string>("solver"));
  option.jacobian = choice(kJacobians, s.get<std::string>("jacobian"));
  option.cone = is(s, "cone", "elliptic") ? mjCONE_ELLIPTIC : mjCONE_PYRAMIDAL;
  option.iterations = integer(s, "iterations");
  option.tolerance = s.get<double>("tolerance");
  option.ls_iterations = integer(s, "ls_iterations");
  option.ls_tolerance = s.get<double>("ls_tolerance");
  option.noslip_iterations = integer(s, "noslip_iterations");
  option.impratio = s.get<double>("impratio");
  if (contact_compliance(s).is_set()) option.impratio *= kFrictionOfCompliance;

  // without the automatic reset a blow-up stays visible instead of starting again from the reference state
  option.disableflags = mjDSBL_AUTORESET;
  if (!s.get<bool>("warmstart")) option.disableflags |= mjDSBL_WARMSTART;
  if (!s.get<bool>("euler_damping")) option.disableflags |= mjDSBL_EULERDAMP;
  if (!s.get<bool>("refsafe")) option.disableflags |= mjDSBL_REFSAFE;
  option.enableflags = 0;
  set_islands(s.get<bool>("islands"), option);
}

bool has_own_actuators(const Settings& s) { return !has_explicit_pd(s); }

bool has_explicit_pd(const Settings& s) { return is(s, "pd", "explicit"); }

const char* solver_text(const Settings& s) { return kSolverNames.at(choice(kSolvers, s.get<std::string>("solver"))); }

Softness softness(const Settings& s, const std::string& kind) {
  const auto number = [&](const char* name) { return s.get<double>(kind + name); };
  Softness result{};
  mj_defaultSolRefImp(result.reference.data(), result.impedance.data());
  result.reference[0] = number("_timeconst");
  result.reference[1] = number("_dampratio");
  result.impedance[0] = number("_impedance_min");
  result.impedance[1] = number("_impedance_max");
  result.impedance[2] = number("_impedance_width");
  return result;
}

// MuJoCo's contact holds f = (-b v - k r - a) / R along its normal, with its acceleration a, R = (1 - d) / d times the
// inverse mass that it reckons with, k = -solref1 / d and b = -solref2 / d for a constant impedance d. So it is a
// spring of k / R and a damper of b / R beside a mass of 1 / R, which the least d makes negligible.
void make_compliant(const ContactCompliance& compliance, double inverse_mass, mjtNum* reference, mjtNum* impedance,
                    mjtNum* friction_reference) {
  constexpr double d = mjMINIMP, R_of_mass = (1 - d) / d;
  const double R = R_of_mass * inverse_mass;
  reference[0] = -compliance.stiffness * R * d;
  reference[1] = -compliance.damping * R * d;
  mjtNum standard[mjNREF] = {}, ignored[mjNIMP] = {};
  mj_defaultSolRefImp(standard, ignored);
  impedance[0] = impedance[1] = d;
  // friction's rate, 2 / (0.95 solref1) with MuJoCo's own impedance
  friction_reference[0] = 0;
  friction_reference[1] = -2 / (0.95 * standard[0]) * d;
}

Softness dry_friction_softness(const Settings& s) {
  Softness result{};
  mj_defaultSolRefImp(result.reference.data(), result.impedance.data());
  result.reference[0] = s.get<double>("dry_friction_timeconst");
  result.impedance[0] = s.get<double>("dry_friction_impedance");
  return result;
}

}  // namespace assay::mujoco
