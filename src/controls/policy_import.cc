#include "controls/policy_import.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/terminal.h"
#include "base/text.h"
#include "controls/toml_text.h"

namespace assay {
namespace {

constexpr int kMostZeros = 100'000;

std::string names_text(const std::vector<std::string>& names) {
  std::string text = "[\n";
  for (const std::string& name : names) text += fmt::format("  {},\n", toml_text(name));
  return text + "]";
}

size_t index_in(const std::vector<std::string>& all, const std::string& name) {
  return static_cast<size_t>(std::ranges::find(all, name) - all.begin());
}

}  // namespace

bool nearly(double a, double b) { return std::abs(a - b) <= 1e-6 * std::max({1.0, std::abs(a), std::abs(b)}); }

std::string vector_text(const std::vector<double>& values) {
  std::vector<std::string> texts;
  texts.reserve(values.size());
  for (const double value : values) texts.push_back(shortest(value));
  return "(" + join(texts, ", ") + ")";
}

std::string quoted_list(const std::vector<std::string>& names) {
  std::vector<std::string> quoted;
  quoted.reserve(names.size());
  for (const std::string& name : names) quoted.push_back(fmt::format("'{}'", name));
  return join(quoted, ", ");
}

std::string some_of(const std::vector<std::string>& names) {
  constexpr size_t kMost = 3;
  if (names.size() <= kMost + 1) return quoted_list(names);
  return fmt::format("{} and {} more", quoted_list({names.begin(), names.begin() + kMost}), names.size() - kMost);
}

std::string per_joint(const std::string& key, const std::vector<std::string>& names,
                      const std::vector<double>& values) {
  const bool equal = std::ranges::all_of(values, [&](double value) { return value == values.front(); });
  if (equal) return fmt::format("{} = {}\n", key, shortest(values.front()));
  std::string text = key + " = [\n";
  for (size_t i = 0; i < values.size(); ++i) {
    text += fmt::format("  {}, # {}\n", shortest(values[i]), printable(names[i]));
  }
  return text + "]\n";
}

std::vector<std::string> breadth_first_joints(const Model& model) {
  // of equal depth: their parents' order, then the file's
  std::vector<int> queue = {kWorld};
  std::vector<std::string> names;
  for (size_t at = 0; at < queue.size(); ++at) {
    for (size_t i = 0; i < model.bodies.size(); ++i) {
      const Body& body = model.bodies[i];
      if (body.parent != queue[at]) continue;
      queue.push_back(static_cast<int>(i));
      if (body.joint >= 0) names.push_back(model.joints[static_cast<size_t>(body.joint)].name);
    }
  }
  return names;
}

PolicyImporter::PolicyImporter(const Model& model, const YamlTree& tree, const std::string& path, std::string kind,
                               const PolicyImportOptions& options)
    : model_(model), root_{&tree.root(), ""}, path_(path), options_(options), read_(path, std::move(kind)) {
  for (const std::string& text : options.ignore) {
    const size_t equals = text.rfind('=');
    Ignored ignored = {text.substr(0, equals), std::nullopt, false};
    if (equals != std::string::npos) {
      const auto count = parse_integer(text.substr(equals + 1));
      if (!count || *count < 1 || *count > kMostZeros) {
        throw InputError(
            fmt::format("--ignore is '{}': give PATH, or PATH=COUNT with a count from 1 to {}", text, kMostZeros));
      }
      ignored.zeros = static_cast<int>(*count);
    }
    ignored_.push_back(std::move(ignored));
  }
}

PolicyImporter::Ignored* PolicyImporter::ignored(const std::string& path) {
  for (Ignored& each : ignored_) {
    if (path == each.path || path.ends_with("." + each.path)) {
      each.used = true;
      return &each;
    }
  }
  return nullptr;
}

void PolicyImporter::must_ignore(const YamlPlace& place, const std::string& meaning) {
  if (ignores(place, meaning)) return;
  part([&] { read_.fail(place, fmt::format("{}; --ignore {} leaves it out", meaning, place.path)); });
}

bool PolicyImporter::ignores(const YamlPlace& place, const std::string& meaning) {
  if (ignored(place.path) == nullptr) return false;
  left_out(place.path, "IGNORED: " + meaning);
  return true;
}

void PolicyImporter::throw_problems() const {
  if (problems_.empty()) return;
  if (problems_.size() == 1) throw InputError(problems_.front());
  throw InputError(fmt::format("'{}' has {}: {}", path_, counted(problems_.size(), "problem"), join(problems_, "; ")));
}

std::string PolicyImporter::hold_text(const std::vector<Held>& held) {
  if (held.empty()) return "";
  std::vector<std::string> names;
  std::vector<double> positions, stiffness, damping;
  for (const Held& each : held) {
    names.push_back(each.joint);
    positions.push_back(each.position);
    stiffness.push_back(each.stiffness);
    damping.push_back(each.damping);
  }
  return fmt::format("\n[hold]\njoints = {}\n", names_text(names)) + assay::per_joint("position", names, positions) +
         assay::per_joint("stiffness", names, stiffness) + assay::per_joint("damping", names, damping);
}

std::optional<int> PolicyImporter::zeros_for(const std::string& path) {
  const Ignored* option = ignored(path);
  return option == nullptr ? std::nullopt : option->zeros;
}

std::vector<std::string> PolicyImporter::robot_joints() const {
  std::vector<std::string> known;
  known.reserve(model_.joints.size());
  for (const Joint& joint : model_.joints) known.push_back(joint.name);
  if (known.empty()) throw InputError(fmt::format("'{}' has no hinge or slide for a policy to act on", model_.name));
  return known;
}

void PolicyImporter::take_joints(const std::vector<std::string>& otherwise, const std::string& where_from) {
  const std::vector<std::string> known = robot_joints();
  names_ = options_.joints.empty() ? otherwise : options_.joints;
  joint_order_ = options_.joints.empty() ? where_from : "order of joints: that of --joints";
  std::set<std::string> seen;
  for (const std::string& name : names_) {
    if (std::ranges::find(known, name) == known.end()) {
      throw InputError(fmt::format("--joints names '{}', which is no hinge or slide of '{}'{}", name, model_.name,
                                   did_you_mean(name, known)));
    }
    if (!seen.insert(name).second) {
      throw InputError(fmt::format("--joints names '{}' twice: name each joint once", name));
    }
    joints_.push_back(index_in(known, name));
  }
}

size_t PolicyImporter::index_of(const std::string& name) const { return joints_[index_in(names_, name)]; }

const Joint& PolicyImporter::joint(const std::string& name) const { return model_.joints[index_of(name)]; }

std::string PolicyImporter::joints_line(const std::vector<std::string>& names) const {
  return names == names_ ? "" : fmt::format("joints = {}\n", names_text(names));
}

bool PolicyImporter::has_free_base() const { return std::ranges::any_of(model_.bodies, &Body::is_free); }

void PolicyImporter::list_start(const std::string& path) {
  std::vector<std::string> elsewhere;
  for (size_t i = 0; i < names_.size(); ++i) {
    if (!nearly(model_.initial.position[joints_[i]], default_pos_[i])) elsewhere.push_back(names_[i]);
  }
  if (elsewhere.empty()) return;
  left_out(path, fmt::format("runs start at the robot's own initial state, which is another for {}: give the model a "
                             "keyframe",
                             some_of(elsewhere)));
}

void PolicyImporter::take_command(const YamlPlace& ranges) {
  std::array<Range, 3> of;
  size_t i = 0;
  for (const char* key : {"lin_vel_x", "lin_vel_y", "ang_vel_z"}) of.at(i++) = read_.range(read_.need(ranges, key));
  std::array<double, 3> velocity = {std::clamp(of[0].high / 2, of[0].low, of[0].high),
                                    std::clamp(0.0, of[1].low, of[1].high), std::clamp(0.0, of[2].low, of[2].high)};
  if (options_.command) velocity = *options_.command;
  left_out(ranges.path,
           fmt::format("commands at random, forward {} to {} m/s, left {} to {} m/s, turning {} to {} rad/s: here one, "
                       "{}{}",
                       shortest(of[0].low), shortest(of[0].high), shortest(of[1].low), shortest(of[1].high),
                       shortest(of[2].low), shortest(of[2].high), vector_text({velocity.begin(), velocity.end()}),
                       options_.command ? "" : "; --command chooses another"));
  for (size_t k = 0; k < velocity.size(); ++k) {
    if (velocity.at(k) >= of.at(k).low && velocity.at(k) <= of.at(k).high) continue;
    left_out(ranges.path, "the command is outside of what the policy was trained with");
    break;
  }
  command_text_ = fmt::format("\n[command]\nvelocity = [{}, {}, {}]\n", shortest(velocity[0]), shortest(velocity[1]),
                              shortest(velocity[2]));
}

void PolicyImporter::take_history(const YamlPlace& place, int steps) {
  if (history_ && *history_ != steps) {
    read_.fail(place, fmt::format("a history of {} steps where others have {}, and assay has one for all terms", steps,
                                  *history_));
  }
  history_ = steps;
}

std::string PolicyImporter::history_text(int steps) {
  if (steps <= 1) return "";
  return fmt::format(
      "history = {}\nhistory_order = \"oldest_first\"\nhistory_layout = \"term\"\n"
      "history_start = \"first\"\n",
      steps);
}

void PolicyImporter::list_no_termination(const std::string& path) {
  left_out(path, "nothing of it says here when the robot has fallen: give [termination] its height or tilt");
}

PolicyImport PolicyImporter::finish(const std::string& trained_in, const std::string& parts) const {
  throw_problems();
  for (const Ignored& each : ignored_) {
    if (!each.used) {
      throw InputError(
          fmt::format("--ignore {} names nothing of '{}' that has to be ignored: leave it out", each.path, path_));
    }
  }
  PolicyImport result;
  result.joints = names_;
  result.joint_order = joint_order_;
  result.left_out = left_out_;
  result.toml = fmt::format("# Written by assay import from {}. docs/guide.md explains the keys.\n", printable(path_));
  for (const LeftOut& each : left_out_) {
    result.toml += fmt::format("# left out: {}: {}\n", printable(each.path), printable(each.meaning));
  }
  if (!options_.network.empty()) result.toml += fmt::format("network = {}\n", toml_text(options_.network));
  const std::string contender = options_.trained_in.empty() ? trained_in : options_.trained_in;
  if (!contender.empty()) result.toml += fmt::format("trained_in = {}\n", toml_text(contender));
  result.toml += fmt::format("# {}\njoints = {}\n", joint_order_, names_text(names_));
  result.toml += per_joint("default_joint_pos", names_, default_pos_);
  result.toml += parts;
  return result;
}

}  // namespace assay
