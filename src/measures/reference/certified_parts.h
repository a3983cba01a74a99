// What certified solutions share. Internal to src/measures/reference.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "measures/reference/certified.h"
#include "model/model.h"

namespace assay::reference {

// How far a start may be from touching, m, and off a direction: decimals of a file.
inline constexpr double kTouching = 1e-6;
inline constexpr double kParallel = 1e-9;

[[noreturn]] void misfit(const Model& model, std::string_view solution, const std::string& why);

// Refuses springs, dampers, tendons, equality constraints, limits and dry friction, but for those of hinges and slides
// where `joints`, and torsional and rolling friction of contacts.
void require_plain(const Model& model, std::string_view solution, bool joints = false);

struct Ground {
  Vec3 normal = Vec3::UnitZ(), point = Vec3::Zero();
  double friction = 0;
  double height(const Vec3& p) const { return (p - point).dot(normal); }
  Vec3 tangential(const Vec3& v) const { return v - v.dot(normal) * normal; }
};
// The plane of the one pair in which the body's shapes touch a plane; they have one friction and no other pairs.
Ground ground_of(const Model& model, std::string_view solution, int body);

// A body's shapes that collide.
std::vector<const Shape*> shapes_of(const Model& model, int body);

// The inertia about the centre of mass along a direction of the world, kg m^2; refused where it is no principal axis.
double principal_inertia(const Model& model, std::string_view solution, int body, const Vec3& axis_W);

// The orientation after the rotation vector `turn_W`.
Quat turned(const Quat& q, const Vec3& turn_W);

// Fills the joints' coordinates of states whose bodies are given.
State completed(const Model& model, State state);

// The earliest zero of `f` in [a, b], between which it changes its sign once; to rounding.
double zero_between(const std::function<double(double)>& f, double a, double b);

// An angle and its rate, of a motion of one coordinate.
struct Turn {
  double angle = 0, rate = 0;
};

// x'' = acceleration(x, x') from `start`, to rounding.
class TurnMotion {
 public:
  TurnMotion(Turn start, double time, std::function<double(double angle, double rate)> acceleration);
  double time() const { return time_; }
  const Turn& turn() const { return turn_; }
  // Goes on to `time`, or to the first zero of `event` that comes before, from above; true where that ended it.
  bool go(double time, const std::function<double(const Turn&)>& event);

 private:
  Turn after(double seconds) const;

  Turn turn_;
  double time_ = 0;
  std::function<double(double, double)> acceleration_;
};

// A speed at which what was at rest has begun to move, m/s; and the share of its speed below which it has stopped.
// Neither is zero: soft friction creeps.
inline constexpr double kBegins = 0.01, kStopped = 0.02;

// Marks of impulses: equal parts where forces are steady, else the middles between impacts.
std::vector<double> equal_marks(double start, double end);
std::vector<double> marks_between(double start, const std::vector<double>& impacts, double end);

// What everything else but gravity gives these bodies together.
SolutionImpulse impulse_on(const Model& model, std::vector<size_t> bodies, const Vec3& normal,
                           std::vector<double> marks, std::string what);

// ---- the solutions, for the list in certified.cc --------------------------------------------------------------------

CertifiedMotion slide_and_roll(const Model& model, const std::vector<double>& times);
CertifiedMotion dry_joints(const Model& model, const std::vector<double>& times);
CertifiedMotion ball_row(const Model& model, const std::vector<double>& times);
CertifiedMotion rod_strike(const Model& model, const std::vector<double>& times);
CertifiedMotion tipping_box(const Model& model, const std::vector<double>& times);
CertifiedMotion rimless_wheel(const Model& model, const std::vector<double>& times);
CertifiedMotion box_stack(const Model& model, const std::vector<double>& times);
CertifiedMotion two_finger_grip(const Model& model, const std::vector<double>& times);

}  // namespace assay::reference
