// What a fit may change: each parameter is a typed change of the model, of its drives or of a contender's settings.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "controls/changes/change.h"
#include "engines/registry.h"
#include "match/config.h"
#include "model/model.h"

namespace assay::match {

// One number. The optimiser sees it as a coordinate: (value - nominal) / step, or with `log` ln(value / nominal) /
// step, so that 0 is the model's own and 1 an expected deviation.
//
// As written: KIND or KIND:ELEMENT, KIND.COMPONENT:ELEMENT for one number of several:
//   damping, dry_friction, armature, stiffness   of hinges and slides; N m s/rad, N m, kg m^2, N m/rad (slides: N)
//   mass                of a body, kg; its inertia scales with it
//   centre.x .y .z      of mass, moved in body axes, m
//   inertia.xx .yy .zz .xy .xz .yz   log-Cholesky coordinates of the pseudo-inertia about the model's own, so that
//                       every value is a body that can be: xx is half the logarithm of the factor of the second moment
//                       of mass along x (Rucker and Wensing, Smooth parameterization of rigid-body inertia, 2022)
//   gravity.x .y .z     in world axes, m/s^2
//   ground              height of the world's shapes, m
//   encoder             what a hinge or slide reads more, rad or m
//   gear                factor of the torque
//   delay               of torques and targets, s
//   drive_stiffness, drive_damping   factors
//   friction            of all contacts, the model's largest coefficient
//   softness            the setting by which the contender measures it (SettingRole::kContactSoftness); where there are
//                       several, softness:SETTING
//   restitution         likewise what an impact gives back (SettingRole::kContactRebound)
//   set:NAME            any setting of the contender that is a number
struct Parameter {
  std::string name;
  ChangeKind kind = ChangeKind::kDamping;
  std::string element;  // joint, body or setting
  int component = 0;    // of those with several
  std::string unit;
  double nominal = 0;           // the model's
  double lower = 0, upper = 0;  // inclusive
  double step = 1;              // expected deviation, of the logarithm with `log`
  bool log = false;

  double coordinate(double value) const;
  double value(double coordinate) const;
};

// What sizes parameters that the model has at zero.
struct MotionScales {
  std::vector<double> torque;  // by hinge and slide: what acts on it, Nm or N
  std::vector<double> speed;   // rad/s or m/s
  std::vector<bool> logged;    // whether it was measured
  std::vector<bool> flying;    // by body: measured, and free
  bool driven = false;         // torques or targets of a log act
  bool drives = false;         // PD drives
};
MotionScales motion_scales(const Model& model, const std::vector<struct MeasuredLog>& logs, const MatchConfig& config);

// Parameters that `requests` name, or a default set, for this contender. One that the contender or the model cannot
// have is left out, with a sentence in `notes`, where it is of the default set or of all elements; else InputError.
std::vector<Parameter> choose_parameters(const Model& model, const ResolvedContender& contender,
                                         const std::vector<FitRequest>& requests, const MotionScales& scales,
                                         std::vector<std::string>& notes);

// A candidate as a worker takes it.
struct Candidate {
  std::vector<RunChange> changes;               // of the model and its drives
  std::map<std::string, std::string> settings;  // of the contender
};
Candidate candidate_of(const Model& model, const std::vector<Parameter>& parameters, std::span<const double> values);

// Mass, centre of mass and inertia of a body with log-Cholesky coordinates about its own: `inertia` as in Parameter,
// `centre` the shift in body axes.
Mat3 inertia_of(const Body& body, double mass_factor, const std::array<double, 6>& inertia);

}  // namespace assay::match
