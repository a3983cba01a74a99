#include "match/log.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "isolate/activity.h"
#include "match/log_table.h"

namespace assay::match {
namespace {

constexpr size_t kMostMotions = 100'000;
constexpr std::array kBodyParts = {"x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"};
constexpr size_t kPoseParts = 7, kLinear = 7, kAngular = 10;

enum class JointPart { kPosition, kVelocity, kTorque, kTarget };
constexpr std::array kJointEndings = {"", ".velocity", ".torque", ".target"};

// Something that a column can be.
struct Quantity {
  std::string name;
  int joint = -1;   // index into Model::joints, or
  int body = -1;    // index into Model::bodies
  size_t part = 0;  // of kJointEndings or kBodyParts
};

class Mapping {
 public:
  Mapping(const Model& model, const MatchConfig& config) : model_(model), config_(config) {
    for (size_t j = 0; j < model.joints.size(); ++j) {
      for (size_t part = 0; part < kJointEndings.size(); ++part) {
        add({model.joints[j].name + kJointEndings[part], static_cast<int>(j), -1, part});
      }
    }
    std::vector<size_t> free;
    for (size_t b = 0; b < model.bodies.size(); ++b) {
      if (!model.bodies[b].is_free()) continue;
      free.push_back(b);
      for (size_t part = 0; part < kBodyParts.size(); ++part) {
        add({model.bodies[b].name + "." + kBodyParts[part], -1, static_cast<int>(b), part});
      }
    }
    if (free.size() == 1) bare_ = model.bodies[free.front()].name;
    if (!config.body.empty()) {
      std::vector<std::string> names;
      for (const size_t b : free) names.push_back(model.bodies[b].name);
      if (std::ranges::find(names, config.body) == names.end()) {
        fail("columns.body",
             fmt::format("'{}' is no free body of '{}'{}", config.body, model.name, did_you_mean(config.body, names)));
      }
      bare_ = config.body;
    }
    for (const auto& [name, column] : config.columns) check(name, "columns");
    for (const auto& [name, number] : config.scale) check(name, "scale");
    for (const auto& [name, number] : config.offset) check(name, "offset");
    for (const auto& [gains, key] :
         {std::pair{&config.stiffness, "stiffness"}, std::pair{&config.damping, "damping"}}) {
      for (const auto& [joint, gain] : *gains) {
        if (joint.empty() || is_joint(joint)) continue;
        fail(fmt::format("drive.{}.{}", key, joint),
             fmt::format("'{}' is no hinge or slide of '{}'{}", joint, model.name, did_you_mean(joint, joint_names())));
      }
    }
  }

  // What each column of a file is: number of the column by name of the quantity.
  std::map<std::string, size_t> columns(const std::vector<std::string>& names, const std::string& path) const {
    std::map<std::string, size_t> found;
    std::set<size_t> used;
    const auto number = [&](const std::string& name) {
      return static_cast<size_t>(std::ranges::find(names, name) - names.begin());
    };
    const auto use = [&](const std::string& quantity, size_t column) {
      found.emplace(quantity, column);
      used.insert(column);
    };
    const auto configured = [&](const std::string& key, const std::string& column) {
      if (number(column) == names.size()) {
        fail(key, fmt::format("the log '{}' has no column '{}'{}", path, column, did_you_mean(column, names)));
      }
      return number(column);
    };
    const size_t time = number(config_.time_column);
    if (time == names.size()) {
      throw InputError(
          fmt::format("the log '{}' has no column '{}'{}: name that of the time, 'time' in [columns] of "
                      "--config",
                      path, config_.time_column, time_hint(names)));
    }
    use("time", time);
    if (!config_.motion_column.empty()) use("motion", configured("columns.motion", config_.motion_column));
    for (const auto& [quantity, column] : config_.columns) use(quantity, configured("columns." + quantity, column));
    for (const Quantity& quantity : quantities_) {
      if (found.contains(quantity.name)) continue;
      size_t column = number(quantity.name);
      if (column == names.size() && quantity.body >= 0 && model_.bodies[quantity.body].name == bare_) {
        column = number(kBodyParts[quantity.part]);
      }
      if (column < names.size() && !used.contains(column) && !left_out(names[column])) use(quantity.name, column);
    }
    for (size_t i = 0; i < names.size(); ++i) {
      if (used.contains(i) || ignored(names[i])) continue;
      if (names[i].empty()) {
        throw InputError(
            fmt::format("{}: column {} has no name: give it one in the header, or leave the column out (pandas: "
                        "to_csv(index=False))",
                        path, i + 1));
      }
      std::vector<std::string> known;
      for (const Quantity& quantity : quantities_) {
        if (!found.contains(quantity.name)) known.push_back(quantity.name);
      }
      throw InputError(
          fmt::format("{}: the column '{}' is no joint and no free body of '{}'{}: say what it is in "
                      "[columns] of --config, or put it into 'ignore' there{}",
                      path, names[i], model_.name, hint(names[i], known), orientation_hint(names[i])));
    }
    return found;
  }

  const std::vector<Quantity>& quantities() const { return quantities_; }

  // A number of the file in SI.
  double si(const Quantity& quantity, double value) const {
    const auto scale = config_.scale.find(quantity.name);
    const auto offset = config_.offset.find(quantity.name);
    return value * unit(quantity) * (scale == config_.scale.end() ? 1 : scale->second) +
           (offset == config_.offset.end() ? 0 : offset->second);
  }

 private:
  [[noreturn]] void fail(const std::string& key, const std::string& sentence) const {
    throw InputError(fmt::format("{}: {}", config_place(config_, key), sentence));
  }

  void add(Quantity quantity) { quantities_.push_back(std::move(quantity)); }

  std::vector<std::string> joint_names() const {
    std::vector<std::string> names;
    names.reserve(model_.joints.size());
    for (const Joint& joint : model_.joints) names.push_back(joint.name);
    return names;
  }
  bool is_joint(const std::string& name) const {
    return std::ranges::any_of(model_.joints, [&](const Joint& joint) { return joint.name == name; });
  }

  // Of the nearest name alone: a robot has hundreds.
  static std::string hint(const std::string& word, const std::vector<std::string>& known) {
    const auto near = nearest_name(word, known);
    return near ? fmt::format(" (did you mean '{}'?)", *near) : "";
  }

  void check(const std::string& name, const std::string& table) const {
    std::vector<std::string> names;
    names.reserve(quantities_.size());
    for (const Quantity& quantity : quantities_) names.push_back(quantity.name);
    if (std::ranges::find(names, name) != names.end()) return;
    fail(table + "." + name, fmt::format("'{}' in [{}] is no quantity of '{}'{}: write a joint's name, alone or with "
                                         ".velocity, .torque or .target, or a free body's with .x and so on",
                                         name, table, model_.name, hint(name, names)));
  }

  std::string time_hint(const std::vector<std::string>& names) const {
    // of an .npz an array of two dimensions
    const std::string first = config_.time_column + "[0]";
    if (std::ranges::find(names, first) != names.end()) return fmt::format(" (did you mean '{}'?)", first);
    constexpr size_t kMost = 20;
    const std::vector<std::string> some(names.begin(),
                                        names.begin() + static_cast<std::ptrdiff_t>(std::min(names.size(), kMost)));
    return did_you_mean(config_.time_column, some);
  }

  std::string orientation_hint(std::string column) const {
    std::ranges::transform(column, column.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const bool free = std::ranges::any_of(model_.bodies, &Body::is_free);
    const bool angle = std::ranges::any_of(std::array{"roll", "pitch", "yaw", "euler"},
                                           [&](const char* word) { return column.find(word) != std::string::npos; });
    return free && angle ? "; orientations are read as unit quaternions, qw, qx, qy, qz" : "";
  }

  // Whether the configuration leaves out a column of a quantity's name: by a pattern of more than stars, which are
  // for all that is left.
  bool left_out(const std::string& column) const {
    return std::ranges::any_of(config_.ignored, [&](const std::string& pattern) {
      return pattern.find_first_not_of('*') != std::string::npos && matches_pattern(column, pattern);
    });
  }
  bool ignored(const std::string& column) const {
    return std::ranges::any_of(config_.ignored,
                               [&](const std::string& pattern) { return matches_pattern(column, pattern); });
  }

  double unit(const Quantity& quantity) const {
    if (quantity.body >= 0) {
      if (quantity.part < 3) return config_.length_scale;
      if (quantity.part < kPoseParts) return 1;
      return quantity.part < kAngular ? config_.length_scale : config_.angular_velocity_scale;
    }
    const bool slide = model_.joints[quantity.joint].is_slide();
    switch (static_cast<JointPart>(quantity.part)) {
      case JointPart::kVelocity:
        return slide ? config_.length_scale : config_.angular_velocity_scale;
      case JointPart::kTorque:
        return slide ? 1 : config_.torque_scale;
      default:
        return slide ? config_.length_scale : config_.angle_scale;
    }
  }

  const Model& model_;
  const MatchConfig& config_;
  std::vector<Quantity> quantities_;
  std::string bare_;  // the body of columns without a body's name
};

// One file.
class Reader {
 public:
  Reader(const std::string& path, const Model& model, const MatchConfig& config)
      : path_(path), model_(model), config_(config), mapping_(model, config), faults_(path) {}

  LogFile read() {
    const Activity reading(fmt::format("reading the log '{}'", path_));
    const LogTable table = read_log_table(path_, [&](const auto& names) { return select(names); }, faults_);
    LogFile file;
    for (const auto& [motion, rows] : motions(table)) {
      MeasuredLog log = motion_log(table, rows);
      log.name = motion.empty() ? log_name(path_) : log_name(path_) + "/" + motion;
      log.source = path_;
      if (log.samples() > 0) {
        log.rows = rows_of(log);
        file.logs.push_back(std::move(log));
      }
    }
    if (file.logs.empty() && faults_.empty()) {
      throw InputError(fmt::format("the log '{}' has only a header: add a line for each time", path_));
    }
    file.more_faults = faults_.more();
    file.faults = faults_.take();
    return file;
  }

 private:
  TableSelection select(const std::vector<std::string>& names) {
    names_ = names;
    columns_ = mapping_.columns(names, path_);
    TableSelection selection;
    for (const auto& [quantity, column] : columns_) {
      if (quantity == "motion") {
        selection.motion = column;
      } else {
        place_.emplace(quantity, selection.numbers.size());
        selection.numbers.push_back(column);
      }
    }
    check_sets();
    return selection;
  }

  bool has(const std::string& quantity) const { return place_.contains(quantity); }

  // Whether what belongs together is there.
  void check_sets() const {
    bool any = false;
    for (const Joint& joint : model_.joints) {
      const bool position = has(joint.name);
      any = any || position;
      for (size_t part = 1; part < kJointEndings.size(); ++part) {
        const std::string name = joint.name + kJointEndings[part];
        if (has(name) && !position) {
          throw InputError(fmt::format("the log '{}' has '{}', but no column '{}': give the joint's position, too",
                                       path_, name, joint.name));
        }
      }
    }
    for (const Body& body : model_.bodies) {
      if (!body.is_free()) continue;
      const auto count = [&](size_t first, size_t behind) {
        return std::ranges::count_if(kBodyParts.begin() + static_cast<std::ptrdiff_t>(first),
                                     kBodyParts.begin() + static_cast<std::ptrdiff_t>(behind),
                                     [&](const char* part) { return has(body.name + "." + part); });
      };
      const auto pose = count(0, kPoseParts), all = count(0, kBodyParts.size());
      any = any || pose > 0;
      if (all == 0) continue;
      for (const auto& [first, behind] :
           {std::pair<size_t, size_t>{0, kPoseParts}, {kLinear, kAngular}, {kAngular, kBodyParts.size()}}) {
        const auto there = count(first, behind);
        if (there == static_cast<std::ptrdiff_t>(behind - first) || (there == 0 && first > 0)) continue;
        for (size_t part = first; part < behind; ++part) {
          if (has(body.name + "." + kBodyParts[part])) continue;
          throw InputError(
              fmt::format("the log '{}' has a part of the {} of '{}', but no column '{}.{}': give it, too{}", path_,
                          first == 0 ? "pose" : "velocity", body.name, body.name, kBodyParts[part],
                          first == 0 && part >= 3 ? " (orientations are unit quaternions)" : ""));
        }
      }
    }
    if (any) return;
    const std::string name = !model_.joints.empty()   ? model_.joints.front().name
                             : !model_.bodies.empty() ? model_.bodies.front().name + ".x"
                                                      : "knee";
    throw InputError(
        fmt::format("the log '{}' has no column of a joint or a free body of '{}': name columns as the "
                    "model names them ('{}'), or say what they are in [columns] of --config",
                    path_, model_.name, name));
  }

  using Motion = std::pair<std::string, std::vector<size_t>>;  // name and rows
  std::vector<Motion> motions(const LogTable& table) const {
    std::vector<Motion> found;
    if (table.motion.empty()) {
      found.emplace_back();
      found.front().second.resize(table.line.size());
      for (size_t row = 0; row < table.line.size(); ++row) found.front().second[row] = row;
      return found;
    }
    std::map<std::string, size_t> number;
    for (size_t row = 0; row < table.line.size(); ++row) {
      const auto [at, is_new] = number.try_emplace(table.motion[row], found.size());
      if (is_new) found.emplace_back(table.motion[row], std::vector<size_t>());
      if (found.size() > kMostMotions) {
        throw InputError(
            fmt::format("{}:{}: the column '{}' names more than {} motions: it is no name of a motion, name "
                        "another in [columns]",
                        path_, table.line[row], config_.motion_column, kMostMotions));
      }
      found[at->second].second.push_back(row);
    }
    return found;
  }

  double number(const LogTable& table, const Quantity& quantity, size_t row) const {
    return mapping_.si(quantity, table.numbers[place_.at(quantity.name)][row]);
  }

  // The rows whose times ascend.
  std::vector<size_t> ascending(const LogTable& table, const std::vector<size_t>& rows, MeasuredLog& log) {
    std::vector<size_t> kept;
    const std::vector<double>& time = table.numbers[place_.at("time")];
    for (const size_t row : rows) {
      if (!kept.empty() && time[row] <= time[kept.back()]) {
        faults_.add(table.line[row], config_.time_column,
                    fmt::format("the time {} does not come after {} in line {}", shortest(time[row]),
                                shortest(time[kept.back()]), table.line[kept.back()]),
                    table.motion.empty() ? "remove the line or sort by time; of a file with several motions, name the "
                                           "column that tells them apart ('motion' in [columns])"
                                         : "remove the line, or sort each motion's by time");
        continue;
      }
      kept.push_back(row);
      log.time.push_back(time[row] * config_.time_scale);
      log.line.push_back(table.line[row]);
    }
    return kept;
  }

  MeasuredLog motion_log(const LogTable& table, const std::vector<size_t>& rows) {
    MeasuredLog log;
    std::vector<size_t> kept = ascending(table, rows, log);
    drop_bad_orientations(table, kept, log);
    const std::vector<Quantity>& quantities = mapping_.quantities();
    for (size_t i = 0; i < quantities.size();) {
      const Quantity& first = quantities[i];
      if (first.joint >= 0) {
        if (has(first.name)) {
          MeasuredJoint& joint = log.joints.emplace_back();
          joint.joint = first.joint;
          const std::array<std::vector<double>*, 4> parts = {&joint.position, &joint.velocity, &joint.torque,
                                                             &joint.target};
          for (size_t part = 0; part < parts.size(); ++part) {
            if (!has(quantities[i + part].name)) continue;
            parts[part]->reserve(kept.size());
            for (const size_t row : kept) parts[part]->push_back(number(table, quantities[i + part], row));
          }
          go_on_over_turns(joint);
        }
        i += kJointEndings.size();
      } else {
        if (has(first.name)) log.bodies.push_back(body(table, kept, &first));
        i += kBodyParts.size();
      }
    }
    return log;
  }

  // Sensors of one turn jump where the joint goes on.
  void go_on_over_turns(MeasuredJoint& joint) const {
    const Joint& own = model_.joints[static_cast<size_t>(joint.joint)];
    const auto scale = config_.scale.find(own.name);
    if (own.is_slide() || (scale != config_.scale.end() && std::abs(scale->second) != 1)) return;
    constexpr double kTurn = 2 * std::numbers::pi;
    const auto go_on = [&](std::vector<double>& values) {
      std::vector<size_t> jumps = jumps_of_turn(values, kTurn);
      double added = 0;
      size_t next = 0;
      for (size_t i = 0; i < values.size(); ++i) {
        if (next < jumps.size() && jumps[next] == i) {
          added += values[i] + added > values[i - 1] ? -kTurn : kTurn;
          ++next;
        }
        values[i] += added;
      }
      return jumps;
    };
    joint.turns = go_on(joint.position);
    // a target that jumps with a position that does not is a jump of the target
    if (!joint.turns.empty()) static_cast<void>(go_on(joint.target));
  }

  // Rows with a quaternion that is none.
  void drop_bad_orientations(const LogTable& table, std::vector<size_t>& rows, MeasuredLog& log) {
    constexpr double kTolerance = 0.02;  // of the norm, for numbers that were rounded
    const std::vector<Quantity>& quantities = mapping_.quantities();
    for (const Quantity& quantity : quantities) {
      if (quantity.body < 0 || quantity.part != 3 || !has(quantity.name)) continue;
      std::vector<size_t> good;
      MeasuredLog kept;
      for (size_t i = 0; i < rows.size(); ++i) {
        double sum = 0;
        for (size_t k = 0; k < 4; ++k) sum += std::pow(number(table, (&quantity)[k], rows[i]), 2);
        if (std::abs(std::sqrt(sum) - 1) > kTolerance) {
          faults_.add(
              table.line[rows[i]], names_[columns_.at(quantity.name)],
              fmt::format("the quaternion of '{}' has norm {:.3g}", model_.bodies[quantity.body].name, std::sqrt(sum)),
              "give unit quaternions, and the column of each of qw, qx, qy, qz in [columns]");
          continue;
        }
        good.push_back(rows[i]);
        kept.time.push_back(log.time[i]);
        kept.line.push_back(log.line[i]);
      }
      rows = std::move(good);
      log.time = std::move(kept.time);
      log.line = std::move(kept.line);
    }
  }

  MeasuredBody body(const LogTable& table, const std::vector<size_t>& rows, const Quantity* parts) const {
    MeasuredBody measured;
    measured.body = parts->body;
    const auto vector = [&](size_t first, size_t row) {
      return Vec3(number(table, parts[first], row), number(table, parts[first + 1], row),
                  number(table, parts[first + 2], row));
    };
    const bool linear = has(parts[kLinear].name), angular = has(parts[kAngular].name);
    const Vec3 centre = config_.point_is_centre_of_mass ? model_.bodies[parts->body].p_BBcm : Vec3::Zero();
    for (const size_t row : rows) {
      Quat q(number(table, parts[3], row), number(table, parts[4], row), number(table, parts[5], row),
             number(table, parts[6], row));
      q.normalize();
      if (!measured.q_WB.empty() && q.dot(measured.q_WB.back()) < 0) q.coeffs() *= -1;
      measured.q_WB.push_back(q);
      measured.p_WB.push_back(vector(0, row) - q * centre);
      Vec3 w = Vec3::Zero();
      if (angular) {
        w = vector(kAngular, row);
        if (config_.angular_velocity_in_body) w = q * w;
        measured.w_WB.push_back(w);
      }
      // that of another point needs the angular velocity
      if (linear && (angular || centre.isZero())) {
        Vec3 v = vector(kLinear, row);
        if (config_.velocity_in_body) v = q * v;
        measured.v_WB.push_back(v - w.cross(q * centre));
      }
    }
    return measured;
  }

  std::vector<TimeSpan> rows_of(const MeasuredLog& log) const {
    std::vector<TimeSpan> found;
    bool any = false;
    for (const auto& [pattern, spans] : config_.rows) {
      if (!matches_pattern(log.name, pattern)) continue;
      any = true;
      for (const auto& [from, to] : spans) {
        if (to < log.time.front() || from > log.time.back()) {
          throw InputError(fmt::format("{}: the span [{}, {}] s lies outside of '{}', which goes from {} to {} s",
                                       config_place(config_, "rows." + pattern), shortest(from), shortest(to), log.name,
                                       shortest(log.time.front()), shortest(log.time.back())));
        }
        found.push_back({from, to});
      }
    }
    if (!any) return {{log.time.front(), log.time.back()}};
    std::ranges::sort(found, {}, &TimeSpan::from);
    return found;
  }

  const std::string& path_;
  const Model& model_;
  const MatchConfig& config_;
  const Mapping mapping_;
  LogFaults faults_;
  std::vector<std::string> names_;
  std::map<std::string, size_t> columns_;  // quantity -> column of the file
  std::map<std::string, size_t> place_;    // quantity -> place in LogTable::numbers
};

}  // namespace

bool MeasuredLog::has_torque() const {
  return std::ranges::any_of(joints, [](const MeasuredJoint& joint) { return !joint.torque.empty(); });
}

const MeasuredJoint* MeasuredLog::joint(int index) const {
  const auto found = std::ranges::find(joints, index, &MeasuredJoint::joint);
  return found == joints.end() ? nullptr : &*found;
}

const MeasuredBody* MeasuredLog::body(int index) const {
  const auto found = std::ranges::find(bodies, index, &MeasuredBody::body);
  return found == bodies.end() ? nullptr : &*found;
}

std::string fault_text(const LogFault& fault) {
  std::string text = fault.source;
  if (fault.line > 0) text += fmt::format(":{}", fault.line);
  if (!fault.column.empty()) text += fmt::format(": column '{}'", fault.column);
  return fmt::format("{}: {}: {}", text, fault.text, fault.fix);
}

LogFile inspect_log_file(const std::string& path, const Model& model, const MatchConfig& config) {
  return Reader(path, model, config).read();
}

std::vector<MeasuredLog> read_logs(const std::vector<std::string>& paths, const Model& model,
                                   const MatchConfig& config) {
  std::vector<MeasuredLog> logs;
  std::map<std::string, std::string> source;
  for (const std::string& path : paths) {
    LogFile file = inspect_log_file(path, model, config);
    if (!file.faults.empty()) {
      const size_t more = file.faults.size() - 1 + file.more_faults;
      std::vector<std::string> lines;
      constexpr size_t kMost = 5;
      for (size_t i = 1; i < file.faults.size() && i <= kMost; ++i)
        lines.push_back(std::to_string(file.faults[i].line));
      throw InputError(fault_text(file.faults.front()) +
                       (more == 0 ? ""
                                  : fmt::format(" ({}, in lines {}{})", counted(more, "more fault"), join(lines, ", "),
                                                more > lines.size() ? ", ..." : "")));
    }
    for (MeasuredLog& log : file.logs) {
      const auto [at, is_new] = source.emplace(log.name, path);
      if (!is_new) {
        throw InputError(fmt::format("the logs '{}' and '{}' are both called '{}': give each file a name of its own",
                                     at->second, path, log.name));
      }
      logs.push_back(std::move(log));
    }
  }
  check_names(logs, config);
  return logs;
}

void check_names(const std::vector<MeasuredLog>& logs, const MatchConfig& config) {
  std::vector<std::string> names;
  names.reserve(logs.size());
  for (const MeasuredLog& log : logs) names.push_back(log.name);
  const auto check = [&](const std::string& pattern, const std::string& key) {
    if (std::ranges::any_of(names, [&](const std::string& name) { return matches_pattern(name, pattern); })) return;
    const auto near = nearest_name(pattern, names);
    throw InputError(fmt::format("{}: no log is called '{}'{}", config_place(config, key), pattern,
                                 near ? fmt::format(" (did you mean '{}'?)", *near) : ""));
  };
  for (const auto& [pattern, spans] : config.rows) check(pattern, "rows." + pattern);
  for (const std::string& pattern : config.held_out) check(pattern, "held_out.logs");
}

std::vector<size_t> jumps_of_turn(const std::vector<double>& values, double turn) {
  if (values.size() < 4) return {};
  const auto [low, high] = std::ranges::minmax(values);
  constexpr double kSlack = 0.02, kJump = 0.75, kStill = 0.03, kNeighbours = 3;  // shares of a turn; times
  if (high - low > (1 + kSlack) * turn) return {};
  const auto step = [&](size_t i) { return values[i] - values[i - 1]; };
  std::vector<size_t> jumps;
  for (size_t i = 1; i < values.size(); ++i) {
    if (std::abs(step(i)) < kJump * turn) continue;
    // what is left must be a step like those before and behind; that of a glitch is not
    const double before = std::abs(step(i > 1 ? i - 1 : i + 1)),
                 behind = std::abs(step(i + 1 < values.size() ? i + 1 : i - 1));
    const double left = std::abs(turn - std::abs(step(i)));
    if (left <= std::max(kStill * turn, kNeighbours * std::min(before, behind))) jumps.push_back(i);
  }
  return jumps;
}

std::vector<double> running_median(const std::vector<double>& values, int samples) {
  const size_t half = static_cast<size_t>(std::max(samples, 1)) / 2;
  if (half == 0) return values;
  std::vector<double> medians(values.size()), around;
  for (size_t i = 0; i < values.size(); ++i) {
    // shorter at the ends, and always of as many samples on both sides
    const size_t reach = std::min({half, i, values.size() - 1 - i});
    const auto from = values.begin() + static_cast<std::ptrdiff_t>(i - reach);
    around.assign(from, from + static_cast<std::ptrdiff_t>(2 * reach + 1));
    const auto middle = around.begin() + static_cast<std::ptrdiff_t>(reach);
    std::ranges::nth_element(around, middle);
    medians[i] = *middle;
  }
  return medians;
}

std::vector<double> without_glitches(const std::vector<double>& values, int samples) {
  constexpr double kFar = 4 * 1.4826;  // median deviations; 1.4826 of them are a standard deviation
  const size_t half = static_cast<size_t>(std::max(samples, 1)) / 2;
  const std::vector<double> medians = running_median(values, samples);
  std::vector<double> kept = values, off;
  for (size_t i = 0; i < values.size(); ++i) {
    const size_t reach = std::min({half, i, values.size() - 1 - i});
    off.clear();
    for (size_t k = i - reach; k <= i + reach; ++k) off.push_back(std::abs(values[k] - medians[i]));
    const auto middle = off.begin() + static_cast<std::ptrdiff_t>(reach);
    std::ranges::nth_element(off, middle);
    if (std::abs(values[i] - medians[i]) > kFar * *middle) kept[i] = medians[i];
  }
  return kept;
}

DriveLaw drive_law(const std::vector<MeasuredLog>& logs, const MatchConfig& config) {
  if (config.law) return *config.law;
  const bool torques =
      !logs.empty() && std::ranges::all_of(logs, [](const MeasuredLog& log) { return log.has_torque(); });
  return torques ? DriveLaw::kTorque : DriveLaw::kNone;
}

}  // namespace assay::match
