#include "match/fit.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include <Eigen/SVD>
#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/json.h"
#include "match/optimiser.h"

namespace assay::match {
namespace {

using nlohmann::json;

// Where the loss of a sample turns from its square to its size: degrees, percent of the size.
constexpr double kJointDelta = 2, kBodyDelta = 5;
constexpr double kGradientStep = 0.02, kInformationStep = 0.05, kRoughInformationStep = 0.3;  // expected deviations
constexpr double kWidest = 1;      // interval, in sizes of the parameters (optimiser.py): wider is not determined
constexpr double kEqual = 0.02;    // of the cost: starts that end so near to the best end equally well
constexpr int kResamples = 1000;   // of the bootstrap
constexpr size_t kEnoughLogs = 8;  // fewer are no clusters of their own

double huber(double size, double delta) { return size <= delta ? 0.5 * size * size : delta * (size - 0.5 * delta); }

double cost_of(const Windows& windows, const std::vector<size_t>& training, const std::vector<MatchRun>& runs) {
  double sum = 0;
  size_t count = 0;
  for (size_t i = 0; i < training.size(); ++i) {
    const Window& window = windows.all()[training[i]];
    for (const WindowError& error : windows.sample_errors(window, runs[i])) {
      if (!window.joints.empty()) sum += huber(error.joints, kJointDelta);
      if (!window.message.flights.empty()) sum += huber(error.position, kBodyDelta) + huber(error.rotation, kBodyDelta);
      ++count;
    }
  }
  return sum / static_cast<double>(std::max<size_t>(count, 1));
}

// Takes out of residuals what an error of the first states explains: they are known only as well as the samples around
// them, and a fit that takes them for exact answers with its parameters. To first order each window's first state is
// free within its noise, and its best choice is put in; what is left is as if the samples alone were noisy.
class FirstStates {
 public:
  FirstStates(const Windows& windows, const std::vector<size_t>& training) : windows_(windows), training_(training) {
    for (const size_t index : training) {
      components_ = std::max(components_, 2 * windows.all()[index].joints.size());
    }
    taken_.resize(training.size());
  }

  // Numbers of a first state, which linearise() simulates one by one.
  size_t components() const { return components_; }

  void linearise(Evaluator& evaluator, const Candidate& candidate) {
    std::vector<size_t> asked;
    std::vector<std::vector<double>> offsets;
    std::vector<size_t> first;  // run of each window
    for (const size_t index : training_) {
      const Window& window = windows_.all()[index];
      first.push_back(asked.size());
      const size_t joints = window.message.position.size();
      asked.push_back(index);
      offsets.emplace_back(2 * joints, 0.0);
      for (size_t k = 0; k < 2 * window.joints.size(); ++k) {
        asked.push_back(index);
        offsets.emplace_back(2 * joints, 0.0);
        const bool rate = k >= window.joints.size();
        const auto joint = static_cast<size_t>(window.joints[rate ? k - window.joints.size() : k]);
        offsets.back()[(rate ? joints : 0) + joint] = step(window, k);
      }
    }
    const std::vector<MatchRun> runs = evaluator.simulate({candidate}, asked, offsets).front();
    for (size_t w = 0; w < training_.size(); ++w) {
      const Window& window = windows_.all()[training_[w]];
      taken_[w] = taken(window, runs, first[w]);
    }
  }

  // Changes the residuals of training window number `w`.
  void take_out(size_t w, std::vector<double>& residuals) const {
    const Taken& taken = taken_[w];
    if (taken.basis.size() == 0) return;
    Eigen::Map<Eigen::VectorXd> all(residuals.data(), static_cast<Eigen::Index>(residuals.size()));
    all -= taken.basis * taken.share.cwiseProduct(taken.basis.transpose() * all).eval();
  }

 private:
  struct Taken {
    Eigen::MatrixXd basis;  // columns: orthonormal directions of a window's residuals
    Eigen::VectorXd share;  // that is taken out along each
  };

  static double noise(const Window& window, size_t k) {
    // the polynomial's own error comes on top of the noise of its samples
    constexpr double kSlack = 4;
    const size_t joints = window.joints.size();
    return kSlack * window.joint_noise[k % joints][k < joints ? 0 : 1];
  }
  static double step(const Window& window, size_t k) {
    constexpr double kLeast = 1e-4;  // above what single precision rounds
    return std::max(noise(window, k), kLeast);
  }

  Taken taken(const Window& window, const std::vector<MatchRun>& runs, size_t first) const {
    const size_t joints = window.joints.size();
    double variance = 0;  // of a sample, in the unit of residuals
    for (size_t j = 0; j < joints; ++j) {
      variance +=
          std::pow(windows_.unit_of(window.joints[j]) * window.joint_noise[j][2], 2) / static_cast<double>(joints);
    }
    if (joints == 0 || variance <= 0) return {};
    const std::vector<double> at_start = windows_.residuals(window, runs[first]);
    const auto rows = static_cast<Eigen::Index>(at_start.size());
    Eigen::MatrixXd slopes(rows, static_cast<Eigen::Index>(2 * joints));  // by standard deviations of the first state
    for (size_t k = 0; k < 2 * joints; ++k) {
      const std::vector<double> moved = windows_.residuals(window, runs[first + 1 + k]);
      const double scale = noise(window, k) / step(window, k) / std::sqrt(variance);
      for (Eigen::Index r = 0; r < rows; ++r) {
        const auto i = static_cast<size_t>(r);
        slopes(r, static_cast<Eigen::Index>(k)) = scale * (moved[i] - at_start[i]);
      }
    }
    if (!slopes.allFinite()) return {};
    const Eigen::BDCSVD<Eigen::MatrixXd> split(slopes, Eigen::ComputeThinU);
    Taken found;
    found.basis = split.matrixU();
    // I - J (J'J + 1)^-1 J' as the square of I - U (1 - 1 / sqrt(1 + s^2)) U'
    found.share = 1 - (1 + split.singularValues().array().square()).rsqrt();
    return found;
  }

  const Windows& windows_;
  const std::vector<size_t>& training_;
  std::vector<Taken> taken_;
  size_t components_ = 0;
};

// Costs of batches that an earlier start of the same fit has evaluated.
class Record {
 public:
  explicit Record(const std::string& path) : path_(path) {
    if (path.empty()) return;
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      const json entry = json::parse(line, nullptr, false);  // the last line may be half a one
      if (entry.is_object() && entry.contains("batch") && entry.contains("costs")) {
        known_[entry.at("batch").get<std::string>()] = entry.at("costs");
      }
    }
  }
  static std::string key(const json& asked) { return content_hash(dump_json(asked)); }
  const json* find(const std::string& key) const {
    const auto found = known_.find(key);
    return found == known_.end() ? nullptr : &found->second;
  }
  void add(const std::string& key, const json& costs) const {
    if (path_.empty()) return;
    std::ofstream file(path_, std::ios::app);
    file << dump_json(json{{"batch", key}, {"costs", costs}}) << "\n" << std::flush;
    if (!file) throw SystemError(fmt::format("cannot write to '{}'", path_));
  }

 private:
  std::string path_;
  std::map<std::string, json> known_;
};

}  // namespace

Fit fit(Evaluator& evaluator, const Model& model, const Windows& windows, const std::vector<size_t>& training,
        const std::vector<Parameter>& parameters, const FitOptions& options) {
  json task = {{"method", options.rough ? "cma" : "least_squares"},
               {"seed", options.seed},
               {"budget", options.budget},
               {"starts", options.starts},
               {"delta", options.rough ? kBodyDelta : kJointDelta},
               {"step", kGradientStep},
               {"information_step", options.rough ? kRoughInformationStep : kInformationStep},
               {"widest", kWidest},
               {"equal", kEqual},
               {"resamples", kResamples}};
  for (const Parameter& parameter : parameters) {
    task["names"].push_back(parameter.name);
    task["start"].push_back(parameter.coordinate(std::clamp(parameter.nominal, parameter.lower, parameter.upper)));
    task["lower"].push_back(parameter.coordinate(parameter.lower));
    task["upper"].push_back(parameter.coordinate(parameter.upper));
    // numbers that are positive are measured by themselves
    const bool positive = !parameter.log && parameter.lower == 0;
    task["zero"].push_back(positive ? json(parameter.coordinate(0)) : json());
    task["size"].push_back(parameter.log ? json(std::numbers::ln2 / parameter.step) : json());
  }
  // windows of one log belong together; of few logs each window stands for itself
  std::map<size_t, size_t> logs;
  for (const size_t index : training) logs.emplace(windows.all()[index].log, logs.size());
  for (size_t i = 0; i < training.size(); ++i) {
    const Window& window = windows.all()[training[i]];
    task["blocks"].push_back(windows.residual_count(window));
    task["clusters"].push_back(logs.size() >= kEnoughLogs ? logs.at(window.log) : i);
  }
  // of each motion of a free body how far it came and turned: samples of one motion are not independent
  size_t observations = 0;
  for (const size_t index : training) observations += 6 * windows.all()[index].message.flights.size();
  task["observations"] = std::max<size_t>(observations, 1);
  FirstStates first_states(windows, training);
  task["first_states"] = !options.rough && first_states.components() > 0;
  const auto value_list = [&](const json& coordinates) {
    std::vector<double> values;
    for (size_t k = 0; k < parameters.size(); ++k)
      values.push_back(parameters[k].value(coordinates.at(k).get<double>()));
    return values;
  };
  Record record(options.record);
  Optimiser optimiser(task);
  int done = 0;
  while (true) {
    const json message = optimiser.next();
    if (message.contains("done")) {
      const json& end = message.at("done");
      Fit found;
      found.values = value_list(end.at("values"));
      for (size_t k = 0; k < parameters.size(); ++k) {
        const auto bound = [&](const json& coordinate) -> std::optional<double> {
          if (coordinate.is_null()) return std::nullopt;
          return parameters[k].value(coordinate.get<double>());
        };
        found.low.push_back(bound(end.at("low").at(k)));
        found.high.push_back(bound(end.at("high").at(k)));
      }
      for (const json& each : end.at("combinations")) {
        found.combinations.push_back({each.at("members").get<std::vector<std::string>>(),
                                      each.at("weights").get<std::vector<double>>(), each.at("interval").get<double>(),
                                      each.at("frozen").get<std::string>(), each.at("as_found").get<bool>()});
      }
      for (const json& start : end.at("starts")) {
        std::vector<double> values = value_list(start);
        values.push_back(start.back().get<double>());
        found.starts.push_back(std::move(values));
      }
      found.at_bound = end.at("at_bound").get<std::vector<std::string>>();
      found.cost = end.at("cost").is_null() ? 0 : end.at("cost").get<double>();
      found.evaluations = end.at("evaluations").get<int>();
      return found;
    }
    if (message.contains("linearise")) {
      first_states.linearise(evaluator, candidate_of(model, parameters, value_list(message.at("linearise"))));
      done += 1 + static_cast<int>(first_states.components());
      optimiser.answer({{"simulated", 1 + first_states.components()}});
      continue;
    }
    const json& asked = message.at("ask");
    const bool costs = message.contains("costs");
    const std::string key = Record::key(asked);
    done += static_cast<int>(asked.size());
    if (options.progress) options.progress(done, std::max(message.at("expected").get<int>(), done));
    if (costs) {
      if (const json* known = record.find(key)) {
        optimiser.answer({{"costs", *known}});
        continue;
      }
    }
    std::vector<Candidate> candidates;
    for (const json& coordinates : asked)
      candidates.push_back(candidate_of(model, parameters, value_list(coordinates)));
    const auto runs = evaluator.simulate(candidates, training);
    json answer = json::array();
    for (const std::vector<MatchRun>& of_candidate : runs) {
      if (costs) {
        answer.push_back(cost_of(windows, training, of_candidate));
        continue;
      }
      json residuals = json::array();
      for (size_t i = 0; i < training.size(); ++i) {
        std::vector<double> own = windows.residuals(windows.all()[training[i]], of_candidate[i]);
        first_states.take_out(i, own);
        for (const double r : own) residuals.push_back(r);
      }
      answer.push_back(std::move(residuals));
    }
    if (costs) record.add(key, answer);
    optimiser.answer({{costs ? "costs" : "residuals", answer}});
  }
}

nlohmann::ordered_json fit_json(const Fit& fit) {
  nlohmann::ordered_json json;
  const auto optional_list = [](const std::vector<std::optional<double>>& values) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const auto& value : values) list.push_back(value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json());
    return list;
  };
  json["values"] = fit.values;
  json["low"] = optional_list(fit.low);
  json["high"] = optional_list(fit.high);
  json["combinations"] = nlohmann::ordered_json::array();
  for (const Combination& each : fit.combinations) {
    json["combinations"].push_back({{"members", each.members},
                                    {"weights", each.weights},
                                    {"relative_interval", each.interval},
                                    {"frozen", each.frozen},
                                    {"as_found", each.as_found}});
  }
  json["at_bound"] = fit.at_bound;
  json["starts"] = fit.starts;
  json["cost"] = fit.cost;
  json["evaluations"] = fit.evaluations;
  return json;
}

Fit fit_from_json(const nlohmann::ordered_json& json) {
  Fit fit;
  const auto optional_list = [](const nlohmann::ordered_json& list) {
    std::vector<std::optional<double>> values;
    for (const auto& value : list) {
      values.push_back(value.is_null() ? std::nullopt : std::optional(value.get<double>()));
    }
    return values;
  };
  fit.values = json.at("values").get<std::vector<double>>();
  fit.low = optional_list(json.at("low")), fit.high = optional_list(json.at("high"));
  for (const auto& each : json.at("combinations")) {
    fit.combinations.push_back({each.at("members").get<std::vector<std::string>>(),
                                each.at("weights").get<std::vector<double>>(),
                                each.at("relative_interval").get<double>(), each.at("frozen").get<std::string>(),
                                each.at("as_found").get<bool>()});
  }
  fit.at_bound = json.at("at_bound").get<std::vector<std::string>>();
  fit.starts = json.at("starts").get<std::vector<std::vector<double>>>();
  fit.cost = json.at("cost").get<double>();
  fit.evaluations = json.at("evaluations").get<int>();
  return fit;
}

}  // namespace assay::match
