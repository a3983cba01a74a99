#include "controls/recorded_actions.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/text.h"
#include "controls/csv_line.h"

namespace assay {
namespace {

class RecordedSource final : public ActionSource {
 public:
  explicit RecordedSource(const RecordedActions& recorded) : recorded_(recorded) {}

  void act(std::span<const double> /*observation*/, std::span<double> actions) override {
    const double* from = recorded_.actions.data() + std::min(next_, recorded_.steps - 1) * actions.size();
    std::copy_n(from, actions.size(), actions.begin());
    ++next_;
  }

 private:
  const RecordedActions& recorded_;
  size_t next_ = 0;
};

// The action of each column.
std::vector<size_t> columns_of(const std::vector<std::string>& header, const std::string& path, int line,
                               const PolicyConfig& config, const Model& model) {
  std::vector<std::string> names;
  names.reserve(config.joints.size());
  for (const int joint : config.joints) names.push_back(model.joints[static_cast<size_t>(joint)].name);
  if (header.size() != names.size()) {
    throw InputError(fmt::format(
        "{}:{}: the header names {}, but the configuration '{}' has {}: give a column for "
        "each of {}",
        path, line, counted(header.size(), "joint"), config.path, counted(names.size(), "action"), join(names, ", ")));
  }
  std::vector<size_t> columns;
  for (const std::string& name : header) {
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      throw InputError(fmt::format("{}:{}: '{}' gets no action in the configuration '{}'{}", path, line, name,
                                   config.path, did_you_mean(name, names)));
    }
    const auto action = static_cast<size_t>(found - names.begin());
    if (std::ranges::find(columns, action) != columns.end()) {
      throw InputError(fmt::format("{}:{}: the joint '{}' has two columns: leave one out", path, line, name));
    }
    columns.push_back(action);
  }
  return columns;
}

}  // namespace

RecordedActions parse_recorded_actions(const std::string& text, const std::string& path, const PolicyConfig& config,
                                       const Model& model) {
  RecordedActions recorded;
  std::vector<size_t> columns;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::vector<std::string> fields = csv_fields(line);
    if (columns.empty()) {
      columns = columns_of(fields, path, number, config, model);
      continue;
    }
    if (fields.size() != columns.size()) {
      throw InputError(fmt::format("{}:{}: there are {} columns, but the header has {}: give one value for each", path,
                                   number, fields.size(), columns.size()));
    }
    const size_t at = recorded.actions.size();
    recorded.actions.resize(at + columns.size());
    for (size_t i = 0; i < fields.size(); ++i) {
      const auto value = parse_number(fields[i]);
      if (!value) {
        throw InputError(fmt::format("{}:{}: column {} is '{}': give a finite number", path, number, i + 1, fields[i]));
      }
      recorded.actions[at + columns[i]] = *value;
    }
    ++recorded.steps;
  }
  if (recorded.steps == 0) {
    throw InputError(
        fmt::format("the file of actions '{}' has no line of actions: give a header with names of joints "
                    "and a line for each control step",
                    path));
  }
  return recorded;
}

std::unique_ptr<ActionSource> recorded_actions(const RecordedActions& recorded) {
  return std::make_unique<RecordedSource>(recorded);
}

}  // namespace assay
