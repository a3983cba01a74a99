#include "match/config.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>
#include <fnmatch.h>

#include "base/input_file.h"
#include "base/text.h"
#include "base/toml_file.h"
#include "campaign/section.h"

namespace assay::match {
namespace {

constexpr std::uintmax_t kMostConfigBytes = std::uintmax_t{1} << 20;
constexpr double kMostWindowS = 1e4;
constexpr int kMostMedian = 1001;

struct Unit {
  const char* name;
  double factor;  // to SI
};
const std::vector<Unit> kTimeUnits = {{"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
const std::vector<Unit> kAngleUnits = {{"rad", 1}, {"deg", kDegree}};
const std::vector<Unit> kSpeedUnits = {{"rad/s", 1}, {"deg/s", kDegree}, {"rpm", 2 * M_PI / 60}};
const std::vector<Unit> kLengthUnits = {{"m", 1}, {"cm", 1e-2}, {"mm", 1e-3}};
const std::vector<Unit> kTorqueUnits = {{"Nm", 1}, {"mNm", 1e-3}, {"Nmm", 1e-3}, {"Ncm", 1e-2}};

class ConfigReader {
 public:
  ConfigReader(const toml::table& table, const std::string& path) : path_(path), root_(table, "the file", path_) {
    config_.path = path;
  }

  MatchConfig read() {
    root_.allow({"columns", "units", "frames", "scale", "offset", "drive", "rows", "held_out", "windows", "fit"});
    read_columns();
    read_units();
    read_frames();
    config_.scale = numbers("scale");
    config_.offset = numbers("offset");
    read_drive();
    read_rows();
    read_held_out();
    read_windows();
    read_fit();
    for (const char* key : {"columns", "scale", "offset", "drive", "rows"}) {
      if (const toml::table* found = table(key)) keep_lines(key, *found);
    }
    return std::move(config_);
  }

 private:
  void keep_lines(const std::string& within, const toml::table& table) {
    for (const auto& [key, node] : table) {
      const std::string name = within + "." + std::string(key.str());
      config_.lines.emplace(name, static_cast<int>(key.source().begin.line));
      if (node.is_table()) keep_lines(name, *node.as_table());
    }
  }
  const toml::table* table(std::string_view key) const {
    const toml::node* node = root_.find(key);
    if (node == nullptr) return nullptr;
    if (!node->is_table()) {
      root_.fail(node, fmt::format("'{}' is {}: write it as a table [{}]", key, node_text(*node), key));
    }
    return node->as_table();
  }
  std::optional<Section> section(std::string_view key) const {
    const toml::table* found = table(key);
    if (found == nullptr) return std::nullopt;
    return Section(*found, fmt::format("[{}]", key), path_);
  }

  double number(const Section& section, std::string_view key, const toml::node& node) const {
    const auto value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !std::isfinite(*value)) {
      section.fail(&node, fmt::format("'{}' is {}: give a finite number", key, node_text(node)));
    }
    return *value;
  }

  std::map<std::string, double> numbers(std::string_view key) const {
    std::map<std::string, double> found;
    const auto section = this->section(key);
    if (!section) return found;
    for (const auto& [name, node] : *table(key)) {
      const double value = number(*section, name.str(), node);
      if (key == "scale" && value == 0) {
        section->fail(
            &node, fmt::format("the scale of '{}' is 0, which leaves nothing of it: give another number", name.str()));
      }
      found.emplace(name.str(), value);
    }
    return found;
  }

  // [low, high], low below high; `what` begins the message.
  std::pair<double, double> range(const Section& section, std::string_view what, const toml::node& node) const {
    const toml::array* array = node.as_array();
    if (array == nullptr || array->size() != 2) {
      section.fail(&node, fmt::format("'{}' is {}: give two numbers, [low, high]", what,
                                      array == nullptr ? node_text(node) : counted(array->size(), "entry", "entries")));
    }
    const double low = number(section, what, *array->get(0)), high = number(section, what, *array->get(1));
    if (low >= high) {
      section.fail(&node,
                   fmt::format("'{}' is [{}, {}]: give the lower number first", what, shortest(low), shortest(high)));
    }
    return {low, high};
  }

  std::vector<std::string> texts(const Section& section, std::string_view key) const {
    std::vector<std::string> found;
    const toml::node* node = section.find(key);
    if (node == nullptr) return found;
    for (const toml::node& entry : section.list(key, *node)) {
      const auto text = entry.value_exact<std::string>();
      if (!text || text->empty()) {
        section.fail(&entry, fmt::format("'{}' has {}: give texts in quotes", key, node_text(entry)));
      }
      found.push_back(*text);
    }
    return found;
  }

  void read_columns() {
    const auto section = this->section("columns");
    if (!section) return;
    for (const auto& [key, node] : *table("columns")) {
      const std::string name(key.str());
      if (name == "ignore") {
        config_.ignored = texts(*section, name);
        continue;
      }
      const std::string text = section->required_text(name);
      if (name == "time") {
        config_.time_column = text;
      } else if (name == "motion") {
        config_.motion_column = text;
      } else if (name == "body") {
        config_.body = text;
      } else {
        config_.columns.emplace(name, text);
      }
    }
  }

  void unit(const Section& section, std::string_view key, const std::vector<Unit>& units, double& scale) const {
    const auto text = section.text(key);
    if (!text) return;
    const auto found = std::ranges::find_if(units, [&](const Unit& unit) { return *text == unit.name; });
    if (found == units.end()) {
      std::vector<std::string> names;
      names.reserve(units.size());
      for (const Unit& unit : units) names.emplace_back(unit.name);
      section.fail(section.find(key), fmt::format("'{}' is '{}': use one of {}", key, *text, join(names, ", ")));
    }
    scale = found->factor;
  }

  void read_units() {
    const auto section = this->section("units");
    if (!section) return;
    section->allow({"time", "angle", "angular_velocity", "length", "torque"});
    unit(*section, "time", kTimeUnits, config_.time_scale);
    unit(*section, "angle", kAngleUnits, config_.angle_scale);
    config_.angular_velocity_scale = config_.angle_scale;
    unit(*section, "angular_velocity", kSpeedUnits, config_.angular_velocity_scale);
    unit(*section, "length", kLengthUnits, config_.length_scale);
    unit(*section, "torque", kTorqueUnits, config_.torque_scale);
  }

  // Whether the second of two choices is written.
  bool second(const Section& section, std::string_view key, const std::string& first, const std::string& other) const {
    const auto text = section.text(key);
    if (text && *text != first && *text != other) {
      section.fail(section.find(key), fmt::format("'{}' is '{}': use {} or {}", key, *text, first, other));
    }
    return text && *text == other;
  }

  void read_frames() {
    const auto section = this->section("frames");
    if (!section) return;
    section->allow({"angular_velocity", "velocity", "point"});
    config_.angular_velocity_in_body = second(*section, "angular_velocity", "world", "body");
    config_.velocity_in_body = second(*section, "velocity", "world", "body");
    config_.point_is_centre_of_mass = second(*section, "point", "frame", "centre_of_mass");
  }

  std::map<std::string, double> gains(const Section& section, std::string_view key) const {
    const toml::node* node = section.find(key);
    std::map<std::string, double> found;
    if (node == nullptr) return found;
    const auto add = [&](const std::string& joint, const toml::node& value) {
      const double gain = number(section, joint.empty() ? key : joint, value);
      if (gain < 0) {
        section.fail(&value, fmt::format("'{}' is {}: give a gain that is not negative", key, shortest(gain)));
      }
      found.emplace(joint, gain);
    };
    if (const toml::table* table = node->as_table()) {
      for (const auto& [joint, value] : *table) add(std::string(joint.str()), value);
    } else {
      add("", *node);
    }
    return found;
  }

  void read_drive() {
    const auto section = this->section("drive");
    if (!section) return;
    section->allow({"law", "stiffness", "damping", "median"});
    if (const auto law = section->text("law")) {
      if (*law == "torque") {
        config_.law = DriveLaw::kTorque;
      } else if (*law == "pd") {
        config_.law = DriveLaw::kPd;
      } else if (*law == "none") {
        config_.law = DriveLaw::kNone;
      } else {
        section->fail(section->find("law"), fmt::format("'law' is '{}': use torque, pd or none", *law));
      }
    }
    config_.stiffness = gains(*section, "stiffness");
    config_.damping = gains(*section, "damping");
    const bool pd = config_.law == DriveLaw::kPd;
    if (pd && config_.stiffness.empty()) {
      section->fail(nullptr, "law = \"pd\" has no 'stiffness': give the gains that ran on the robot");
    }
    for (const char* key : {"stiffness", "damping"}) {
      if (const toml::node* node = section->find(key); node != nullptr && !pd) {
        section->fail(node, fmt::format("'{}' is only of law = \"pd\": give that law, or leave it out", key));
      }
    }
    config_.torque_median = section->count("median", config_.torque_median, 1, kMostMedian);
    if (config_.torque_median % 2 == 0) {
      section->fail(section->find("median"),
                    fmt::format("'median' is {}: give an odd number of samples", config_.torque_median));
    }
  }

  void read_rows() {
    const auto section = this->section("rows");
    if (!section) return;
    for (const auto& [key, node] : *table("rows")) {
      const std::string name(key.str());
      std::vector<std::pair<double, double>> spans;
      for (const toml::node& entry : section->list(name, node)) spans.push_back(range(*section, name, entry));
      std::ranges::sort(spans);
      for (size_t i = 1; i < spans.size(); ++i) {
        if (spans[i].first <= spans[i - 1].second) {
          section->fail(&node, fmt::format("the spans of '{}' overlap at {} s: write them as one", name,
                                           shortest(spans[i].first)));
        }
      }
      config_.rows.emplace_back(name, std::move(spans));
    }
  }

  void read_held_out() {
    const auto section = this->section("held_out");
    if (!section) return;
    section->allow({"logs", "share", "leave_one_out", "seed"});
    config_.held_out = texts(*section, "logs");
    config_.leave_one_out = section->flag("leave_one_out", false);
    config_.held_out_share = section->positive("share", config_.held_out_share);
    if (config_.held_out_share >= 1) {
      section->fail(section->find("share"), fmt::format("'share' is {}: give a number below 1, so that logs are left "
                                                        "to fit to",
                                                        shortest(config_.held_out_share)));
    }
    const int ways = static_cast<int>(!config_.held_out.empty()) + static_cast<int>(config_.leave_one_out) +
                     static_cast<int>(section->find("share") != nullptr);
    if (ways > 1) section->fail(nullptr, "[held_out] has more than one of logs, share, leave_one_out: give one");
    config_.seed = static_cast<std::uint64_t>(section->count("seed", 1, 0, 1'000'000'000));
  }

  double window(const Section& section, std::string_view key, double otherwise) const {
    const double seconds = section.positive(key, otherwise);
    if (seconds > kMostWindowS) {
      section.fail(section.find(key),
                   fmt::format("'{}' is {}: give at most {} s", key, shortest(seconds), shortest(kMostWindowS)));
    }
    return seconds;
  }

  void read_windows() {
    const auto section = this->section("windows");
    if (!section) return;
    section->allow({"fit_s", "report_s", "whole"});
    config_.fit_window_s = window(*section, "fit_s", config_.fit_window_s);
    config_.report_window_s = window(*section, "report_s", config_.report_window_s);
    if (section->find("whole") != nullptr) config_.whole_motions = section->flag("whole", false);
  }

  void read_fit() {
    const auto section = this->section("fit");
    if (!section) return;
    // a table has its keys in alphabetical order, the file in another
    for (const auto& [key, node] : *table("fit")) {
      FitRequest request;
      request.parameter = std::string(key.str());
      request.line = static_cast<int>(key.source().begin.line);
      if (const auto flag = node.value_exact<bool>()) {
        request.fit = *flag;
      } else if (node.is_array()) {
        const auto [low, high] = range(*section, request.parameter, node);
        request.lower = low;
        request.upper = high;
      } else {
        section->fail(&node, fmt::format("'{}' is {}: give true, false or bounds, [low, high]", request.parameter,
                                         node_text(node)));
      }
      config_.fit.push_back(std::move(request));
    }
    std::ranges::stable_sort(config_.fit, {}, [](const FitRequest& request) { return request.line; });
  }

  const std::string path_;
  Section root_;
  MatchConfig config_;
};

}  // namespace

MatchConfig parse_match_config(std::string_view text, const std::string& path) {
  const toml::table table = toml_table(text, path);
  return ConfigReader(table, path).read();
}

MatchConfig read_match_config(const std::string& path) {
  if (path.empty()) return {};
  return parse_match_config(input_text(path, "the configuration", "a TOML file", kMostConfigBytes), path);
}

std::string config_place(const MatchConfig& config, const std::string& key) {
  const auto found = config.lines.find(key);
  return found == config.lines.end() ? config.path : fmt::format("{}:{}", config.path, found->second);
}

double gain_of(const std::map<std::string, double>& gains, const std::string& joint) {
  const auto own = gains.find(joint), all = gains.find("");
  return own != gains.end() ? own->second : all != gains.end() ? all->second : 0;
}

bool matches_pattern(const std::string& name, const std::string& pattern) {
  return ::fnmatch(pattern.c_str(), name.c_str(), FNM_NOESCAPE) == 0;
}

}  // namespace assay::match
