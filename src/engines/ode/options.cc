#include "options.h"

#include "engines/adapter.h"

namespace assay::ode {

std::vector<Setting> declared_settings() {
  std::vector<Setting> settings = {
      {"solver",
       "quick",
       "",
       "quick: dWorldQuickStep, iterative (SOR); exact: dWorldStep, Dantzig's method on all rows",
       {"quick", "exact"},
       {},
       {}},
      {"iterations", 50LL, "", "SOR iterations of the quick solver (ODE's own default is 20)", {}, 1.0, 1e6},
      {"over_relaxation", 1.3, "", "SOR over-relaxation of the quick solver", {}, 0.01, 1.99},
      {"reorder_seed",
       0LL,
       "",
       "the quick solver shuffles its rows at random; step n of a run is seeded with this and n, so a run can be "
       "repeated and continued from any state",
       {},
       0.0,
       4294967295.0},
      {"erp", 0.2, "", "part of a joint's position error that one step corrects", {}, 0.0, 1.0},
      {"cfm",
       1e-10,
       "s/kg",
       "softness (constraint force mixing) of joints; s/(kg m^2) for their rotational rows",
       {},
       0.0,
       1.0},
      {"limit_erp", 0.2, "", "part of a joint limit's violation that one step corrects", {}, 0.0, 1.0},
      {"limit_cfm", 1e-10, "s/(kg m^2)", "softness of joint limits", {}, 0.0, 1.0},
      {"pd",
       "explicit",
       "",
       "springs and dampers of joints: explicit: a torque from the state at the step's start; native: the joint's stop "
       "with the ERP and CFM that make it a spring and damper, which is implicit",
       {"explicit", "native"},
       {},
       {}},
      {"contact_erp", 0.2, "", "part of a contact's depth that one step corrects", {}, 0.0, 1.0},
      {"contact_cfm", 1e-10, "s/kg", "softness of contacts", {}, 0.0, 1.0},
      {"contact_max_correcting_velocity",
       0.1,
       "m/s",
       "cap of the speed that pushes bodies apart; 0: none (ODE's own default; its demonstrations take 0.1). Without "
       "it a "
       "body leaves an impact with up to contact_erp of its speed, by the impact's phase within a step",
       {},
       0.0,
       1e9},
      {"contact_surface_layer", 0.0, "m", "depth to which shapes may sink before they are pushed apart", {}, 0.0, 1.0},
      {"friction_direction",
       "world",
       "",
       "first direction of a contact's friction pyramid: world: fixed by the normal (ODE's way); slip: along the "
       "relative velocity at the step's start, which makes sliding friction the same in every direction",
       {"world", "slip"},
       {},
       {}},
      {"max_contacts",
       4LL,
       "",
       "contact points a pair of shapes may have; capsules never have more than 2; of more the deepest and those "
       "farthest apart stay",
       {},
       1.0,
       double{kMaxContacts}},
      {"broadphase",
       "sap",
       "",
       "ODE's space: simple (all pairs), hash, or sap (sweep and prune)",
       {"simple", "hash", "sap"},
       {},
       {}},
      {"lent_share",
       0.0,
       "",
       "part of a body's mass and inertia that each massless body before it borrows; 0: 1 % with the quick solver, "
       "which "
       "converges slowly with less, 0.001 % with the exact one",
       {},
       0.0,
       kLargestLentShare},
      {"ignore_lcp_failures", false, "",
       "go on when the exact solver reports that it gave up on a step's constraints, instead of failing the run"},
      {"finite_rotation", false, "",
       "turn bodies by the exact finite rotation of a step instead of a normalised first-order update"},
      {"gyroscopic", true, "", "gyroscopic torque, which ODE computes implicitly; off is wrong for asymmetric bodies"},
  };
  add_contact_compliance(settings, "contact_erp, contact_cfm and their cap");
  add_restitution(settings, "ODE's own default is 0");
  give_role(settings, "iterations", SettingRole::kIterations, {{"solver", "quick"}});
  give_role(settings, "contact_erp", SettingRole::kContactSoftness);
  return settings;
}

Options read_options(const Settings& s) {
  const double share = s.get<double>("lent_share");
  const ContactCompliance compliance = contact_compliance(s);
  const double own_share = is(s, "solver", "exact") ? kLentShareDirect : kLentShare;
  return {.timestep = s.timestep,
          .exact = is(s, "solver", "exact"),
          .iterations = integer(s, "iterations"),
          .over_relaxation = s.get<double>("over_relaxation"),
          .seed = static_cast<std::uint32_t>(s.get<long long>("reorder_seed")),
          .erp = s.get<double>("erp"),
          .cfm = s.get<double>("cfm"),
          .limit_erp = s.get<double>("limit_erp"),
          .limit_cfm = s.get<double>("limit_cfm"),
          .native_springs = is(s, "pd", "native"),
          .contact_erp = compliance.is_set() ? compliance.erp(s.timestep) : s.get<double>("contact_erp"),
          .contact_cfm = compliance.is_set() ? compliance.cfm(s.timestep) : s.get<double>("contact_cfm"),
          .max_correcting_velocity = compliance.is_set() ? 0 : s.get<double>("contact_max_correcting_velocity"),
          .surface_layer = s.get<double>("contact_surface_layer"),
          .along_slip = is(s, "friction_direction", "slip"),
          .max_contacts = integer(s, "max_contacts"),
          .broadphase = s.get<std::string>("broadphase"),
          .lent_share = share > 0 ? share : own_share,
          .compliance = compliance,
          .restitution = restitution(s),
          .ignore_lcp_failures = s.get<bool>("ignore_lcp_failures"),
          .finite_rotation = s.get<bool>("finite_rotation"),
          .gyroscopic = s.get<bool>("gyroscopic")};
}

}  // namespace assay::ode
