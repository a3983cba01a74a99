#include "controls/isaac_env.h"

#include <cmath>

#include <fmt/format.h>

#include "base/text.h"
#include "controls/deploy_file.h"
#include "controls/isaac/drives.h"
#include "controls/isaac/environment.h"
#include "controls/isaac/observations.h"
#include "controls/toml_text.h"
#include "controls/yaml_tree.h"

namespace assay {
namespace {

std::string trained_in(IsaacEnvironment& in) {
  const YamlPlace sim = in.read().need(in.root(), "sim");
  const auto physx = YamlValues::child(sim, "physx");
  if (!physx) return "";
  const auto solver = YamlValues::child(*physx, "solver_type");
  return solver && solver->node->text == "0" ? "physx-art-pgs" : "physx-art-tgs";
}

std::string control_text(IsaacEnvironment& in, int delay) {
  const double dt = in.read().positive(in.read().need(in.read().need(in.root(), "sim"), "dt"));
  const int decimation = in.read().whole(in.read().need(in.root(), "decimation"), 1);
  // dt is a decimal fraction of a second
  std::string text = fmt::format("\n[control]\ntimestep_ms = {}\ndecimation = {}\n",
                                 shortest(std::round(1e12 * dt) / 1e9), decimation);
  if (delay > 0) text += fmt::format("delay = {}\n", delay);
  return text;
}

std::string actions_text(IsaacEnvironment& in) {
  std::string text = fmt::format("\n[actions]\ntype = \"{}\"\n", in.type()) + in.joints_line(in.acted());
  if (const auto scale = YamlValues::child(in.action(), "scale")) {
    text += per_joint("scale", in.acted(), in.values(*scale, in.acted(), 1));
  }
  if (const auto clip = YamlValues::child(in.action(), "clip")) {
    in.must_ignore(*clip, "a clip of targets, where assay clips the network's numbers");
  }
  const bool by_default = in.type() != "joint_effort" && in.read().flag(in.action(), "use_default_offset", true);
  if (by_default) return text + (in.type() == "joint_position" ? "offset = \"default\"\n" : "");
  const auto offset = YamlValues::child(in.action(), "offset");
  const std::vector<double> offsets =
      offset ? in.values(*offset, in.acted(), 0) : std::vector<double>(in.acted().size(), 0);
  return text + per_joint("offset", in.acted(), offsets);
}

std::string termination_text(IsaacEnvironment& in, IsaacObservations& observations) {
  const auto terms = YamlValues::child(in.root(), "terminations");
  std::string text, joints;
  for (const YamlPlace& term : terms ? YamlValues::entries(*terms) : std::vector<YamlPlace>()) {
    if (term.node->kind != YamlNode::Kind::kMap) in.read().fail(term, "it is no termination");
    const std::string function = in.read().name_of(term, "func");
    const YamlPlace params = YamlValues::child(term, "params").value_or(term);
    if (function == "time_out") continue;
    if (function == "root_height_below_minimum" && in.has_free_base()) {
      text +=
          fmt::format("base_height_below = {}\n", shortest(in.read().number(in.read().need(params, "minimum_height"))));
    } else if (function == "bad_orientation" && in.has_free_base()) {
      text += fmt::format("base_tilt_above = {}\n", shortest(in.read().number(in.read().need(params, "limit_angle"))));
    } else if (function == "joint_pos_out_of_manual_limit") {
      const Range bounds = in.read().range(in.read().need(params, "bounds"));
      for (const std::string& name : observations.term_joints(term, params)) {
        joints += fmt::format("{}{} = [{}, {}]", joints.empty() ? "" : ", ", toml_text(name), shortest(bounds.low),
                              shortest(bounds.high));
      }
    } else {
      in.left_out(term.path, fmt::format("the end of an episode by '{}': here it is no fall", function));
    }
  }
  if (!joints.empty()) text += fmt::format("joint_outside = {{ {} }}\n", joints);
  if (text.empty()) {
    in.list_no_termination("terminations");
    return "";
  }
  return "\n[termination]\n" + text;
}

void list_events(IsaacEnvironment& in) {
  const auto events = YamlValues::child(in.root(), "events");
  if (!events) return;
  for (const YamlPlace& event : YamlValues::entries(*events)) {
    if (event.node->kind != YamlNode::Kind::kMap) continue;
    const std::string function = in.read().name_of(event, "func");
    if (function == "push_by_setting_velocity") {
      in.left_out(event.path, "pushes of the base: not part of the policy (`assay run --push` pushes every contender)");
    } else {
      in.left_out(event.path, fmt::format("'{}' at random: here the robot is always that of the file", function));
    }
  }
}

void list_world(IsaacEnvironment& in) {
  const YamlPlace sim = in.read().need(in.root(), "sim");
  if (const auto gravity = YamlValues::child(sim, "gravity")) {
    const std::vector<double> g = in.read().numbers(*gravity);
    if (g.size() == 3 && (Vec3(g[0], g[1], g[2]) - in.model().gravity).norm() > 1e-3) {
      in.left_out(gravity->path, fmt::format("the robot's file has another gravity than {} m/s²", vector_text(g)));
    }
  }
  const auto terrain = YamlValues::child(in.read().need(in.root(), "scene"), "terrain");
  if (!terrain) return;
  if (const auto type = YamlValues::child(*terrain, "terraintype"); type && in.read().text(*type) != "plane") {
    in.left_out(type->path, fmt::format("a terrain of the kind '{}': here the ground is that of the robot's file",
                                        in.read().text(*type)));
  }
  const auto material = YamlValues::child(*terrain, "physics_material");
  if (const auto friction = material ? YamlValues::child(*material, "dynamic_friction") : std::nullopt) {
    in.left_out(friction->path, fmt::format("friction of the ground, {}: here it is that of the robot's file",
                                            shortest(in.read().number(*friction))));
  }
}

PolicyImport import_environment(IsaacEnvironment& in) {
  in.check_kind();
  in.order_joints();
  IsaacDrives drives(in);
  IsaacObservations observed(in);
  std::string control, observations, actions, pd, termination;
  in.part([&] { in.read_action(); });
  // the rest asks for the robot and the joints of the actions
  if (in.acted().empty()) in.throw_problems();
  in.part([&] { in.read_robot(); });
  const bool driven = in.part([&] { drives.read(); });
  in.part([&] { control = control_text(in, drives.delay()); });
  in.part([&] { observations = observed.text(); });
  in.part([&] { actions = actions_text(in); });
  if (driven) in.part([&] { pd = drives.pd_text(); });
  in.part([&] { termination = termination_text(in, observed); });
  in.part([&] { list_events(in); });
  in.part([&] { list_world(in); });
  const std::string held = PolicyImporter::hold_text(drives.held());
  return in.finish(trained_in(in), control + observations + actions + pd + held + in.command_text() + termination);
}

}  // namespace

PolicyImport import_isaac_env(const Model& model, std::string_view text, const std::string& path,
                              const PolicyImportOptions& options) {
  const YamlTree tree = YamlTree::parse(text, path);
  if (is_deploy_file(tree)) return import_deploy_file(model, tree, path, options);
  IsaacEnvironment environment(model, tree, path, options);
  return import_environment(environment);
}

}  // namespace assay
