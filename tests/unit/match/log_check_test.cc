#include "match/log_check.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <set>

#include <gmock/gmock.h>

#include "load/mjcf.h"

namespace assay::match {
namespace {

using ::testing::Contains;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr double kDegree = M_PI / 180;

// 0.5 kg at 0.3 m on a hinge, hanging.
constexpr const char* kPendulum = R"(<mujoco model="pendulum"><worldbody><body name="link">
  <joint name="hinge" axis="0 1 0"/><inertial pos="0 0 -0.3" mass="0.5" diaginertia="0.001 0.001 0.001"/>
  <geom size="0.01" contype="0" conaffinity="0"/></body></worldbody></mujoco>)";
constexpr double kInertia = 0.5 * 0.09 + 0.001, kWeight = 0.5 * 9.81 * 0.3, kDamping = 0.02, kFriction = 0.03;

// Its motion under `torque`, and under `hand`, which the log does not have, with a sensor's noise.
MeasuredLog swing(const std::function<double(double)>& torque, const std::function<double(double)>& hand,
                  double q = 1) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, 1);
  MeasuredLog log;
  log.name = log.source = "swing";
  MeasuredJoint joint;
  double v = 0;
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 60'000; ++i) {
    const double t = i * kStep;
    if (i % 50 == 0) {
      log.time.push_back(t);
      log.line.push_back(log.time.size() + 1);
      joint.position.push_back(q + 2e-4 * noise(random));
      joint.velocity.push_back(v + 0.02 * noise(random));
      joint.torque.push_back(torque(t) + 0.005 * noise(random));
    }
    const double force = torque(t) + hand(t) - kWeight * std::sin(q) - kDamping * v - kFriction * std::tanh(v / 0.01);
    v += kStep * force / kInertia;
    q += kStep * v;
  }
  log.joints.push_back(joint);
  log.rows = {{log.time.front(), log.time.back()}};
  return log;
}

double nothing(double) { return 0; }
double sines(double t) { return 0.5 * std::sin(4.5 * t) + 0.3 * std::sin(7.3 * t + 1); }
MeasuredLog clean() { return swing(sines, nothing); }

std::set<std::string> kinds(const MeasuredLog& log, FindingSeverity worst = FindingSeverity::kWarning) {
  const Model model = load_model_text(kPendulum, "pendulum");
  std::set<std::string> found;
  for (const LogFinding& finding : check_logs(model, MatchConfig(), {log}).findings) {
    if (finding.kind == "one log") continue;
    if (finding.severity <= worst) found.insert(finding.kind);
  }
  return found;
}

void scale(std::vector<double>& values, double factor) {
  for (double& value : values) value *= factor;
}

TEST(LogCheck, CleanLogsRaiseNothing) { EXPECT_THAT(kinds(clean()), IsEmpty()); }

TEST(LogCheck, PassiveLogsRaiseNothing) {
  MeasuredLog log = swing(nothing, nothing, 2);
  log.joints[0].torque.clear();
  EXPECT_THAT(kinds(log), IsEmpty());
}

TEST(LogCheck, FindsSignsAndUnits) {
  MeasuredLog log = clean();
  scale(log.joints[0].torque, -1);
  EXPECT_THAT(kinds(log), Contains("torque sign"));
  log = clean();
  scale(log.joints[0].velocity, -1);
  EXPECT_THAT(kinds(log), Contains("velocity sign"));
  log = clean();
  scale(log.joints[0].position, 1 / kDegree);
  EXPECT_THAT(kinds(log), Contains("degrees"));
  scale(log.joints[0].velocity, 1 / kDegree);
  EXPECT_THAT(kinds(log), Contains("degrees"));
  log = clean();
  scale(log.joints[0].velocity, 1 / kDegree);
  EXPECT_THAT(kinds(log), Contains("degrees"));
  log = clean();
  scale(log.joints[0].torque, 1000);
  EXPECT_THAT(kinds(log), Contains("torque scale"));
  log = clean();
  for (double& q : log.joints[0].position) q += M_PI;
  EXPECT_THAT(kinds(log), Contains("zero"));
}

TEST(LogCheck, FindsHands) {
  // against the motion it would be friction, with it nothing of the robot explains it
  const auto push = [](double t) { return t > 4 && t < 4.8 ? 2.5 : 0; };
  EXPECT_THAT(kinds(swing(nothing, push, 0.3)), Contains("hands"));
}

TEST(LogCheck, DrivesWithGainsAreNoHands) {
  constexpr double kStiffness = 8, kGain = 0.4;
  const auto target = [](double t) { return 0.8 * std::sin(2 * t); };
  MeasuredLog log;
  log.name = log.source = "drive";
  MeasuredJoint joint;
  double q = 0.4, v = 0;
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 60'000; ++i) {
    const double t = i * kStep;
    if (i % 50 == 0) {
      log.time.push_back(t);
      log.line.push_back(log.time.size() + 1);
      joint.position.push_back(q);
      joint.target.push_back(target(t));
    }
    v += kStep * (kStiffness * (target(t) - q) - kGain * v - kWeight * std::sin(q) - kDamping * v) / kInertia;
    q += kStep * v;
  }
  log.joints.push_back(joint);
  log.rows = {{log.time.front(), log.time.back()}};
  const Model model = load_model_text(kPendulum, "pendulum");
  const auto found = [&](const MatchConfig& config) {
    std::set<std::string> kinds;
    for (const LogFinding& finding : check_logs(model, config, {log}).findings) kinds.insert(finding.kind);
    return kinds;
  };
  EXPECT_THAT(found(MatchConfig()), Contains("drive"));  // there are targets, and nothing follows them
  MatchConfig config;
  config.law = DriveLaw::kPd;
  config.stiffness[""] = kStiffness, config.damping["hinge"] = kGain;
  for (const char* kind : {"hands", "zero", "torque sign", "torque scale", "drive"}) {
    EXPECT_THAT(found(config), Not(Contains(kind)));
  }
  scale(log.joints[0].target, -1);
  EXPECT_THAT(found(config), Contains("torque sign"));
}

// Two links in a plane, swinging: Lagrange's equations of two point masses, by small steps.
MeasuredLog double_swing() {
  constexpr double kMass = 0.5, kLength = 0.3, kGravity = 9.81, kStep = 1e-4;
  MeasuredLog log;
  log.name = log.source = "links";
  MeasuredJoint first, second;
  second.joint = 1;
  double a = 1.2, b = 0.4, u = 0, v = 0;  // angles of the links against the vertical
  for (int i = 0; i < 80'000; ++i) {
    const double t = i * kStep, torque = 0.6 * std::sin(5 * t), other = 0.2 * std::sin(3 * t + 1);
    if (i % 50 == 0) {
      log.time.push_back(t);
      log.line.push_back(log.time.size() + 1);
      first.position.push_back(a), second.position.push_back(b - a);
      first.torque.push_back(torque), second.torque.push_back(other);
    }
    const double c = std::cos(a - b), s = std::sin(a - b), m = kMass * kLength * kLength,
                 w = kMass * kGravity * kLength;
    // 2 m a" + m c b" = ..., m c a" + m b" = ...
    const double p = torque - other - m * s * v * v - 2 * w * std::sin(a) - 0.01 * u;
    const double q = other + m * s * u * u - w * std::sin(b) - 0.01 * (v - u);
    const double d = m * m * (2 - c * c);
    const double au = (m * p - m * c * q) / d, bv = (2 * m * q - m * c * p) / d;
    u += kStep * au, v += kStep * bv;
    a += kStep * u, b += kStep * v;
  }
  log.joints = {first, second};
  log.rows = {{log.time.front(), log.time.back()}};
  return log;
}

TEST(LogCheck, FindsJointsThatAreReadInAnotherWay) {
  const Model model = load_model_text(R"(<mujoco model="links"><worldbody><body name="upper">
    <joint name="shoulder" axis="0 -1 0"/><inertial pos="0 0 -0.3" mass="0.5" diaginertia="1e-6 1e-6 1e-6"/>
    <body name="lower" pos="0 0 -0.3"><joint name="elbow" axis="0 -1 0"/>
    <inertial pos="0 0 -0.3" mass="0.5" diaginertia="1e-6 1e-6 1e-6"/></body></body></worldbody></mujoco>)",
                                      "links");
  const auto found = [&](const std::function<void(std::vector<MeasuredJoint>&)>& change) {
    MeasuredLog log = double_swing();
    change(log.joints);
    std::set<std::string> kinds;
    for (const LogFinding& finding : check_logs(model, MatchConfig(), {log}).findings) {
      if (finding.severity == FindingSeverity::kWrong) kinds.insert(finding.kind + " " + finding.column);
    }
    return kinds;
  };
  EXPECT_THAT(found([](auto&) {}), IsEmpty());
  EXPECT_THAT(found([](auto& joints) { scale(joints[1].position, -1), scale(joints[1].torque, -1); }),
              // of two joints the other one turned is the mirror of it
              ::testing::AnyOf(Contains("flipped axis elbow"), Contains("flipped axis shoulder")));
  EXPECT_THAT(found([](auto& joints) {
                std::swap(joints[0].position, joints[1].position), std::swap(joints[0].torque, joints[1].torque);
              }),
              Contains("exchanged shoulder"));
  EXPECT_THAT(found([](auto& joints) { std::swap(joints[0].torque, joints[1].torque); }),
              Contains("exchanged shoulder.torque"));
  EXPECT_THAT(found([](auto& joints) {
                for (size_t i = 0; i < joints[0].position.size(); ++i) joints[1].position[i] += joints[0].position[i];
              }),
              Contains("absolute angle elbow"));
}

TEST(LogCheck, FindsGapsGlitchesAndRest) {
  MeasuredLog log = clean();
  for (size_t i = 600; i < log.samples(); ++i) log.time[i] += 0.4;
  EXPECT_THAT(kinds(log), Contains("gap"));
  log = clean();
  for (size_t i = 50; i < log.samples(); i += 100) log.joints[0].torque[i] += 5;
  EXPECT_THAT(kinds(log, FindingSeverity::kRemark), Contains("glitches"));
  EXPECT_THAT(kinds(log), Not(Contains("glitches")));
  log = clean();
  for (size_t i = 400; i < 700; ++i) log.joints[0].position[i] = log.joints[0].position[400];
  EXPECT_THAT(kinds(log, FindingSeverity::kRemark), Contains("rest"));
  log = clean();
  scale(log.joints[0].position, 0.003);
  EXPECT_THAT(kinds(log), Contains("excitation"));
}

TEST(LogCheck, FindsWhatASensorDoes) {
  MeasuredLog log = clean();
  for (const size_t i : {100, 300, 301, 700}) log.joints[0].position[i] += 0.8;
  EXPECT_THAT(kinds(log), Contains("glitches"));
  log = clean();
  for (size_t i = 0; i < log.samples(); ++i) log.joints[0].position[i] = log.joints[0].position[i - i % 8];
  EXPECT_THAT(kinds(log), Contains("held"));
  log = clean();
  scale(log.joints[0].velocity, 60 / (2 * M_PI));
  EXPECT_THAT(kinds(log), Contains("velocity scale"));
  log = clean();
  for (double& q : log.joints[0].position) q = 0.4;
  EXPECT_THAT(kinds(log), Not(Contains("torque scale")));
  EXPECT_THAT(kinds(log), Not(Contains("hands")));
}

TEST(LogCheck, FindsTheUnitOfTheTime) {
  const Model model = load_model_text(kPendulum, "pendulum");
  const auto fix_of = [&](double factor, double scale) {
    MeasuredLog log = clean();
    for (double& t : log.time) t *= factor;
    MatchConfig config;
    config.time_scale = scale;
    for (const LogFinding& finding : check_logs(model, config, {log}).findings) {
      if (finding.kind == "time unit") return finding.fix;
    }
    return std::string();
  };
  EXPECT_EQ(fix_of(1, 1), "");
  EXPECT_THAT(fix_of(1e3, 1), ::testing::HasSubstr("\"ms\""));
  EXPECT_THAT(fix_of(1e6, 1), ::testing::HasSubstr("\"us\""));
  EXPECT_THAT(fix_of(1e9, 1), ::testing::HasSubstr("\"ns\""));
  EXPECT_THAT(fix_of(1e-3, 1e-3), ::testing::HasSubstr("\"s\""));  // seconds, read as milliseconds
}

TEST(LogCheck, FindsWhatOneLogLacks) {
  const Model model = load_model_text(kPendulum, "pendulum");
  const auto wrong = [&](const std::vector<MeasuredLog>& logs) {
    std::set<std::string> found;
    for (const LogFinding& finding : check_logs(model, MatchConfig(), logs).findings) {
      if (finding.severity == FindingSeverity::kWrong) found.insert(finding.kind);
    }
    return found;
  };
  MeasuredLog one = clean(), other = swing(sines, nothing, 0.5);
  other.name = "other";
  EXPECT_THAT(wrong({one, other}), IsEmpty());
  other.joints[0].torque.clear();
  EXPECT_THAT(wrong({one, other}), Contains("drive"));
  other.joints.clear();
  EXPECT_THAT(wrong({one, other}), Contains("missing"));
}

// A cube that flies, spins and is caught by nothing.
MeasuredLog toss(int number) {
  MeasuredLog log;
  log.name = "toss/" + std::to_string(number);
  log.source = "toss";
  MeasuredBody body;
  Quat q(Eigen::AngleAxisd(2, Vec3(1, 2, 0).normalized()));  // so that body axes are not the world's
  const Vec3 w(2.0 + 0.3 * number, -3, 1 + number);
  constexpr double kStep = 1 / 150.0;
  for (int i = 0; i < 90; ++i) {
    const double t = i * kStep;
    log.time.push_back(t);
    log.line.push_back(static_cast<size_t>(i) + 2);
    body.p_WB.emplace_back(0.5 * t, 0.1 * number, 1 + 2 * t - 0.5 * 9.81 * t * t);
    body.v_WB.emplace_back(0.5, 0, 2 - 9.81 * t);
    body.q_WB.push_back(q);
    body.w_WB.push_back(w);
    q = (Quat(Eigen::AngleAxisd(kStep * w.norm(), w.normalized())) * q).normalized();
  }
  log.bodies.push_back(body);
  log.rows = {{log.time.front(), log.time.back()}};
  return log;
}

std::set<std::string> toss_kinds(const std::function<void(MeasuredBody&)>& change) {
  const Model model = load_model_text(
      R"(<mujoco model="cube"><worldbody><body name="cube"><freejoint/><geom type="box" size="0.05 0.05 0.05" mass="0.4"/>
      </body></worldbody></mujoco>)",
      "cube");
  std::vector<MeasuredLog> logs;
  for (int i = 0; i < 4; ++i) {
    logs.push_back(toss(i));
    change(logs.back().bodies[0]);
  }
  std::set<std::string> found;
  for (const LogFinding& finding : check_logs(model, MatchConfig(), logs).findings) found.insert(finding.kind);
  return found;
}

TEST(LogCheck, FindsAxesAndUnitsOfFreeBodies) {
  EXPECT_THAT(toss_kinds([](MeasuredBody&) {}), IsEmpty());
  EXPECT_THAT(toss_kinds([](MeasuredBody& body) {
                for (Vec3& p : body.p_WB) p *= 1000;
              }),
              Contains("length unit"));
  EXPECT_THAT(toss_kinds([](MeasuredBody& body) {
                for (Vec3& p : body.p_WB) p = Vec3(p.x(), p.z(), -p.y());
              }),
              Contains("flipped axis"));
  EXPECT_THAT(toss_kinds([](MeasuredBody& body) {
                for (size_t i = 0; i < body.q_WB.size(); ++i) body.w_WB[i] = body.q_WB[i].conjugate() * body.w_WB[i];
              }),
              Contains("axes"));
  EXPECT_THAT(toss_kinds([](MeasuredBody& body) {
                for (Vec3& w : body.w_WB) w /= kDegree;
              }),
              Contains("degrees"));
  EXPECT_THAT(toss_kinds([](MeasuredBody& body) {
                for (Quat& q : body.q_WB) q = Quat(q.x(), q.y(), q.z(), q.w());
              }),
              Contains("quaternion order"));
}

// Two cubes of 0.1 m that turn on a corner on the table, and move along it.
std::set<std::string> table_kinds(const std::function<void(MeasuredBody&)>& change) {
  const Model model = load_model_text(
      R"(<mujoco model="cube"><worldbody><geom name="table" type="plane" size="2 2 0.1"/><body name="cube" pos="0 0 1">
      <freejoint/><geom type="box" size="0.05 0.05 0.05" mass="0.4"/></body></worldbody></mujoco>)",
      "cube");
  std::vector<MeasuredLog> logs;
  for (int number = 0; number < 2; ++number) {
    MeasuredLog log;
    log.name = "cube/" + std::to_string(number);
    MeasuredBody body;
    for (int i = 0; i < 100; ++i) {
      const Quat q(Eigen::AngleAxisd(0.3 * number + 0.01 * i, Vec3(0, 0, 1)) *
                   Eigen::AngleAxisd(0.6, Vec3(1, 0.7, 0).normalized()));
      const Eigen::Matrix3d R = q.toRotationMatrix();
      log.time.push_back(i / 150.0);
      log.line.push_back(static_cast<size_t>(i) + 2);
      body.q_WB.push_back(q);
      body.p_WB.emplace_back(0.0002 * i, 0, 0.05 * R.row(2).cwiseAbs().sum());
    }
    change(body);
    log.bodies.push_back(body);
    log.rows = {{log.time.front(), log.time.back()}};
    logs.push_back(log);
  }
  std::set<std::string> found;
  for (const LogFinding& finding : check_logs(model, MatchConfig(), logs).findings) found.insert(finding.kind);
  return found;
}

TEST(LogCheck, FindsFreeBodiesWhereTheyCannotBe) {
  EXPECT_THAT(table_kinds([](MeasuredBody&) {}),
              ::testing::AllOf(Not(Contains("inside")), Not(Contains("floats")), Not(Contains("quaternion order")),
                               Not(Contains("rest")), Not(Contains("glitches"))));
  EXPECT_THAT(table_kinds([](MeasuredBody& body) {
                for (Vec3& p : body.p_WB) p.z() -= 0.045;
              }),
              Contains("inside"));
  EXPECT_THAT(table_kinds([](MeasuredBody& body) {
                for (Vec3& p : body.p_WB) p.z() += 0.03;
              }),
              Contains("floats"));
  // flat on the table as x, y, z, w, and tilted into it as w, x, y, z
  EXPECT_THAT(table_kinds([](MeasuredBody& body) {
                for (size_t i = 0; i < body.q_WB.size(); ++i) {
                  const Quat q(Eigen::AngleAxisd(0.3 + 0.01 * static_cast<double>(i), Vec3(0, 0, 1)));
                  body.p_WB[i].z() = 0.05;
                  body.q_WB[i] = Quat(q.x(), q.y(), q.z(), q.w());
                }
              }),
              Contains("quaternion order"));
  EXPECT_THAT(table_kinds([](MeasuredBody& body) {
                const Vec3 p = body.p_WB.front();
                const Quat q = body.q_WB.front();
                std::ranges::fill(body.p_WB, p);
                std::ranges::fill(body.q_WB, q);
              }),
              Contains("rest"));
  EXPECT_THAT(table_kinds([](MeasuredBody& body) { body.p_WB[40].x() += 0.5; }), Contains("glitches"));
  EXPECT_THAT(table_kinds([](MeasuredBody& body) { body.q_WB[40] = Quat(0, 1, 0, 0); }), Contains("glitches"));
}

}  // namespace
}  // namespace assay::match
