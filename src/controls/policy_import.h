// What a training wrote, as a policy's configuration (policy_config.h): what every such file has in common.
//
// What maps one to one is taken over, the rest is listed with what it means for a run. What would give the policy other
// numbers than in training is an error until it is named in `ignore`.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "controls/yaml_values.h"
#include "model/model.h"

namespace assay {

struct PolicyImportOptions {
  std::string group = "policy";                  // of `observations`
  std::vector<std::string> joints;               // order in training; empty: the file's, or breadth first in the tree
  std::optional<std::array<double, 3>> command;  // forward, left (m/s), turning (rad/s)
  // Paths in the file, or their ends: what the policy runs without. PATH=COUNT of an observation: that many zeros.
  std::vector<std::string> ignore;
  std::string network;     // as the configuration is to name it; empty: not
  std::string trained_in;  // contender; empty: that of the file's engine
};

// What the configuration does not hold.
struct LeftOut {
  std::string path;     // in the file: "observations.policy.joint_pos.noise"
  std::string meaning;  // for a run
};

struct PolicyImport {
  std::string toml;
  std::vector<std::string> joints;  // in the policy's order
  std::string joint_order;          // where the order comes from, a sentence
  std::vector<LeftOut> left_out;
};

// Names of the robot's hinges and slides, breadth first, as PhysX and so Isaac Lab count them: all of one depth of the
// tree before those of the next, of bodies at one depth in the file's order.
std::vector<std::string> breadth_first_joints(const Model& model);

// "'a', 'b' and 10 more".
std::string some_of(const std::vector<std::string>& names);
std::string quoted_list(const std::vector<std::string>& names);
std::string vector_text(const std::vector<double>& values);  // "(1, 2, 3)"

// A part of a configuration that has a number for each joint: one number where all are equal.
std::string per_joint(const std::string& key, const std::vector<std::string>& names, const std::vector<double>& values);

// Whether two numbers are the same but for their last digits in a text.
bool nearly(double a, double b);

// An import of one file. Both the model and the options have to outlive it.
class PolicyImporter {
 public:
  PolicyImporter(const PolicyImporter&) = delete;
  PolicyImporter& operator=(const PolicyImporter&) = delete;

  const Model& model() const { return model_; }
  const YamlPlace& root() const { return root_; }
  const std::string& path() const { return path_; }
  const PolicyImportOptions& options() const { return options_; }
  const YamlValues& read() const { return read_; }
  const std::vector<std::string>& names() const { return names_; }
  const std::vector<double>& default_pos() const { return default_pos_; }
  bool has_command() const { return !command_text_.empty(); }
  const std::string& command_text() const { return command_text_; }  // [command]
  std::optional<int> history() const { return history_; }

  void left_out(const std::string& path, const std::string& meaning) { left_out_.push_back({path, meaning}); }
  // A part without which the policy is another one: a problem unless an option ignores it, as if it did from here on.
  void must_ignore(const YamlPlace& place, const std::string& meaning);
  // Whether an option ignores it; then it is listed as left out.
  bool ignores(const YamlPlace& place, const std::string& meaning);
  // Of an observation that an option replaces: the number of zeros.
  std::optional<int> zeros_for(const std::string& path);

  // Runs one part of the import. What it throws as InputError becomes a problem, so that all parts name theirs at
  // once; then it is false.
  template <typename Work>
  bool part(const Work& work) {
    try {
      work();
      return true;
    } catch (const InputError& error) {
      problems_.emplace_back(error.what());
      return false;
    }
  }
  // Throws InputError with all problems so far.
  void throw_problems() const;

  // Hinges and slides of the model, in the file's order. Throws InputError where there are none.
  std::vector<std::string> robot_joints() const;
  // Takes the policy's joints in their order: PolicyImportOptions::joints, which are checked, or `otherwise`.
  void take_joints(const std::vector<std::string>& otherwise, const std::string& where_from);
  const Joint& joint(const std::string& name) const;
  size_t index_of(const std::string& name) const;  // in Model::joints
  std::string joints_line(const std::vector<std::string>& names) const;
  bool has_free_base() const;

  // Notes where runs start elsewhere than at default_pos_, whose path is given.
  void list_start(const std::string& path);
  // [command]: what `ranges` (lin_vel_x, lin_vel_y, ang_vel_z) leave to choose.
  void take_command(const YamlPlace& ranges);
  static std::string history_text(int steps);
  // A history's length that is `steps` for all terms; throws InputError at `place` where others have another.
  void take_history(const YamlPlace& place, int steps);
  void list_no_termination(const std::string& path);

  // [hold] for joints that training held by drives, each with its stiffness and damping.
  struct Held {
    std::string joint;
    double position = 0, stiffness = 0, damping = 0;
  };
  static std::string hold_text(const std::vector<Held>& held);

  // The configuration: notes, joints and `parts`. Throws InputError for problems and for an `ignore` that named
  // nothing.
  PolicyImport finish(const std::string& trained_in, const std::string& parts) const;

 protected:
  // `kind` as for YamlValues. Throws InputError for an `ignore` that is no path.
  PolicyImporter(const Model& model, const YamlTree& tree, const std::string& path, std::string kind,
                 const PolicyImportOptions& options);
  ~PolicyImporter() = default;

  const Model& model_;
  YamlPlace root_;
  std::string path_;
  const PolicyImportOptions& options_;
  YamlValues read_;
  std::vector<std::string> names_;  // the policy's joints, in its order
  std::vector<double> default_pos_;
  std::string command_text_;
  std::optional<int> history_;

 private:
  struct Ignored {
    std::string path;
    std::optional<int> zeros;
    bool used = false;
  };
  // The option that names a path or its end.
  Ignored* ignored(const std::string& path);

  std::vector<Ignored> ignored_;
  std::vector<LeftOut> left_out_;
  std::vector<std::string> problems_;
  std::vector<size_t> joints_;  // of each name, index into Model::joints
  std::string joint_order_;
};

}  // namespace assay
