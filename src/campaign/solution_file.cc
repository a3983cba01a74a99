#include "campaign/solution_file.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/text.h"
#include "controls/csv_line.h"
#include "model/kinematics.h"

namespace assay {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{256} << 20;
constexpr double kSameTime = 1e-9;  // s

constexpr auto kColumns = std::to_array<std::string_view>(
    {"time", "body", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz", "wx", "wy", "wz"});
enum Column { kTime, kBody, kX, kQw = 5, kVx = 9, kWx = 12 };

class SolutionFile {
 public:
  SolutionFile(const Model& model, const std::string& text, const std::string& path, const std::vector<double>& times)
      : model_(model), text_(text), path_(path), times_(times) {
    for (const double time : times) {
      states_.push_back(model.initial);
      states_.back().time = time;
    }
    for (size_t i = 0; i < model.bodies.size(); ++i) bodies_[model.bodies[i].name] = i;
    given_.assign(times.size(), std::vector<bool>(model.bodies.size(), false));
  }

  std::vector<State> read() {
    std::istringstream lines(text_);
    for (std::string line; std::getline(lines, line);) {
      ++number_;
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      fields_ = csv_fields(line);
      columns_ == 0 ? read_header() : read_state();
    }
    if (columns_ == 0) throw InputError(fmt::format("the file of a solution '{}' is empty", path_));
    for (size_t t = 0; t < times_.size(); ++t) {
      for (size_t i = 0; i < model_.bodies.size(); ++i) {
        if (given_[t][i]) continue;
        throw InputError(fmt::format(
            "the solution '{}' has no line for body '{}' at {} s: give one for each body and sample (sample_ms)", path_,
            model_.bodies[i].name, shortest(times_[t])));
      }
      joints_from_bodies(model_, states_[t]);
    }
    return std::move(states_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("{}:{}: {}", path_, number_, what));
  }

  void read_header() {
    columns_ = fields_.size();
    for (size_t i = 0; i < kColumns.size(); ++i) {
      const auto found = std::ranges::find(fields_, kColumns[i]);
      if (found != fields_.end()) {
        place_[i] = static_cast<size_t>(found - fields_.begin());
      } else if (i < kQw) {
        fail(fmt::format("there is no column '{}': begin with a header like time,body,x,y,z", kColumns[i]));
      }
    }
  }

  double at(size_t column) const {
    const auto value = parse_number(fields_[*place_[column]]);
    if (!value) fail(fmt::format("'{}' is '{}': give a finite number", kColumns[column], fields_[*place_[column]]));
    return *value;
  }
  // Of a group of columns that are all there.
  bool has(size_t first, size_t count) const {
    return std::all_of(place_.begin() + static_cast<std::ptrdiff_t>(first),
                       place_.begin() + static_cast<std::ptrdiff_t>(first + count),
                       [](const auto& place) { return place.has_value(); });
  }
  Vec3 vector(size_t first) const { return {at(first), at(first + 1), at(first + 2)}; }

  void read_state() {
    if (fields_.size() != columns_) {
      fail(fmt::format("there are {} columns, but the header has {}", fields_.size(), columns_));
    }
    const double time = at(kTime);
    const auto sample = std::ranges::lower_bound(times_, time - kSameTime);
    if (sample == times_.end() || std::abs(*sample - time) > kSameTime) return;  // between samples, or beside the run
    const std::string& name = fields_[*place_[kBody]];
    const auto body = bodies_.find(name);
    if (body == bodies_.end()) {
      std::vector<std::string> names;
      for (const auto& [known, index] : bodies_) names.push_back(known);
      fail(fmt::format("the model has no body '{}'{}", name, did_you_mean(name, names)));
    }
    const auto t = static_cast<size_t>(sample - times_.begin());
    BodyState& state = states_[t].bodies[body->second];
    state.p_WBcm = vector(kX);
    if (has(kQw, 4)) {
      state.q_WB = Quat(at(kQw), at(kQw + 1), at(kQw + 2), at(kQw + 3));
      if (!(state.q_WB.norm() > 0.5)) fail("the orientation qw, qx, qy, qz is no unit quaternion");
      state.q_WB.normalize();
    }
    if (has(kVx, 3)) state.v_WBcm = vector(kVx);
    if (has(kWx, 3)) state.w_WB = vector(kWx);
    given_[t][body->second] = true;
  }

  const Model& model_;
  const std::string &text_, &path_;
  const std::vector<double>& times_;
  std::vector<State> states_;
  std::map<std::string, size_t, std::less<>> bodies_;
  std::vector<std::vector<bool>> given_;
  std::vector<std::string> fields_;
  std::array<std::optional<size_t>, kColumns.size()> place_;
  size_t columns_ = 0;
  int number_ = 0;
};

}  // namespace

std::vector<State> solution_from_text(const Model& model, const std::string& text, const std::string& path,
                                      const std::vector<double>& times) {
  return SolutionFile(model, text, path, times).read();
}

std::string solution_text(const std::string& path) {
  return input_text(path, "the file of a solution", "a CSV file", kMostBytes);
}

}  // namespace assay
