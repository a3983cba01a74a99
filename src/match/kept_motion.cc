#include "match/kept_motion.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/write_file.h"
#include "model/kinematics.h"
#include "results/store/trajectory.h"

namespace assay::match {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kResolution = 1e6;    // numbers are kept to 1e-6 rad, m
constexpr double kEvenSpacing = 0.02;  // of the sample time: samples that are nearer to even times count as there
constexpr size_t kPose = 7;            // numbers of a flight

size_t row_length(const KeptLog& log, size_t joints) { return joints + kPose * log.bodies.size(); }

// The window of a sample.
size_t window_of(const KeptLog& log, size_t sample) {
  size_t window = 0;
  while (window + 1 < log.windows.size() && log.windows[window + 1].first <= sample) ++window;
  return window;
}

// The rows at equal steps of time from the first sample on, as long as the run goes on. Between samples of a window
// they are interpolated; between windows the nearer one counts.
struct EvenRows {
  double step_s = 0;
  std::vector<std::vector<double>> rows;
};
EvenRows even_rows(const KeptLog& log, const std::vector<double>& rows, size_t row, size_t joints) {
  EvenRows even;
  size_t count = 0;
  // what no log measures is not there in any row: only poses and the first row's joints tell where a run ends
  const auto there = [&](size_t sample) {
    for (size_t k = 0; k < row; ++k) {
      if (!std::isnan(rows[sample * row + k])) return true;
    }
    return false;
  };
  while (count < log.time.size() && there(count)) ++count;
  if (count < 2) return even;
  std::vector<double> steps;
  for (size_t i = 1; i < log.time.size(); ++i) steps.push_back(log.time[i] - log.time[i - 1]);
  std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
  even.step_s = steps[steps.size() / 2];
  const double first = log.time.front(), last = log.time[count - 1];
  size_t at = 0;
  for (size_t k = 0;; ++k) {
    const double time = first + static_cast<double>(k) * even.step_s;
    if (time > last + kEvenSpacing * even.step_s) break;
    while (at + 2 < count && log.time[at + 1] <= time) ++at;
    const double span = log.time[at + 1] - log.time[at];
    double share = std::clamp((time - log.time[at]) / span, 0.0, 1.0);
    if (window_of(log, at) != window_of(log, at + 1) || std::abs(share - std::round(share)) < kEvenSpacing) {
      share = std::round(share);
    }
    const double *a = &rows[at * row], *b = &rows[(at + 1) * row];
    std::vector<double>& out = even.rows.emplace_back(row);
    for (size_t c = 0; c < row; ++c) out[c] = share == 0 ? a[c] : share == 1 ? b[c] : a[c] + share * (b[c] - a[c]);
    for (size_t q = joints + 3; q < row; q += kPose) {
      const Quat from(a[q], a[q + 1], a[q + 2], a[q + 3]), to(b[q], b[q + 1], b[q + 2], b[q + 3]);
      const Quat between = from.slerp(share, to).normalized();
      out[q] = between.w(), out[q + 1] = between.x(), out[q + 2] = between.y(), out[q + 3] = between.z();
    }
  }
  return even;
}

std::vector<State> states_of(const Model& model, const KeptLog& log, const KeptRun& run) {
  const size_t joints = model.joints.size(), row = row_length(log, joints);
  std::vector<State> states;
  const EvenRows even = even_rows(log, run.rows, row, joints);
  for (size_t k = 0; k < even.rows.size(); ++k) {
    const std::vector<double>& numbers = even.rows[k];
    State& state = states.emplace_back(model.initial);
    state.time = static_cast<double>(k) * even.step_s;
    state.position.resize(joints), state.velocity.assign(joints, 0);
    for (size_t j = 0; j < joints; ++j) {
      if (!std::isnan(numbers[j])) state.position[j] = numbers[j];
    }
    for (size_t f = 0; f < log.bodies.size(); ++f) {
      const double* pose = &numbers[joints + kPose * f];
      const auto body = static_cast<size_t>(log.bodies[f]);
      BodyState& own = state.bodies[body];
      own.q_WB = Quat(pose[3], pose[4], pose[5], pose[6]).normalized();
      own.p_WBcm = Vec3(pose[0], pose[1], pose[2]) + own.q_WB * model.bodies[body].p_BBcm;
    }
    for (BodyState& body : state.bodies) body.v_WBcm.setZero(), body.w_WB.setZero();
    bodies_from_joints(model, state);
  }
  return states;
}

// Whether joints and flights say where all bodies are.
bool drawable(const Model& model, const KeptLog& log) {
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const Body& body = model.bodies[b];
    if (body.ball >= 0) return false;
    if (body.is_free() && std::ranges::find(log.bodies, static_cast<int>(b)) == log.bodies.end()) return false;
  }
  return !model.bodies.empty();
}

json rounded(double value) {
  return std::isfinite(value) ? json(std::round(value * kResolution) / kResolution) : json();
}

// Each measured quantity's numbers over the samples.
json columns_json(const KeptLog& log, const KeptRun& run, size_t joints) {
  const size_t row = row_length(log, joints), samples = log.time.size();
  json columns = json::array();
  const auto add = [&](size_t column) {
    json& numbers = columns.emplace_back(json::array());
    for (size_t s = 0; s < samples; ++s) numbers.push_back(rounded(run.rows[s * row + column]));
  };
  for (const int joint : log.joints) add(static_cast<size_t>(joint));
  for (size_t c = joints; c < row; ++c) add(c);
  return columns;
}

[[noreturn]] void refuse_motion(const std::string& dir, const std::string& why) {
  throw InputError(
      fmt::format("'{}/{}' is not what `assay match` writes ({}): run the match again", dir, kMotionFile, why));
}

}  // namespace

KeptLog kept_log(const Model& model, const Windows& windows, const std::vector<size_t>& of_log, size_t worst,
                 size_t most, std::vector<size_t>& chosen, size_t& stride) {
  constexpr double kGap = 1e-6;  // s
  const auto& all = windows.all();
  const auto samples = [&](size_t place) { return all[of_log[place]].message.times.size(); };
  size_t from = worst, to = worst, count = samples(worst);
  const auto grow = [&](bool back) {
    if (back ? from == 0 : to + 1 == of_log.size()) return false;
    const size_t next = back ? from - 1 : to + 1;
    const Window &before = all[of_log[back ? next : to]], &after = all[of_log[back ? from : next]];
    if (after.start_s > before.end_s + kGap || count + samples(next) > most) return false;
    count += samples(next);
    (back ? from : to) = next;
    return true;
  };
  for (bool more = true; more;) {
    const bool before = grow(true), after = grow(false);
    more = before || after;
  }
  KeptLog log;
  chosen.assign(of_log.begin() + static_cast<std::ptrdiff_t>(from),
                of_log.begin() + static_cast<std::ptrdiff_t>(to) + 1);
  stride = std::max<size_t>(1, (count + most - 1) / most);
  const Window& first = all[chosen.front()];
  log.joints = first.joints;
  for (const MatchFlight& flight : first.message.flights) log.bodies.push_back(flight.body);
  const size_t joints = model.joints.size(), row = row_length(log, joints);
  KeptRun measured;
  measured.contender = kMeasured;
  for (const size_t index : chosen) {
    const Window& window = all[index];
    log.windows.push_back({log.time.size(), window.start_s, true});
    if (windows.whole() && !window.message.flights.empty()) {
      // the flight that the first state is found from ends before it
      const double flown = window.message.flights.front().times.back();
      if (flown < window.message.times.back()) log.impact = window.start_s + flown;
    }
    const size_t own = log.joints.size() + kPose * log.bodies.size();
    for (size_t s = 0; s < window.message.times.size(); s += stride) {
      log.time.push_back(window.start_s + window.message.times[s]);
      measured.rows.resize(log.time.size() * row, kNone);
      double* out = &measured.rows[(log.time.size() - 1) * row];
      const double* numbers = &window.measured[s * own];
      for (const int joint : log.joints) out[joint] = *numbers++;
      std::copy_n(numbers, kPose * log.bodies.size(), out + joints);
    }
  }
  log.runs.push_back(std::move(measured));
  return log;
}

KeptRun kept_run(const KeptLog& log, size_t joints, const std::vector<MatchRun>& answers, size_t stride) {
  const size_t row = row_length(log, joints);
  KeptRun run;
  run.rows.assign(log.time.size() * row, kNone);
  for (size_t w = 0; w < answers.size(); ++w) {
    const size_t first = log.windows[w].first;
    const size_t last = w + 1 < log.windows.size() ? log.windows[w + 1].first : log.time.size();
    const size_t there = row == 0 ? 0 : answers[w].samples.size() / row;
    for (size_t s = first; s < last && (s - first) * stride < there; ++s) {
      std::copy_n(&answers[w].samples[(s - first) * stride * row], row, &run.rows[s * row]);
    }
    if (run.ended.empty() && answers[w].ending.outcome != Outcome::kOk) run.ended = answers[w].ending.reason;
  }
  return run;
}

void write_motion(const std::string& dir, const Model& model, const json& scene, double timestep_ms,
                  const std::vector<KeptLog>& logs) {
  const size_t joints = model.joints.size();
  const std::string folder = (fs::path(dir) / kMotionFolder).string();
  refuse_linked_folder(folder);
  std::error_code ignored;
  fs::remove_all(folder, ignored);
  json written = {{"format", 1}, {"timestep_ms", timestep_ms}, {"scene", scene}, {"logs", json::array()}};
  for (const KeptLog& log : logs) {
    json one = {{"log", log.log}, {"roles", log.roles}, {"first_impact_s", nullptr}, {"runs", json::array()}};
    if (log.impact) one["first_impact_s"] = *log.impact;
    one["time_s"] = json::array();
    for (const double time : log.time) one["time_s"].push_back(rounded(time));
    one["windows"] = json::array();
    for (const KeptWindow& window : log.windows) {
      one["windows"].push_back(
          {{"first", window.first}, {"start_s", rounded(window.start_s)}, {"scored", window.scored}});
    }
    one["quantities"] = json::array();
    for (const int joint : log.joints) {
      const Joint& own = model.joints[static_cast<size_t>(joint)];
      one["quantities"].push_back({{"name", own.name}, {"kind", own.is_slide() ? "slide" : "hinge"}});
    }
    for (const int body : log.bodies) {
      one["quantities"].push_back({{"name", model.bodies[static_cast<size_t>(body)].name}, {"kind", "body"}});
    }
    const bool draws = drawable(model, log);
    for (const KeptRun& run : log.runs) {
      json kept = {{"contender", run.contender}, {"fitted", run.fitted}, {"ended", run.ended}, {"states", nullptr}};
      kept["values"] = columns_json(log, run, joints);
      if (std::vector<State> states; draws && (states = states_of(model, log, run)).size() > 1) {
        const std::string address =
            content_hash(fmt::format("{} {} {} {}", log.log, run.contender, run.fitted, dump_json(kept["values"])));
        make_own_folder(folder);
        write_trajectory(folder, address, {std::move(states)});
        kept["states"] = address;
      }
      one["runs"].push_back(std::move(kept));
    }
    written["logs"].push_back(std::move(one));
  }
  write_file((fs::path(dir) / kMotionFile).string(), dump_json(written) + "\n");
}

json read_motion(const std::string& dir) {
  std::ifstream file(fs::path(dir) / kMotionFile);
  if (!file) return nullptr;
  json motion = json::parse(file, nullptr, /*allow_exceptions=*/false);
  if (!motion.is_object() || motion.value("format", json()) != 1) refuse_motion(dir, "it is no JSON of format 1");
  try {
    for (const json& log : motion.at("logs")) {
      const size_t samples = log.at("time_s").size();
      size_t columns = 0;
      for (const json& quantity : log.at("quantities")) columns += quantity.at("kind") == "body" ? kPose : 1;
      for (const json& run : log.at("runs")) {
        static_cast<void>(run.at("contender").get<std::string>() + run.at("ended").get<std::string>());
        const json& values = run.at("values");
        if (values.size() != columns) refuse_motion(dir, "a run has other quantities than its log");
        for (const json& column : values) {
          if (column.size() != samples) refuse_motion(dir, "a run has other samples than its log");
        }
      }
      static_cast<void>(log.at("log").get<std::string>() + log.at("roles").dump() + log.at("windows").dump());
    }
    static_cast<void>(motion.at("scene").at("bodies").size() + motion.at("scene").at("hinges").size());
    static_cast<void>(motion.at("timestep_ms").get<double>());
  } catch (const json::exception&) {
    refuse_motion(dir, "a member is missing or of another type");
  }
  return motion;
}

std::vector<State> motion_states(const std::string& dir, const json& motion, const json& run) {
  const json& address = run.at("states");
  if (!address.is_string()) return {};
  const auto name = address.get<std::string>();
  if (name.find_first_not_of("0123456789abcdef") != std::string::npos)
    refuse_motion(dir, "a run has no address of its states");
  const json& scene = motion.at("scene");
  auto kept =
      read_run((fs::path(dir) / kMotionFolder).string(), name, scene.at("bodies").size(), scene.at("hinges").size());
  return kept ? std::move(kept->states) : std::vector<State>();
}

const json* kept_log_named(const json& motion, const std::string& name) {
  for (const json& log : motion.at("logs")) {
    if (log.at("log") == name) return &log;
  }
  for (const json& log : motion.at("logs")) {
    if (std::ranges::find(log.at("roles"), json(name)) != log.at("roles").end()) return &log;
  }
  return nullptr;
}

}  // namespace assay::match
