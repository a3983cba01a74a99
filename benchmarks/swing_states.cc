// The smooth part of a model as JSON: masses and joints from which another program can build the same robot, a start,
// and where the reference solution and each contender are some time later. against_pinocchio.py reads it.
//
//   {"model", "gravity": [3], "bodies": [{"name", "parent", "kind": "free"|"ball"|"hinge"|"slide", "number", "p", "q",
//    "mass", "cm", "inertia": [9]}], "joints": [{"name", "anchor", "axis", "reference", "stiffness",
//    "spring_reference", "damping", "armature"}], "balls": [...], "couplings": [...], "tendons": [...], "loops": number
//    of connects and welds, "start": STATE, "reference": STATE or a sentence that says why there is none, "contenders":
//    [{"name", "order", "integrator", "approximated": [text], "refused": text, "ends": [{"timestep_ms", "state" or
//    "failure"}]}]}
//
// Units and frames are those of model/model.h; quaternions are w, x, y, z; a STATE has "position" and "velocity" by
// joint and "bodies": [{"p", "q", "v", "w"}].
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/errors.h"
#include "base/quantity.h"
#include "engines/registry.h"
#include "load/mjcf.h"
#include "measures/reference/smooth.h"
#include "model/variant.h"

namespace assay::benchmarks {
namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kTimeLimit = 300;  // s, of one contender at one timestep

Json to_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Json to_json(const Quat& q) { return {q.w(), q.x(), q.y(), q.z()}; }
Json to_json(const State& state) {
  Json bodies = Json::array();
  for (const BodyState& body : state.bodies) {
    bodies.push_back({{"p", to_json(body.p_WBcm)},
                      {"q", to_json(body.q_WB)},
                      {"v", to_json(body.v_WBcm)},
                      {"w", to_json(body.w_WB)}});
  }
  return {{"position", state.position}, {"velocity", state.velocity}, {"bodies", std::move(bodies)}};
}
Json to_json(const std::vector<JointTerm>& terms) {
  Json list = Json::array();
  for (const JointTerm& term : terms) list.push_back({{"joint", term.joint}, {"coefficient", term.coefficient}});
  return list;
}

const char* kind_of(const Model& model, const Body& body) {
  if (body.is_free()) return "free";
  if (body.joint < 0) return "ball";
  return model.joints[body.joint].is_slide() ? "slide" : "hinge";
}

Json model_json(const Model& model) {
  Json bodies = Json::array(), joints = Json::array(), balls = Json::array(), couplings = Json::array(),
       tendons = Json::array();
  for (const Body& body : model.bodies) {
    const bool one = body.joint >= 0;
    Json inertia = Json::array();
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) inertia.push_back(body.I_BBcm_B(r, c));
    }
    bodies.push_back({{"name", body.name},
                      {"parent", body.parent},
                      {"kind", kind_of(model, body)},
                      {"number", one ? body.joint : body.ball},
                      {"p", to_json(body.X_PB.p)},
                      {"q", to_json(body.X_PB.q)},
                      {"mass", body.mass},
                      {"cm", to_json(body.p_BBcm)},
                      {"inertia", std::move(inertia)}});
  }
  for (const Joint& joint : model.joints) {
    joints.push_back({{"name", joint.name},
                      {"anchor", to_json(joint.p_BJ)},
                      {"axis", to_json(joint.axis_B)},
                      {"reference", joint.reference},
                      {"stiffness", joint.stiffness},
                      {"spring_reference", joint.spring_reference},
                      {"damping", joint.damping},
                      {"armature", joint.armature}});
  }
  for (const BallJoint& ball : model.balls) {
    balls.push_back({{"name", ball.name},
                     {"anchor", to_json(ball.p_BJ)},
                     {"stiffness", ball.stiffness},
                     {"spring_reference", to_json(ball.spring_reference)},
                     {"damping", ball.damping},
                     {"armature", ball.armature}});
  }
  for (const Coupling& coupling : model.couplings) {
    couplings.push_back({{"joint", coupling.joint}, {"terms", to_json(coupling.terms)}, {"offset", coupling.offset}});
  }
  for (const Tendon& tendon : model.tendons) {
    tendons.push_back({{"terms", to_json(tendon.terms)},
                       {"stiffness", tendon.stiffness},
                       {"rest_lower", tendon.rest_lower},
                       {"rest_upper", tendon.rest_upper},
                       {"damping", tendon.damping}});
  }
  return {{"model", model.name},
          {"file", model.source},
          {"gravity", to_json(model.gravity)},
          {"dof", model.dof()},
          {"bodies", std::move(bodies)},
          {"joints", std::move(joints)},
          {"balls", std::move(balls)},
          {"couplings", std::move(couplings)},
          {"tendons", std::move(tendons)},
          {"loops", model.connects.size() + model.welds.size()}};
}

// What `work` returns, from a process of its own: engines crash, and some never return.
Json in_child(const std::function<Json()>& work) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw SystemError("there is no pipe to be had");
  const pid_t child = fork();
  if (child < 0) throw SystemError("no process can be started");
  if (child == 0) {
    close(ends[0]);
    alarm(kTimeLimit);
    Json result;
    try {
      result = work();
    } catch (const std::exception& error) {
      result = {{"failure", error.what()}};
    }
    const std::string text = result.dump(-1, ' ', false, Json::error_handler_t::replace);
    size_t sent = 0;
    while (sent < text.size()) {
      const ssize_t part = write(ends[1], text.data() + sent, text.size() - sent);
      if (part <= 0) break;
      sent += static_cast<size_t>(part);
    }
    _exit(0);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 65536> buffer{};
  for (ssize_t got = 0; (got = read(ends[0], buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<size_t>(got));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) {
    return {{"failure", WTERMSIG(status) == SIGALRM ? fmt::format("not done after {} s", kTimeLimit)
                                                    : fmt::format("ended by signal {}", WTERMSIG(status))}};
  }
  const Json result = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  return result.is_discarded() ? Json{{"failure", "its process ended early"}} : result;
}

Json end_of(const Model& model, ResolvedContender contender, double timestep_ms, double duration_s) {
  contender.settings.timestep = timestep_ms / 1000;
  const auto steps = std::llround(duration_s / contender.settings.timestep);
  const auto simulation = contender.engine->create(model, model.initial, contender.settings);
  const std::vector<double> none(model.joints.size(), 0.0);
  // adapters set explicit springs with the torques: at every step
  for (long long step = 0; step < steps; ++step) simulation->step(none);
  State state;
  simulation->read_state(state);
  for (const BodyState& body : state.bodies) {
    if (!body.p_WBcm.allFinite()) return {{"failure", "its state is not finite"}};
  }
  return {{"state", to_json(state)}};
}

Json contender_json(const Model& model, const ResolvedContender& contender, const std::vector<double>& timesteps_ms,
                    double duration_s) {
  const Capabilities own = contender.engine->capabilities(contender.settings);
  std::string refused;
  Json approximated = Json::array();
  for (const Limitation& limitation : contender.engine->check(model, contender.settings)) {
    const std::string text = limitation.element + ": " + limitation.how;
    if (limitation.fidelity == Fidelity::kRefused && refused.empty()) refused = text;
    if (limitation.fidelity == Fidelity::kApproximated) approximated.push_back(text);
  }
  Json json = {{"name", contender.name},
               {"order", own.order},
               {"integrator", own.integrator},
               {"refused", refused},
               {"approximated", std::move(approximated)},
               {"ends", Json::array()}};
  if (!refused.empty()) return json;
  for (const double timestep_ms : timesteps_ms) {
    Json end = in_child([&] { return end_of(model, contender, timestep_ms, duration_s); });
    end["timestep_ms"] = timestep_ms;
    json["ends"].push_back(std::move(end));
  }
  return json;
}

int run(int argc, char** argv) {
  std::string file;
  LoadOptions load;
  bool floating = false;
  double rates = 1, duration_s = 0.25;
  std::vector<std::string> names;
  std::vector<double> timesteps_ms = {1.0 / 64, 1.0 / 32};
  CLI::App app("The smooth part of a model, and where contenders bring it, as JSON");
  app.add_option("MODEL", file, "MJCF or URDF file")->required();
  app.add_option("CONTENDER", names, "Contenders");
  app.add_flag("--drop-unsupported", load.drop_unsupported, "As in assay check");
  app.add_flag("--floating-base", floating, "As in assay check");
  app.add_option("--rates", rates, "Largest joint rate at the start, rad/s or m/s")->capture_default_str();
  app.add_option("--duration", duration_s, "s")->capture_default_str();
  app.add_option("--timesteps", timesteps_ms, "ms")->delimiter(',');
  CLI11_PARSE(app, argc, argv);
  if (floating) load.root_joint = RootJoint::kFloating;

  const Model model = variant_of(load_model(file, load), {.smooth = true, .start_rates = rates});
  Json json = model_json(model);
  json["start"] = to_json(model.initial);
  json["duration_s"] = duration_s;
  const std::string obstacle = smooth_obstacle(model);
  if (obstacle.empty()) {
    const Json solved =
        in_child([&] { return to_json(smooth_solution(model, model.initial, model.initial.time + duration_s)); });
    json["reference"] = solved.contains("failure") ? solved.at("failure") : solved;
  } else {
    json["reference"] = obstacle;
  }
  json["contenders"] = Json::array();
  for (const std::string& name : names) {
    json["contenders"].push_back(contender_json(model, Registry::instance().resolve(name), timesteps_ms, duration_s));
  }
  fmt::print("{}\n", json.dump(-1, ' ', false, Json::error_handler_t::replace));
  return 0;
}

}  // namespace
}  // namespace assay::benchmarks

int main(int argc, char** argv) {
  try {
    return assay::benchmarks::run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
}
