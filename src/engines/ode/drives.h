// Rows beside a joint's own: dry friction, armature, native springs of limited hinges, and the limit of a ball joint,
// each a motor of ODE on the joint's two bodies. A hinge or slide has one set of stops and motor, which its limits or
// its spring need.
#pragma once

#include <vector>

#include <ode/ode.h>

#include "model/model.h"
#include "options.h"

namespace assay::ode {

class Drives {
 public:
  // Makes the motors of `model`. Bodies and joints are ODE's, in the model's order, placed where the joints were made.
  void create(dxWorld* world, const Model& model, const std::vector<dxBody*>& bodies,
              const std::vector<dxJoint*>& joints, const Options& options);

  // Before each step: springs pull towards their rest, armature keeps the joint's present rate but for the torque that
  // this takes, limits of balls turn with the deflection.
  void update();

 private:
  // A row whose target is the joint's rate and whose softness is h / armature gives the torque
  // -armature (rate at the step's end - rate) / h.
  struct Rotor {
    dxJoint* joint;
    dxJoint* motor;
  };
  // A row whose target is -(ERP / h) times the angle from rest, soft by CFM: the stops' row of OdeSimulation's springs,
  // on a motor of its own.
  struct Spring {
    dxJoint* joint;
    dxJoint* motor;
    double rest;  // in ODE's angle, rad
    double pull;  // ERP / h, 1/s
  };
  struct Ball {
    int index;                 // in Model::balls
    dxBody *child, *parent;    // parent null for the world
    Quat q_PB;                 // at the reference
    dxJoint* rotor = nullptr;  // null without armature
    dxJoint* limit = nullptr;  // null without limit
  };

  double timestep_ = 1e-3;
  std::vector<Rotor> rotors_;
  std::vector<Spring> springs_;
  std::vector<Ball> balls_;
};

}  // namespace assay::ode
