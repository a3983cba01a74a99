#include "controls/isaac/observations.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include <fmt/format.h>

#include "base/terminal.h"
#include "base/text.h"

namespace assay {

std::string IsaacObservations::text() {
  const YamlPlace groups = in_.read().need(in_.root(), "observations");
  const auto group = YamlValues::child(groups, in_.options().group);
  if (!group) {
    std::vector<std::string> known;
    for (const YamlPlace& each : YamlValues::entries(groups)) known.push_back(YamlValues::key(each));
    in_.read().fail(groups, fmt::format("there is no group '{}'{}: name one with --group", in_.options().group,
                                        did_you_mean(in_.options().group, known)));
  }
  if (group->node->kind != YamlNode::Kind::kMap) in_.read().fail(*group, "it is no group of observations");
  if (!in_.read().flag(*group, "concatenate_terms", true)) {
    in_.read().fail(*group, "its terms are not concatenated, and assay's networks have one input");
  }
  const std::set<std::string> of_group = {"enable_corruption", "concatenate_terms", "concatenate_dim", "history_length",
                                          "flatten_history_dim"};
  std::vector<std::string> noisy;
  std::string terms;
  for (const YamlPlace& term : YamlValues::entries(*group)) {
    if (of_group.contains(YamlValues::key(term))) continue;
    if (term.node->kind != YamlNode::Kind::kMap) in_.read().fail(term, "it is no term of observations");
    const std::string text = term_text(term);
    auto length = YamlValues::child(*group, "history_length");
    const bool of_all = length.has_value();
    if (!of_all) length = YamlValues::child(term, "history_length");
    const int steps = std::max(1, length ? in_.read().whole(*length, 0) : 1);
    if (steps > 1 && !in_.read().flag(of_all ? *group : term, "flatten_history_dim", true)) {
      in_.read().fail(length.value_or(term),
                      "the history is a dimension of its own (flatten_history_dim), and networks have one here");
    }
    in_.take_history(length.value_or(term), steps);
    if (YamlValues::child(term, "noise")) noisy.push_back(YamlValues::key(term));
    terms += text;
  }
  if (terms.empty()) in_.read().fail(*group, "it has no terms");
  if (!noisy.empty() && in_.read().flag(*group, "enable_corruption", false)) {
    in_.left_out(fmt::format("{}.*.noise", group->path),
                 fmt::format("noise on {}: here observations are exact", some_of(noisy)));
  }
  const std::string text = "\n[observations]\n" + in_.history_text(in_.history().value_or(1));
  return text + terms;
}

std::string IsaacObservations::term_text(const YamlPlace& term) {
  const std::string function = in_.read().name_of(term, "func");
  const std::map<std::string, std::string> plain = {{"base_lin_vel", "base_lin_vel"},
                                                    {"base_ang_vel", "base_ang_vel"},
                                                    {"projected_gravity", "projected_gravity"},
                                                    {"base_pos_z", "base_height"},
                                                    {"joint_pos_rel", "joint_pos_rel"},
                                                    {"joint_pos", "joint_pos"},
                                                    {"joint_vel_rel", "joint_vel_rel"},
                                                    {"joint_vel", "joint_vel_rel"},
                                                    {"last_action", "last_action"}};
  const auto params = YamlValues::child(term, "params");
  std::string name;
  std::optional<int> zeros;
  if (const auto found = plain.find(function); found != plain.end()) name = found->second;
  if (function == "generated_commands" && params && is_velocity(*params)) name = "velocity_commands";
  if (function == "root_quat_w" && params && in_.read().flag(*params, "make_quat_unique", false)) {
    name = "base_quat_wxyz";
    const auto start = YamlValues::child(in_.robot(), "init_state");
    if (const auto given = start ? YamlValues::child(*start, "rot") : std::nullopt) {
      const std::vector<double> rot = in_.read().numbers(*given);
      if (rot.size() == 4 && rot[0] == 0 && rot[3] != 0) {
        in_.must_ignore(term, "a quaternion of Isaac Lab 3, x first, where assay's has w first");
      }
    }
  }
  if (name.empty()) {
    zeros = in_.zeros_for(term.path);
    if (!zeros) {
      in_.read().fail(term, fmt::format("assay has no observation '{}'; --ignore {}=COUNT gives the network that many "
                                        "zeros in its place",
                                        function, term.path));
    }
    name = "constant";
    in_.left_out(term.path, fmt::format("IGNORED: assay has no observation '{}', and gives the network {} in its place",
                                        function, counted(static_cast<size_t>(*zeros), "zero")));
  }
  if (name == "base_lin_vel") list_velocity_point(term);
  std::string text = fmt::format("[[observations.terms]]\nterm = \"{}\"\n", name);
  if (zeros) {
    std::string list;
    for (int i = 0; i < *zeros; ++i) list += i == 0 ? "0" : ", 0";
    return text + fmt::format("values = [{}]\n", list);
  }
  if (name.starts_with("joint_") && params) {
    const std::vector<std::string> names = term_joints(term, *params);
    text += in_.joints_line(names);
  }
  if (const auto modifiers = YamlValues::child(term, "modifiers");
      modifiers && (modifiers->node->kind != YamlNode::Kind::kList || !modifiers->node->items.empty())) {
    in_.must_ignore(*modifiers, "modifiers, of which assay has none");
  }
  if (const auto scale = YamlValues::child(term, "scale")) {
    if (scale->node->kind == YamlNode::Kind::kList && !scale->node->tag.starts_with("python/object")) {
      std::vector<std::string> numbers;
      for (const double value : in_.read().numbers(*scale)) numbers.push_back(shortest(value));
      text += fmt::format("scale = [{}]\n", join(numbers, ", "));
    } else {
      text += fmt::format("scale = {}\n", shortest(in_.read().number(*scale)));
    }
  }
  if (const auto clip = YamlValues::child(term, "clip")) {
    const Range range = in_.read().range(*clip);
    text += fmt::format("clip = [{}, {}]\n", shortest(range.low), shortest(range.high));
  }
  return text;
}

void IsaacObservations::list_velocity_point(const YamlPlace& term) {
  for (const Body& body : in_.model().bodies) {
    if (!body.is_free() || body.p_BBcm.norm() < 1e-3) continue;
    in_.left_out(term.path, fmt::format("in training the velocity of the centre of mass of the base, {} mm from the "
                                        "origin of '{}', whose velocity it is here",
                                        shortest(std::round(1e3 * body.p_BBcm.norm())), body.name));
    return;
  }
}

std::vector<std::string> IsaacObservations::term_joints(const YamlPlace& term, const YamlPlace& params) {
  const auto asset = YamlValues::child(params, "asset_cfg");
  if (!asset) return in_.names();
  if (const auto name = YamlValues::child(*asset, "name");
      name && in_.read().text(*name) != YamlValues::key(in_.robot())) {
    in_.read().fail(term, fmt::format("it observes '{}', and the policy acts on '{}'", in_.read().text(*name),
                                      YamlValues::key(in_.robot())));
  }
  const auto joint_names = YamlValues::child(*asset, "joint_names");
  if (joint_names) return in_.matching(*joint_names, in_.read().flag(*asset, "preserve_order", false));
  const auto ids = YamlValues::child(*asset, "joint_ids");
  if (ids && ids->node->kind == YamlNode::Kind::kList && !ids->node->tag.ends_with("slice")) {
    in_.read().fail(*ids, "joints by number: write joint_names instead");
  }
  return in_.names();
}

bool IsaacObservations::is_velocity(const YamlPlace& params) {
  const auto name = YamlValues::child(params, "command_name");
  const auto commands = YamlValues::child(in_.root(), "commands");
  if (!name || !commands) return false;
  const auto command = YamlValues::child(*commands, in_.read().text(*name));
  if (!command) return false;
  const auto ranges = YamlValues::child(*command, "ranges");
  if (!ranges || !YamlValues::child(*ranges, "lin_vel_x")) return false;
  command_text(*command, *ranges);
  return true;
}

void IsaacObservations::command_text(const YamlPlace& command, const YamlPlace& ranges) {
  if (in_.has_command()) return;
  in_.take_command(ranges);
  if (in_.read().flag(command, "heading_command", false)) {
    in_.left_out(command.path + ".heading_command",
                 "the turning rate followed from a heading: here it is that of [command]");
  }
}

}  // namespace assay
