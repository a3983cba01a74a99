// Certified solutions of motions with contacts, joint limits and dry friction: closed forms between events, or where
// there are none an error-controlled integration of one coordinate, whose energy is checked to 1e-9. With them engines
// are judged against a truth that none of them made.
//
// Mechanics: rigid bodies; Coulomb friction with one coefficient for sticking and slipping, isotropic; impacts without
// restitution, as all contenders are set. Each solution reads masses, sizes, friction, gravity and the initial state
// from the model and covers any model of its kind. Where rigid bodies with Coulomb friction have no unique motion, or
// laws of impact differ, it refuses. Sources: Kleppner and Kolenkow, An Introduction to Mechanics (sliding, rolling);
// Routh, Dynamics of a System of Rigid Bodies, and Stewart, SIAM Review 42 (2000) (impacts with friction); McGeer, Int.
// J. Robotics Research 9 (1990), and Coleman, Chatterjee and Ruina, Dynamics and Stability of Systems 12 (1997)
// (rimless wheel).
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "model/model.h"

namespace assay {

// How an event shows in the states of any run: a number that falls below a level. A solution chooses both, the same for
// all engines.
struct EventWatch {
  std::function<double(const State&)> number;
  double level = 0;
  double falls_at = 0;  // when the solution's own number does, s
  // Of a number that jumps: what it is the rate of. From it follows when between two states it jumped. Null: the number
  // is continuous.
  std::function<double(const State&)> place = {};
  bool for_good = false;  // the last fall counts, and there is none where the number is above the level at the end
  int chain = -1;         // events of one chain come one after the other; -1: of none
};

struct SolutionEvent {
  double time = 0;   // s, on the clock of the states
  std::string what;  // "body 'block' stops slipping"
  EventWatch watch = {};
};

// An impulse that the balance of momentum gives of any run: from the states of what takes it up, and the forces on that
// which are known.
struct SolutionImpulse {
  std::string what;                                // "of the plane on body 'block'"
  std::function<Vec3(const State&)> momentum;      // N s, of a hinge N m s
  std::function<Vec3(const State&)> known_forces;  // N, N m
  Vec3 normal;                                     // unit; across it lies the tangential part
  std::vector<double> marks;                       // s, ascending: it is compared between one and the next
};

struct CertifiedMotion {
  std::vector<State> states;              // at the times that were asked for
  std::vector<SolutionEvent> events;      // in the order of time, up to the last of them
  std::vector<SolutionImpulse> impulses;  // from the start to the last of them
};

struct CertifiedSolution {
  std::string_view name;   // in campaigns
  std::string_view about;  // what a model of it is, and what moves
  // States at `times` (s, ascending, none before the initial state's) of the motion from the model's initial state.
  // Throws InputError for a model of another kind, and where the motion is not unique or goes beyond what it covers.
  CertifiedMotion (*solve)(const Model& model, const std::vector<double>& times);
};

const std::vector<CertifiedSolution>& certified_solutions();
// Null when there is none of this name.
const CertifiedSolution* find_certified_solution(std::string_view name);

}  // namespace assay
