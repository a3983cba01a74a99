#include "bisect/releases.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/paths.h"
#include "measures/mechanics.h"
#include "measures/violation.h"
#include "run/coordinator/pool.h"

namespace assay {
namespace {

void append(std::string& bytes, double value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  bytes.append(raw, sizeof value);
}

// Every number of the states.
std::string bits_of(const std::vector<State>& states) {
  std::string bytes;
  for (const State& state : states) {
    append(bytes, state.time);
    for (const BodyState& body : state.bodies) {
      for (const double x : body.p_WBcm) append(bytes, x);
      for (const double x : body.q_WB.coeffs()) append(bytes, x);
      for (const double x : body.v_WBcm) append(bytes, x);
      for (const double x : body.w_WB) append(bytes, x);
    }
    for (const double x : state.position) append(bytes, x);
    for (const double x : state.velocity) append(bytes, x);
  }
  return content_hash(bytes);
}

ReleaseValues values_of(const Model& model, const std::vector<State>& states) {
  ReleaseValues values;
  const Separations separations(model);
  for (const State& state : states) {
    const std::vector<double> depths = separations.depths(state);
    values.contacts += static_cast<double>(std::ranges::count_if(depths, [](double depth) { return depth > 0; })) /
                       static_cast<double>(states.size());
    for (const double depth : depths) values.penetration = std::max(values.penetration, depth);
    const Violation found = violation(model, state);
    values.joint_error = std::max(values.joint_error, found.dislocation);
    values.limit = std::max(values.limit, found.limit);
  }
  if (!states.empty()) values.energy = kinetic_energy(model, states.back()) + potential_energy(model, states.back());
  return values;
}

std::vector<std::string> other_values(const Setting& setting, const Settings& settings) {
  const SettingValue& own = settings.values.at(setting.name);
  std::vector<std::string> texts;
  if (const bool* flag = std::get_if<bool>(&own)) {
    texts.emplace_back(*flag ? "off" : "on");
  } else if (const auto* text = std::get_if<std::string>(&own)) {
    std::ranges::copy_if(setting.choices, std::back_inserter(texts),
                         [&](const std::string& each) { return each != *text; });
  } else if (const auto* count = std::get_if<long long>(&own);
             count != nullptr && setting.role == SettingRole::kIterations) {
    texts.push_back(fmt::format("{}", 10 * *count));
  } else if (const double* number = std::get_if<double>(&own);
             number != nullptr && setting.role == SettingRole::kTolerance) {
    texts.push_back(fmt::format("{:g}", 1e-3 * *number));
  }
  return texts;
}

}  // namespace

Apart apart(const std::vector<Track>& a, const std::vector<Track>& b, size_t samples) {
  Apart found;
  for (size_t i = 0; i < a.size() && i < b.size(); ++i) {
    const std::vector<double> curve = gap_curve(a[i], b[i], samples);
    found.mean += gap_of(curve, gap_window(curve)) / static_cast<double>(a.size());
    const size_t count = std::min(a[i].positions.size(), b[i].positions.size());
    for (size_t k = 0; k < count; ++k) {
      found.largest = std::max(found.largest, (a[i].positions[k] - b[i].positions[k]).norm());
    }
  }
  return found;
}

ReleaseRunner::ReleaseRunner(const ExplainQuestion& question, std::function<void(size_t done, size_t of)> progress)
    : question_(question), progress_(std::move(progress)) {}

std::vector<MeasuredRelease> ReleaseRunner::run(const std::vector<Side>& sides, int starts) {
  std::vector<MeasuredRelease> measured(sides.size());
  std::vector<std::vector<std::string>> bits(sides.size(), std::vector<std::string>(static_cast<size_t>(starts)));
  const auto on_run = [&](size_t side, int start, const std::vector<State>& states) {
    bits[side][static_cast<size_t>(start)] = bits_of(states);
    const ReleaseValues own = values_of(question_.model, states);
    ReleaseValues& mean = measured[side].values;
    mean.energy += own.energy / starts;
    mean.contacts += own.contacts / starts;
    mean.penetration = std::max(mean.penetration, own.penetration);
    mean.joint_error = std::max(mean.joint_error, own.joint_error);
    mean.limit = std::max(mean.limit, own.limit);
  };
  RunPlan plan = question_.plan();
  plan.progress = progress_;
  plan.on_run = on_run;
  const MakeRuns make = worker_runner(std::move(plan));
  std::vector<RunSet> sets = make(sides, starts);
  for (size_t i = 0; i < sides.size(); ++i) {
    measured[i].result.release = sides[i].name;
    measured[i].result.failure = sets[i].failure;
    if (sets[i].failure.empty()) {
      std::string all = sets[i].early;
      for (const std::string& each : bits[i]) all += each;
      measured[i].result.bits = content_hash(all);
    }
    measured[i].tracks = std::move(sets[i].tracks);
    measured[i].values.falls = sets[i].fall_rate;
    measured[i].values.velocity_error = sets[i].velocity_error;
    measured[i].values.turning_error = sets[i].turning_error;
  }
  return measured;
}

std::vector<std::vector<double>> ReleaseRunner::step_us(const std::vector<Side>& sides, int rounds) const {
  std::vector<std::vector<double>> found(sides.size());
  const Interrupts interrupts;
  for (int round = 0; round < rounds; ++round) {
    for (size_t i = 0; i < sides.size(); ++i) {
      Pool alone(program_path(), 1, interrupts);
      const Recipe recipe = recipe_of(sides[i]);
      Job job;
      job.request = ProbeJob{{.model = question_.spec,
                              .control = question_.control_spec,
                              .contender = {sides[i].contender, recipe.contender.base, recipe.overrides},
                              .duration_s = question_.seconds(),
                              .sample_ms = question_.sample_ms,
                              .states = question_.states},
                             question_.timestep_ms,
                             true};
      job.title = sides[i].name;
      job.on_end = [&found, i](const JobEnd& end) {
        if (end.answer && end.answer->step_us > 0) found[i].push_back(end.answer->step_us);
      };
      alone.add(std::move(job));
      alone.run({});
      if (interrupts.signal() != 0) throw SystemError("interrupted: nothing was found out");
      if (progress_)
        progress_(sides.size() * static_cast<size_t>(round) + i + 1, sides.size() * static_cast<size_t>(rounds));
    }
  }
  return found;
}

std::vector<Restoring> restoring(ReleaseRunner& runner, const Side& newer, const MeasuredRelease& older,
                                 double distance, int starts, size_t samples) {
  const Recipe recipe = recipe_of(newer);
  std::vector<Side> sides;
  std::vector<std::string> names;
  for (const Setting& setting : recipe.contender.engine->settings()) {
    if (!missing_condition(setting, recipe.contender.settings).empty()) continue;
    for (const std::string& text : other_values(setting, recipe.contender.settings)) {
      Side side = newer;
      side.overrides[setting.name] = text;
      sides.push_back(std::move(side));
      names.push_back(fmt::format("{}={}", setting.name, text));
    }
  }
  std::vector<Restoring> found;
  const std::vector<MeasuredRelease> runs = runner.run(sides, starts);
  const std::vector<Track> first(older.tracks.begin(), older.tracks.begin() + starts);
  for (size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].result.usable()) continue;
    const Apart left = apart(first, runs[i].tracks, samples);
    if (left.mean < distance / 2) found.push_back({names[i], left.mean, left.largest == 0});
  }
  std::ranges::sort(found, {}, &Restoring::left);
  return found;
}

}  // namespace assay
