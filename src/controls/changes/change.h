// A change of one convention of a run: of the model that an engine gets, of the control that drives it, or of the
// contender itself. `assay explain` puts them into one of two contenders, and so can its user.
//
// As text: KIND=VALUE, or KIND:ELEMENT=VALUE where one joint, body or setting is meant and not all.
//
//   contacts=off               no contact pairs
//   self_contacts=off          no contact pairs of two moving bodies
//   friction=0.5               times each pair's coefficient; so below, or `off`, or +X: X is added
//   limits[:JOINT]=off
//   armature[:JOINT]=off       damping, stiffness, dry_friction alike: of hinges, slides and ball joints
//   mass[:BODY]=1.1            kg, the inertia stays; inertia alike
//   inertia:BODY=XX,YY,ZZ,XY,XZ,YZ   about the centre of mass in body axes, kg m^2
//   centre:BODY=X,Y,Z          of mass, moved by that in body axes, m
//   gravity=0.5                or X,Y,Z in world axes, m/s^2
//   ground=+0.001              shapes of the world, moved upwards by that, m
//   encoder[:JOINT]=+0.01      what a hinge or slide reads, more by that in the same pose, rad or m
//   dampers=explicit           joints' springs and dampers are torques of each step's start, not the engine's
//   clamp=off                  no limits of what actuators or a policy's drives give
//   delay=1                    torques, of a policy its actions, act that many control steps later, or earlier (-1);
//                              `4ms` as a time, of what a log has measured any, else whole steps
//   law=engine                 a policy's drives: the engine's springs and dampers, or `explicit`
//   gear[:JOINT]=-1            times the torque that was asked for
//   drive_stiffness[:JOINT]=2  of the drives that follow a log's targets; drive_damping alike
//   order=JOINT,JOINT          each of the two gets the other's torque; `reversed`: all in reverse order
//   contender=NAME             the run is this contender's
//   timestep=0.5               times the run's
//   set:NAME=VALUE             a setting of the contender
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controls/control.h"
#include "engines/engine.h"
#include "model/model.h"

namespace assay {

enum class ChangeKind {
  kContacts,
  kSelfContacts,
  kFriction,
  kLimits,
  kArmature,
  kDamping,
  kStiffness,
  kDryFriction,
  kMass,
  kInertia,
  kCentre,
  kGravity,
  kGround,
  kEncoder,
  kDampers,
  kClamp,
  kDelay,
  kLaw,
  kGear,
  kDriveStiffness,
  kDriveDamping,
  kOrder,
  kContender,
  kTimestep,
  kSet,
};

struct RunChange {
  ChangeKind kind = ChangeKind::kContacts;
  std::string element = {};  // a joint, body or setting; "": all that there are
  std::string value = "off";

  bool operator==(const RunChange&) const = default;
};

// The two forms of a change. parse_change() throws InputError for an unknown kind and for a value that it does not
// take; elements are checked when the change is applied.
std::string change_text(const RunChange& change);
RunChange parse_change(const std::string& text);
std::vector<RunChange> parse_changes(const std::vector<std::string>& texts);
std::vector<std::string> change_texts(const std::vector<RunChange>& changes);

// Whether the change is one of the contender, the kinds from kContender on, and not of the model or its control.
bool is_of_contender(const RunChange& change);

// The last value that `changes` give a kind; null for none.
const RunChange* last_change(const std::vector<RunChange>& changes, ChangeKind kind);

// The sum of all delays in `changes` that count control steps, and of those that are times, s.
int delay_of(const std::vector<RunChange>& changes);
double delay_s_of(const std::vector<RunChange>& changes);

// The product of all factors that `changes` of this kind (kGear, kDriveStiffness, kDriveDamping) give each hinge and
// slide of `model`. Throws InputError for a joint that it does not have.
std::vector<double> joint_factors(const Model& model, ChangeKind kind, const std::vector<RunChange>& changes);

// The model with its changes, in their order. Throws InputError for a joint or body that it does not have.
Model changed_model(Model model, const std::vector<RunChange>& changes);

// The control that `spec` says for the unchanged `model`, with its changes. It still reads the unchanged robot: gains
// and observations stay. A delay that is no policy's counts engine steps. Throws InputError as make_control() does, and
// for changes that the control does not have.
std::unique_ptr<Control> changed_control(const Model& model, const ControlSpec& spec,
                                         const std::vector<RunChange>& changes);

// `inner`, which has to outlive the result, when it is given the model with `changes` instead of the model.
std::unique_ptr<Engine> changed_engine(const Engine& inner, std::vector<RunChange> changes);

}  // namespace assay
