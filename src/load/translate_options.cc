// What belongs to the file as a whole: elements without a counterpart, gravity, options.
#include <fmt/format.h>

#include "base/text.h"
#include "load/translator.h"

namespace assay {
namespace {

// Options that the file sets but the contender decides: names of those that differ from MuJoCo's default.
std::vector<std::string> changed_options(const mjOption& option, const mjOption& standard) {
  std::vector<std::string> names;
  const auto compare = [&](const char* name, auto value, auto normal) {
    if (value != normal) names.emplace_back(name);
  };
  compare("timestep", option.timestep, standard.timestep);
  compare("integrator", option.integrator, standard.integrator);
  compare("solver", option.solver, standard.solver);
  compare("cone", option.cone, standard.cone);
  compare("jacobian", option.jacobian, standard.jacobian);
  compare("impratio", option.impratio, standard.impratio);
  compare("iterations", option.iterations, standard.iterations);
  compare("tolerance", option.tolerance, standard.tolerance);
  compare("ls_iterations", option.ls_iterations, standard.ls_iterations);
  compare("ls_tolerance", option.ls_tolerance, standard.ls_tolerance);
  compare("noslip_iterations", option.noslip_iterations, standard.noslip_iterations);
  compare("noslip_tolerance", option.noslip_tolerance, standard.noslip_tolerance);
  compare("ccd_iterations", option.ccd_iterations, standard.ccd_iterations);
  compare("ccd_tolerance", option.ccd_tolerance, standard.ccd_tolerance);
  compare("sleep_tolerance", option.sleep_tolerance, standard.sleep_tolerance);
  constexpr int kNumericalDisables = mjDSBL_WARMSTART | mjDSBL_REFSAFE | mjDSBL_MIDPHASE | mjDSBL_EULERDAMP |
                                     mjDSBL_AUTORESET | mjDSBL_NATIVECCD | mjDSBL_ISLAND | mjDSBL_MULTICCD;
  for (int bit = 0; bit < mjNDISABLE; ++bit) {
    const int changed = (option.disableflags ^ standard.disableflags) & kNumericalDisables;
    if ((changed & (1 << bit)) != 0) names.push_back(fmt::format("flag {}", mjDISABLESTRING[bit]));
  }
  for (int bit = 0; bit < mjNENABLE; ++bit) {
    const int changed = (option.enableflags ^ standard.enableflags) & ~mjENBL_OVERRIDE;
    if ((changed & (1 << bit)) != 0) names.push_back(fmt::format("flag {}", mjENABLESTRING[bit]));
  }
  return names;
}

}  // namespace

void Translator::refuse_foreign_elements() {
  for (int f = 0; f < m_->nflex; ++f) {
    unsupported(mjOBJ_FLEX, f, "is deformable, and only rigid bodies are supported", "remove it",
                "fixes its points to their parent bodies");
  }
  if (m_->nplugin > 0) {
    unsupported(fmt::format("{} MuJoCo plugins act in it, which is not supported", m_->nplugin),
                "remove the plugin elements", "leaves their forces out");
  }
  for (int b = 1; b < m_->nbody; ++b) {
    if (m_->body_gravcomp[b] != 0 && !disabled(mjDSBL_GRAVITY)) {
      unsupported(mjOBJ_BODY, b, "has gravity compensation, which is not supported", "remove gravcomp",
                  "lets gravity act on it in full");
    }
  }
  if (m_->opt.density != 0 || m_->opt.viscosity != 0) {
    std::vector<std::string> medium;
    if (m_->opt.density != 0) medium.push_back(fmt::format("density {}", shortest(m_->opt.density)));
    if (m_->opt.viscosity != 0) medium.push_back(fmt::format("viscosity {}", shortest(m_->opt.viscosity)));
    unsupported(fmt::format("a medium with {} (<option>) surrounds the bodies, and fluid forces are not supported",
                            join(medium, " and ")),
                "set density and viscosity to 0", "leaves the fluid's forces out, among them drag");
  }
  if ((m_->opt.enableflags & mjENBL_OVERRIDE) != 0) {
    unsupported("contact override is not supported", "remove <flag override> and set friction on the geoms",
                "takes friction and margins from the geoms instead");
  }
  if (m_->nsensor > 0) note(fmt::format("{} sensors are left out: they do not act on the motion", m_->nsensor));
}

void Translator::translate_options() {
  if (!disabled(mjDSBL_GRAVITY)) {
    model_.gravity = vec3(m_->opt.gravity);
  } else {
    model_.gravity.setZero();
    note("gravity is off: the file disables it");
  }
  const SpecPtr standard(mj_makeSpec());
  const std::vector<std::string> changed = changed_options(m_->opt, standard->option);
  if (!changed.empty()) {
    note(fmt::format("the file's MuJoCo options are ignored, because the contender decides them: {}",
                     join(changed, ", ")));
  }
}

}  // namespace assay
