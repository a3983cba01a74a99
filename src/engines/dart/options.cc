#include "options.h"

#include "engines/adapter.h"

namespace assay::dartsim {

std::vector<Setting> declared_settings() {
  std::vector<Setting> settings = {
      {"lcp",
       "dantzig",
       "",
       "solver of contacts and joint limits: dantzig: direct, projected Gauss-Seidel where it fails (DART's default); "
       "pgs: only projected Gauss-Seidel",
       {"dantzig", "pgs"}},
      {"pgs_iterations", 50LL, "", "iterations of projected Gauss-Seidel (DART's own default is 30)", {}, 1.0, 1e6},
      {"pgs_tolerance",
       1e-3,
       "",
       "projected Gauss-Seidel ends when no impulse changes by more than this part of it",
       {},
       0.0,
       1.0},
      {"contact_erp",
       0.2,
       "",
       "part of a contact's depth that one step corrects (DART's own default is 0.01)",
       {},
       0.0,
       1.0},
      {"contact_max_correcting_velocity",
       0.1,
       "m/s",
       "cap of the speed that pushes bodies apart; 0: none (DART's own default is 0.001). Without it a body leaves an "
       "impact with up to contact_erp of its speed, by the impact's phase within a step",
       {},
       0.0,
       1e9},
      {"contact_cfm", 1e-5, "", "softness of contacts, relative to the diagonal of the system", {}, 1e-9, 1.0},
      {"friction_direction",
       "slip",
       "",
       "first direction of a contact's friction pyramid: slip: along the relative velocity that friction has to take "
       "away in the step; world: fixed by the normal (DART's own), with friction up to 1.41 times too strong between "
       "its sides",
       {"slip", "world"}},
      {"limit_cfm", 1e-9, "", "softness of joint limits, relative to the diagonal of the system", {}, 1e-9, 1.0},
      {"limit_max_correcting_velocity",
       0.1,
       "rad/s",
       "cap of the speed, of slides in m/s, that moves a joint back which is beyond its limit; 0: none (DART's own "
       "default "
       "is 10). Without it the whole excess goes in one step, and the joint keeps that speed",
       {},
       0.0,
       1e9},
      {"pd",
       "native",
       "",
       "joint springs and dampers: native: DART's own, implicit in the step; explicit: torque from the state at the "
       "step's start",
       {"native", "explicit"}},
  };
  add_restitution(settings, "");
  give_role(settings, "pgs_iterations", SettingRole::kIterations, {{"lcp", "pgs"}});
  give_role(settings, "pgs_tolerance", SettingRole::kTolerance, {{"lcp", "pgs"}});
  give_role(settings, "contact_erp", SettingRole::kContactSoftness);
  return settings;
}

Options read_options(const Settings& s) {
  return {.timestep = s.timestep,
          .pgs = is(s, "lcp", "pgs"),
          .pgs_iterations = integer(s, "pgs_iterations"),
          .pgs_tolerance = s.get<double>("pgs_tolerance"),
          .contact_erp = s.get<double>("contact_erp"),
          .contact_max_correcting_velocity = s.get<double>("contact_max_correcting_velocity"),
          .contact_cfm = s.get<double>("contact_cfm"),
          .limit_cfm = s.get<double>("limit_cfm"),
          .limit_max_correcting_velocity = s.get<double>("limit_max_correcting_velocity"),
          .along_slip = is(s, "friction_direction", "slip"),
          .restitution = restitution(s),
          .native_pd = is(s, "pd", "native")};
}

}  // namespace assay::dartsim
