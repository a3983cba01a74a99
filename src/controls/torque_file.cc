#include "controls/torque_file.h"

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <vector>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/input_file.h"
#include "base/text.h"
#include "controls/csv_line.h"

namespace assay {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{256} << 20;

class FileControl final : public Control {
 public:
  FileControl(const Model& model, const std::string& path) {
    const std::string text = input_text(path, "the file of torques", "a CSV file", kMostBytes);
    hash_ = content_hash(text);
    std::istringstream lines(text);
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
      const auto fail = [&](const std::string& what) {
        throw InputError(fmt::format("{}:{}: {}", path, number, what));
      };
      const std::vector<std::string> fields = csv_fields(line);
      if (columns_ == 0) {
        read_header(model, fields, fail);
        continue;
      }
      if (fields.size() != columns_) {
        fail(fmt::format("there are {} columns, but the header has {}: give one value for each", fields.size(),
                         columns_));
      }
      for (size_t i = 0; i < fields.size(); ++i) {
        const auto value = parse_number(fields[i]);
        if (!value) {
          fail(fmt::format("column {} is '{}': give a finite number, {}", i + 1, fields[i],
                           i == 0 ? "the time in seconds" : "the torque in Nm (N for a slide)"));
        }
        (i == 0 ? time_ : torque_).push_back(*value);
      }
      if (time_.size() > 1 && time_.back() <= time_[time_.size() - 2]) {
        fail(fmt::format("the time {} does not come after {}: sort the lines by time", fields.front(),
                         shortest(time_[time_.size() - 2])));
      }
    }
    if (columns_ == 0) throw InputError(fmt::format("the file of torques '{}' is empty: begin with a header", path));
    if (time_.empty()) {
      throw InputError(fmt::format("the file of torques '{}' has only a header: add a line for each time", path));
    }
  }

  void torques(const State& state, std::span<double> torques) const override {
    std::ranges::fill(torques, 0.0);
    const auto above = static_cast<size_t>(std::ranges::upper_bound(time_, state.time) - time_.begin());
    const size_t low = above == 0 ? 0 : above - 1, high = std::min(above, time_.size() - 1);
    const double share = low == high ? 0 : (state.time - time_[low]) / (time_[high] - time_[low]);
    for (size_t i = 0; i < of_column_.size(); ++i) {
      const double from = torque_[low * of_column_.size() + i], to = torque_[high * of_column_.size() + i];
      torques[of_column_[i]] = from + share * (to - from);
    }
  }
  ControlInput input() const override { return is_zero() ? ControlInput::kNothing : ControlInput::kTime; }
  bool is_zero() const override {
    return std::ranges::all_of(torque_, [](double torque) { return torque == 0; });
  }
  std::string description() const override {
    if (is_zero()) return "passive";
    return fmt::format("torques of {} joints from a file of {} lines, {}", of_column_.size(), time_.size(),
                       hash_.substr(0, 12));
  }

 private:
  template <typename Fail>
  void read_header(const Model& model, const std::vector<std::string>& fields, const Fail& fail) {
    std::vector<std::string> names;
    names.reserve(model.joints.size());
    for (const Joint& joint : model.joints) names.push_back(joint.name);
    if (fields.front() != "time") {
      fail(fmt::format("the header begins with '{}': write time and names of joints, as in time,{}", fields.front(),
                       names.empty() ? "knee" : names.front()));
    }
    for (size_t i = 1; i < fields.size(); ++i) {
      const auto found = std::ranges::find(names, fields[i]);
      if (found == names.end()) {
        fail(fmt::format("'{}' is no hinge or slide of '{}'{}", fields[i], model.name, did_you_mean(fields[i], names)));
      }
      const auto joint = static_cast<size_t>(found - names.begin());
      if (std::ranges::find(of_column_, joint) != of_column_.end()) {
        fail(fmt::format("the joint '{}' has two columns: leave one out", fields[i]));
      }
      of_column_.push_back(joint);
    }
    if (of_column_.empty()) fail("the header names no joint: write time and names of joints");
    columns_ = fields.size();
  }

  size_t columns_ = 0;
  std::vector<size_t> of_column_;      // the joint of each column after the time
  std::vector<double> time_, torque_;  // s; a torque for each time and column
  std::string hash_;
};

}  // namespace

std::unique_ptr<Control> file_control(const Model& model, const std::string& path) {
  return std::make_unique<FileControl>(model, path);
}

}  // namespace assay
