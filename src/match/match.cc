#include "match/match.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <random>
#include <set>

#include <fmt/format.h>

#include "base/errors.h"
#include "base/hash.h"
#include "base/json.h"
#include "base/text.h"
#include "base/write_file.h"
#include "load/model_mjcf.h"
#include "load/model_urdf.h"
#include "match/optimiser.h"
#include "run/coordinator/pool.h"

namespace assay::match {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kPerturbed = 4;                             // starts for the floor
constexpr double kUnpredictable = 2;                      // degrees
constexpr int kRoughBudget = 1500, kSmoothBudget = 1500;  // candidates
constexpr double kLimitS = 120;                           // of the runs that a worker does at once
constexpr double kImpact = 0.05;                          // s that count as at an impact
constexpr double kFence = 1.5;                            // interquartile ranges above the upper quartile
constexpr double kOdd = 2;                                // times the median log: nobody explains it
constexpr size_t kMostKeptNumbers = 100'000;              // that are kept of a log's motion
constexpr size_t kLeastKept = 200, kMostKept = 1500;
// Timesteps at which a fit is judged, too, as factors of the one that it was made at.
constexpr std::array<double, 4> kOtherTimesteps = {0.5, 2, 4, 8};

// Which logs a fit sees and which it is judged by.
struct Fold {
  std::vector<bool> training, held_out;
};

std::vector<Fold> folds_of(const MatchQuestion& question) {
  const size_t count = question.logs.size();
  const MatchConfig& config = question.config;
  std::vector<Fold> folds;
  if (config.leave_one_out) {
    for (size_t i = 0; i < count; ++i) {
      Fold fold{std::vector<bool>(count, true), std::vector<bool>(count, false)};
      fold.training[i] = false, fold.held_out[i] = true;
      folds.push_back(std::move(fold));
    }
    return folds;
  }
  Fold fold{std::vector<bool>(count, true), std::vector<bool>(count, false)};
  if (!config.held_out.empty()) {
    for (size_t i = 0; i < count; ++i) {
      fold.held_out[i] = std::ranges::any_of(
          config.held_out, [&](const std::string& pattern) { return matches_pattern(question.logs[i].name, pattern); });
      fold.training[i] = !fold.held_out[i];
    }
  } else {
    std::vector<size_t> order(count);
    std::iota(order.begin(), order.end(), size_t{0});
    std::mt19937_64 random(config.seed);
    for (size_t i = count; i > 1; --i) std::swap(order[i - 1], order[random() % i]);
    const auto held =
        std::clamp<size_t>(static_cast<size_t>(std::llround(config.held_out_share * static_cast<double>(count))), 1,
                           count > 1 ? count - 1 : 1);
    for (size_t i = 0; i < held; ++i) fold.held_out[order[i]] = true, fold.training[order[i]] = false;
  }
  const auto any = [](const std::vector<bool>& logs) { return std::ranges::any_of(logs, [](bool b) { return b; }); };
  if (!any(fold.training)) throw InputError("[held_out] logs name all logs, and a fit needs some: hold fewer out");
  if (!any(fold.held_out)) throw InputError("[held_out] logs match no log: check the names, or leave the key out");
  return {fold};
}

// The part of a log between two times.
MeasuredLog part_of(const MeasuredLog& log, size_t from, size_t to, const std::string& name) {
  MeasuredLog part;
  part.name = log.name + name;
  part.source = log.source;
  const auto cut = [&](const auto& series) {
    using Series = std::decay_t<decltype(series)>;
    if (series.empty()) return Series();
    return Series(series.begin() + static_cast<std::ptrdiff_t>(from), series.begin() + static_cast<std::ptrdiff_t>(to));
  };
  part.time = cut(log.time), part.line = cut(log.line);
  for (const MeasuredJoint& joint : log.joints) {
    part.joints.push_back(
        {joint.joint, cut(joint.position), cut(joint.velocity), cut(joint.torque), cut(joint.target), {}});
  }
  for (const MeasuredBody& body : log.bodies) {
    part.bodies.push_back({body.body, cut(body.p_WB), cut(body.q_WB), cut(body.v_WB), cut(body.w_WB)});
  }
  for (TimeSpan span : log.rows) {
    span.from = std::max(span.from, part.time.front()), span.to = std::min(span.to, part.time.back());
    if (span.from < span.to) part.rows.push_back(span);
  }
  return part;
}

bool whole_motions(const MatchQuestion& question) {
  return question.config.whole_motions.value_or(!question.model.contacts.empty());
}

// Samples of the median where nobody says: motion of --like has no glitches.
int plain_median(const MatchQuestion& question) { return question.like.empty() ? MatchConfig().torque_median : 1; }

// What a contender's result depends on; the engine's part of the program is in it, the coordinator's is not.
std::string key_of(const MatchQuestion& question, const std::string& contender) {
  const std::string engine = Registry::instance().resolve(contender).engine->name();
  std::string text = fmt::format("match 5 {} {} {} {} {} {}\n", question.spec.hash, contender,
                                 Registry::instance().plugin_hash(engine), question.timestep_ms, question.budget,
                                 question.config.seed);
  const auto add = [&](const auto& numbers) {
    for (const auto& number : numbers) text += fmt::format("{},", number);
    text += "\n";
  };
  for (const MeasuredLog& log : question.logs) {
    text += log.name + "\n";
    add(log.time);
    for (const MeasuredJoint& joint : log.joints) add(joint.position), add(joint.torque), add(joint.target);
    for (const MeasuredBody& body : log.bodies) {
      for (const Vec3& p : body.p_WB) text += fmt::format("{},{},{},", p.x(), p.y(), p.z());
      for (const Quat& q : body.q_WB) text += fmt::format("{},{},{},{},", q.w(), q.x(), q.y(), q.z());
    }
    for (const TimeSpan& span : log.rows) text += fmt::format("{}-{},", span.from, span.to);
  }
  const MatchConfig& config = question.config;
  text += fmt::format("{} {} {} {}", config.fit_window_s, config.report_window_s, config.leave_one_out,
                      config.held_out_share);
  for (const std::string& pattern : config.held_out) text += " " + pattern;
  for (const FitRequest& request : config.fit) {
    text += fmt::format(" {}={}[{},{}]", request.parameter, request.fit, request.lower.value_or(0),
                        request.upper.value_or(0));
  }
  for (const auto& [joint, gain] : config.stiffness) text += fmt::format(" kp:{}={}", joint, gain);
  for (const auto& [joint, gain] : config.damping) text += fmt::format(" kd:{}={}", joint, gain);
  // only what differs from a configuration without it, so that the keys of other questions stay
  MatchConfig plain = config;
  plain.law.reset();
  if (const DriveLaw law = drive_law(question.logs, config); law != drive_law(question.logs, plain)) {
    text += fmt::format(" law:{}", static_cast<int>(law));
  }
  if (config.torque_median != plain_median(question)) text += fmt::format(" median:{}", config.torque_median);
  if (const bool whole = whole_motions(question); whole != !question.model.contacts.empty()) {
    text += fmt::format(" whole:{}", whole);
  }
  return content_hash(text);
}

// Of one held-out log everything that its figures are made of.
struct Scored {
  size_t log = 0;
  std::vector<double> values;                                   // of the parameters that it was simulated with
  std::vector<WindowError> untuned, fitted, floor;              // of report windows
  std::vector<WindowError> untuned_short, fitted_short;         // of fit windows
  std::vector<std::array<std::vector<WindowError>, 3>> phases;  // samples before, at, after the first impact
  std::array<std::vector<WindowError>, kOtherTimesteps.size()> elsewhere;  // `fitted` at each of kOtherTimesteps
};

Json errors_json(const std::vector<WindowError>& errors) {
  Json list = Json::array();
  for (const WindowError& e : errors) list.push_back({e.joints, e.position, e.rotation, e.failed ? 1 : 0});
  return list;
}
std::vector<WindowError> errors_from(const Json& list) {
  std::vector<WindowError> errors;
  for (const Json& e : list) {
    errors.push_back({e[0].get<double>(), e[1].get<double>(), e[2].get<double>(), e[3].get<int>() != 0});
  }
  return errors;
}

// A contender before the ranking.
struct Raw {
  ContenderResult result;
  std::vector<std::string> refused;  // parameters that the contender does not take; `result` is without them
  std::vector<Scored> scored;
};

void leave_out(const std::vector<std::string>& names, std::vector<Parameter>& parameters) {
  std::erase_if(parameters, [&](const Parameter& p) { return std::ranges::find(names, p.name) != names.end(); });
}

Json raw_json(const Raw& raw, const std::string& key) {
  Json made;
  made["key"] = key;
  made["failure"] = raw.result.failure;
  made["warnings"] = raw.result.warnings;
  made["refused"] = raw.refused;
  made["fit"] = raw.result.failure.empty() ? fit_json(raw.result.fit) : Json();
  made["engine_s"] = raw.result.engine_s;
  made["evaluations"] = raw.result.evaluations;
  made["scored"] = Json::array();
  for (const Scored& scored : raw.scored) {
    Json one;
    one["log"] = scored.log;
    one["values"] = scored.values;
    one["untuned"] = errors_json(scored.untuned), one["fitted"] = errors_json(scored.fitted);
    one["floor"] = errors_json(scored.floor);
    one["untuned_short"] = errors_json(scored.untuned_short), one["fitted_short"] = errors_json(scored.fitted_short);
    one["phases"] = Json::array();
    for (const auto& phases : scored.phases) {
      Json each = Json::array();
      for (const auto& phase : phases) each.push_back(errors_json(phase));
      one["phases"].push_back(each);
    }
    one["elsewhere"] = Json::array();
    for (const auto& errors : scored.elsewhere) one["elsewhere"].push_back(errors_json(errors));
    made["scored"].push_back(one);
  }
  return made;
}

bool raw_from(const Json& kept, const std::string& key, Raw& raw) {
  if (!kept.is_object() || kept.value("key", "") != key) return false;
  raw.result.failure = kept.at("failure").get<std::string>();
  raw.result.warnings = kept.at("warnings").get<std::vector<std::string>>();
  raw.refused = kept.value("refused", std::vector<std::string>());
  leave_out(raw.refused, raw.result.parameters);
  raw.result.engine_s = kept.at("engine_s").get<double>();
  raw.result.evaluations = kept.at("evaluations").get<int>();
  if (raw.result.failure.empty()) raw.result.fit = fit_from_json(kept.at("fit"));
  for (const Json& one : kept.at("scored")) {
    Scored scored;
    scored.log = one.at("log").get<size_t>();
    scored.values = one.at("values").get<std::vector<double>>();
    scored.untuned = errors_from(one.at("untuned")), scored.fitted = errors_from(one.at("fitted"));
    scored.floor = errors_from(one.at("floor"));
    scored.untuned_short = errors_from(one.at("untuned_short"));
    scored.fitted_short = errors_from(one.at("fitted_short"));
    for (const Json& each : one.at("phases")) {
      scored.phases.push_back({errors_from(each[0]), errors_from(each[1]), errors_from(each[2])});
    }
    for (size_t t = 0; t < kOtherTimesteps.size(); ++t) scored.elsewhere[t] = errors_from(one.at("elsewhere").at(t));
    raw.scored.push_back(std::move(scored));
  }
  return true;
}

class Matcher {
 public:
  Matcher(const MatchQuestion& question, const std::function<void(const std::string&)>& progress,
          const std::function<void(const MatchAnswer&)>& so_far)
      : question_(question),
        progress_(progress),
        so_far_(so_far),
        windows_(question.model, question.logs, question.config, question.check),
        folds_(folds_of(question)),
        scales_(motion_scales(question.model, question.logs, question.config)) {
    budget_ = question.budget > 0 ? question.budget : windows_.whole() ? kRoughBudget : kSmoothBudget;
    bool judged = false;
    for (const Fold& fold : folds_) {
      if (windows_of(WindowUse::kFit, fold.training).empty()) refuse_unusable("to fit to", fold.training);
      judged = judged || !windows_of(WindowUse::kReport, fold.held_out).empty();
    }
    if (!judged) refuse_unusable("that are held out", folds_.front().held_out);
  }

  MatchAnswer match() {
    MatchAnswer answer;
    answer.whole = windows_.whole();
    answer.leave_one_out = question_.config.leave_one_out;
    answer.warnings = question_.warnings;
    for (size_t i = 0; i < question_.logs.size(); ++i) {
      const auto in = [&](auto member) {
        return std::ranges::any_of(folds_, [&](const Fold& f) { return bool{(f.*member)[i]}; });
      };
      if (in(&Fold::training)) answer.training.push_back(question_.logs[i].name);
      if (in(&Fold::held_out)) answer.held_out.push_back(question_.logs[i].name);
    }
    std::vector<Raw> raws;
    const auto judged = [&] {
      MatchAnswer found = answer;
      found.to_do.assign(question_.contenders.begin() + static_cast<std::ptrdiff_t>(raws.size()),
                         question_.contenders.end());
      judge(raws, found);
      return found;
    };
    for (const std::string& name : question_.contenders) {
      if (so_far_) so_far_(judged());
      raws.push_back(contender(name));
      ++done_contenders_;
    }
    MatchAnswer found = judged();
    keep_motion(raws, found);
    return found;
  }

 private:
  [[noreturn]] void refuse_unusable(const std::string& which, const std::vector<bool>& logs) const {
    std::vector<std::string> names;
    constexpr size_t kMost = 5;
    for (size_t i = 0; i < logs.size() && names.size() <= kMost; ++i) {
      if (logs[i]) names.push_back(names.size() < kMost ? question_.logs[i].name : "...");
    }
    throw InputError(fmt::format(
        "the logs {} ({}) have {} that can be used: choose others in [held_out], or give more logs; assay match "
        "--check says what spoils them",
        which, join(names, ", "),
        windows_.whole() ? "no motion" : fmt::format("no stretch of {:g} s", question_.config.fit_window_s)));
  }

  Raw contender(const std::string& name) {
    Raw raw;
    raw.result.contender = name;
    const ResolvedContender resolved = Registry::instance().resolve(name);
    raw.result.parameters =
        choose_parameters(question_.model, resolved, question_.config.fit, scales_, raw.result.warnings);
    if (raw.result.parameters.empty()) {
      raw.result.failure = raw.result.warnings.empty() ? "nothing is to be fitted" : join(raw.result.warnings, "; ");
      return raw;
    }
    const std::string key = key_of(question_, name);
    const fs::path folder = question_.out;
    const fs::path kept = folder / "contenders" / (name + ".json");
    if (std::ifstream file(kept); file) {
      const Json earlier = Json::parse(file, nullptr, false);
      Raw found;
      found.result.contender = name;
      found.result.parameters = raw.result.parameters;
      if (raw_from(earlier, key, found)) return found;
    }
    current_ = name;
    if (ended_fits_ == 0) began_ = std::chrono::steady_clock::now();  // earlier ones were read from their files
    try {
      measure(resolved, key, raw);
    } catch (const EngineError& error) {
      raw.result.failure = error.what();
    }
    std::error_code error;
    fs::create_directories(kept.parent_path(), error);
    write_file(kept.string(), dump_json(raw_json(raw, key)) + "\n");
    return raw;
  }

  std::vector<size_t> windows_of(WindowUse use, const std::vector<bool>& logs) const { return windows_.of(use, logs); }

  // Without windows.
  MatchJob job_of(const std::string& contender) const {
    MatchJob job;
    job.subject.model = question_.spec;
    job.subject.contender = {contender, contender, {}};
    job.timestep_ms = question_.timestep_ms;
    job.drives = windows_.drives();
    return job;
  }

  void measure(const ResolvedContender& resolved, const std::string& key, Raw& raw) {
    ContenderResult& result = raw.result;
    const std::string& name = result.contender;
    MatchJob job = job_of(name);
    for (const Window& window : windows_.all()) job.windows.push_back(window.message);
    // perturbed ones behind them: of each window that is reported kPerturbed in a row
    std::map<size_t, size_t> perturbed;
    for (size_t i = 0; i < windows_.all().size(); ++i) {
      const Window& window = windows_.all()[i];
      if (window.use != WindowUse::kReport) continue;
      perturbed[i] = job.windows.size();
      for (int k = 0; k < kPerturbed; ++k) {
        job.windows.push_back(
            windows_.perturbed(window, question_.config.seed * 1000003 + i * 97 + static_cast<std::uint64_t>(k)));
      }
    }
    Evaluator evaluator(std::move(job), question_.jobs, kLimitS, interrupts_);

    // the model as it is; what the contender refuses it refuses here
    const std::vector<bool> every(question_.logs.size(), true);
    std::vector<size_t> all(windows_.all().size());
    std::iota(all.begin(), all.end(), size_t{0});
    const auto untuned = evaluator.simulate({Candidate()}, all).front();
    for (const MatchRun& run : untuned) {
      if (run.ending.outcome == Outcome::kUnsupported) throw UnsupportedError(run.ending.reason);
    }
    const bool dead = std::ranges::all_of(untuned, [](const MatchRun& run) { return run.samples.empty(); });
    if (dead) throw EngineError(fmt::format("it fails in every window: {}", untuned.front().ending.reason));
    leave_out_refused(evaluator, raw);
    if (result.parameters.empty()) throw UnsupportedError(result.warnings.back());

    std::vector<Fold> folds = folds_;
    // what is reported of leaving one out is fitted to all of them
    if (question_.config.leave_one_out) folds.push_back({every, std::vector<bool>(every.size(), false)});
    for (size_t f = 0; f < folds.size(); ++f) {
      FitOptions options;
      options.seed = question_.config.seed;
      options.budget = budget_;
      options.rough = windows_.whole();
      fs::create_directories(fs::path(question_.out) / "evaluations");
      options.record =
          (fs::path(question_.out) / "evaluations" / fmt::format("{}-{}-{}.jsonl", name, f, key.substr(0, 12)))
              .string();
      const size_t later = (question_.contenders.size() - done_contenders_) * folds.size() - f - 1;
      options.progress = [&, later](int done, int of) { tell(done, of, later); };
      const Fit found = fit(evaluator, question_.model, windows_, windows_of(WindowUse::kFit, folds[f].training),
                            result.parameters, options);
      done_ += found.evaluations;
      ++ended_fits_;
      result.evaluations += found.evaluations;
      if (f + 1 == folds.size()) result.fit = found;
      score(evaluator, found, folds[f], result.parameters, perturbed, untuned, raw.scored);
    }
    result.engine_s = evaluator.engine_s();
    static_cast<void>(resolved);
  }

  // What the model has none of a contender may not have at all, as armature.
  void leave_out_refused(Evaluator& evaluator, Raw& raw) const {
    ContenderResult& result = raw.result;
    for (size_t k = 0; k < result.parameters.size(); ++k) {
      std::vector<double> values;
      for (const Parameter& p : result.parameters) values.push_back(std::clamp(p.nominal, p.lower, p.upper));
      const Parameter& moved = result.parameters[k];
      const double away = moved.coordinate(values[k]) + 1;
      values[k] = moved.upper > values[k] ? std::min(moved.value(away), moved.upper) : moved.lower;
      const Ending ending =
          evaluator.simulate({candidate_of(question_.model, result.parameters, values)}, {0}).front().front().ending;
      if (ending.outcome != Outcome::kUnsupported) continue;
      raw.refused.push_back(moved.name);
      result.warnings.push_back(fmt::format("'{}' is not fitted: {}", moved.name, ending.reason));
    }
    leave_out(raw.refused, result.parameters);
  }

  void score(Evaluator& evaluator, const Fit& found, const Fold& fold, const std::vector<Parameter>& parameters,
             const std::map<size_t, size_t>& perturbed, const std::vector<MatchRun>& untuned,
             std::vector<Scored>& scored) {
    const std::vector<size_t> report = windows_of(WindowUse::kReport, fold.held_out);
    const std::vector<size_t> brief = windows_of(WindowUse::kFit, fold.held_out);
    if (report.empty() && brief.empty()) return;
    std::vector<size_t> asked = report;
    for (const size_t i : report) {
      for (int k = 0; k < kPerturbed; ++k) asked.push_back(perturbed.at(i) + static_cast<size_t>(k));
    }
    if (!windows_.whole()) asked.insert(asked.end(), brief.begin(), brief.end());
    const auto runs = evaluator.simulate({candidate_of(question_.model, parameters, found.values)}, asked).front();
    std::map<size_t, Scored> of_log;
    for (size_t r = 0; r < report.size(); ++r) {
      const size_t i = report[r];
      const Window& window = windows_.all()[i];
      Scored& own = of_log[window.log];
      own.untuned.push_back(windows_.error(window, untuned[i]));
      own.fitted.push_back(windows_.error(window, runs[r]));
      std::vector<WindowError> apart;
      for (size_t k = 0; k < kPerturbed; ++k) {
        apart.push_back(windows_.distance(window, runs[report.size() + (r * kPerturbed) + k], runs[r]));
      }
      own.floor.push_back(mean_error(apart));
      if (!windows_.whole() || window.message.flights.empty()) continue;
      const std::vector<WindowError> samples = windows_.sample_errors(window, runs[r]);
      const double impact = window.message.flights.front().times.back();
      std::array<std::vector<WindowError>, 3> phases;
      for (size_t s = 0; s < samples.size(); ++s) {
        const double time = window.message.times[s];
        phases.at(time <= impact ? 0 : time <= impact + kImpact ? 1 : 2).push_back(samples[s]);
      }
      // of each phase the mean: they are short in some motions and long in others
      for (auto& phase : phases) {
        if (phase.size() > 1) phase = {mean_error(phase)};
      }
      own.phases.push_back(std::move(phases));
    }
    const size_t from = report.size() * (1 + kPerturbed);
    for (size_t r = 0; r < brief.size() && !windows_.whole(); ++r) {
      const Window& window = windows_.all()[brief[r]];
      Scored& own = of_log[window.log];
      own.untuned_short.push_back(windows_.error(window, untuned[brief[r]]));
      own.fitted_short.push_back(windows_.error(window, runs[from + r]));
    }
    score_elsewhere(found, parameters, report, of_log);
    for (auto& [log, own] : of_log) {
      own.log = log;
      own.values = found.values;
      scored.push_back(std::move(own));
    }
  }

  // What the fit is worth at other timesteps.
  void score_elsewhere(const Fit& found, const std::vector<Parameter>& parameters, const std::vector<size_t>& report,
                       std::map<size_t, Scored>& of_log) {
    if (report.empty()) return;
    std::vector<size_t> every(report.size());
    std::iota(every.begin(), every.end(), size_t{0});
    for (size_t t = 0; t < kOtherTimesteps.size(); ++t) {
      MatchJob job = job_of(current_);
      job.timestep_ms *= kOtherTimesteps[t];
      for (const size_t i : report) job.windows.push_back(windows_.all()[i].message);
      Evaluator evaluator(std::move(job), question_.jobs, kLimitS, interrupts_);
      const auto runs = evaluator.simulate({candidate_of(question_.model, parameters, found.values)}, every).front();
      for (size_t r = 0; r < report.size(); ++r) {
        const Window& window = windows_.all()[report[r]];
        of_log.at(window.log).elsewhere[t].push_back(windows_.error(window, runs[r]));
      }
    }
  }

  // `done` candidates of a fit, whose search ends at `of`, and after which `later` fits follow. A fit is expected to
  // take as many as those before it, the first one its budget.
  void tell(int done, int of, size_t later) {
    if (!progress_) return;
    const double spent_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
    const double each = ended_fits_ > 0 ? static_cast<double>(done_) / ended_fits_ : budget_;
    const double left = std::max<double>(of, each) - done + static_cast<double>(later) * each;
    progress_(fmt::format("{} ({} of {}): {} candidates, about {} left", current_, done_contenders_ + 1,
                          question_.contenders.size(), done,
                          duration_label(spent_s * left / std::max(1, done_ + done))));
  }

  // The floor of each window that is reported, by log and place: a window is predictable where any contender's own is.
  static std::map<std::pair<size_t, size_t>, double> floors_of(const std::vector<Raw>& raws) {
    std::map<std::pair<size_t, size_t>, double> floors;
    for (const Raw& raw : raws) {
      for (const Scored& scored : raw.scored) {
        for (size_t w = 0; w < scored.floor.size(); ++w) {
          const WindowError& floor = scored.floor[w];
          const double degrees = std::max(floor.joints, floor.rotation);
          const auto [at, fresh] = floors.try_emplace({scored.log, w}, degrees);
          if (!fresh) at->second = std::min(at->second, degrees);
        }
      }
    }
    return floors;
  }

  void judge(std::vector<Raw> raws, MatchAnswer& answer) const {
    const auto floors = floors_of(raws);
    for (Raw& raw : raws) {
      ContenderResult& result = raw.result;
      if (!result.failure.empty()) continue;
      std::ranges::sort(raw.scored, {}, &Scored::log);
      std::array<std::vector<WindowError>, 3> phases;
      for (const Scored& scored : raw.scored) {
        LogResult log;
        log.log = question_.logs[scored.log].name;
        std::vector<bool> own(question_.logs.size(), false);
        own[scored.log] = true;
        const std::vector<size_t> report = windows_of(WindowUse::kReport, own);
        std::vector<WindowError> untuned, fitted, floor, at_rest;
        for (size_t w = 0; w < scored.fitted.size(); ++w) {
          ++log.windows;
          if (floors.at({scored.log, w}) > kUnpredictable) {
            ++log.unpredictable;
            continue;
          }
          log.failed += scored.fitted[w].failed ? 1 : 0;
          untuned.push_back(scored.untuned[w]), fitted.push_back(scored.fitted[w]), floor.push_back(scored.floor[w]);
          at_rest.push_back(windows_.error_at_rest(windows_.all()[report[w]]));
          if (w < scored.phases.size()) {
            for (size_t p = 0; p < phases.size(); ++p) {
              phases[p].insert(phases[p].end(), scored.phases[w][p].begin(), scored.phases[w][p].end());
            }
          }
        }
        if (fitted.empty() && log.windows > 0) {
          answer.unpredictable.push_back(fmt::format(
              "{}: over {} the noise of its first states grows beyond {:g} degrees", log.log,
              windows_.whole() ? "the whole motion" : fmt::format("{:g} s", question_.config.report_window_s),
              kUnpredictable));
          // then what fits are made of has to do
          untuned = scored.untuned_short, fitted = scored.fitted_short;
          for (const size_t brief : windows_of(WindowUse::kFit, own)) {
            at_rest.push_back(windows_.error_at_rest(windows_.all()[brief]));
          }
        }
        if (fitted.empty()) continue;
        log.untuned = figures_of(mean_error(untuned), windows_), log.fitted = figures_of(mean_error(fitted), windows_);
        log.floor = figures_of(mean_error(floor), windows_);
        log.at_rest = figures_of(mean_error(at_rest), windows_);
        if (!scored.fitted_short.empty()) {
          log.untuned_short = figures_of(mean_error(scored.untuned_short), windows_);
          log.fitted_short = figures_of(mean_error(scored.fitted_short), windows_);
        }
        result.logs.push_back(std::move(log));
      }
      if (windows_.whole()) {
        constexpr std::array<const char*, 3> kNames = {"before the first impact", "at the first impact", "after it"};
        for (size_t p = 0; p < phases.size(); ++p) {
          if (!phases[p].empty()) result.phases.push_back({kNames[p], figures_of(mean_error(phases[p]), windows_)});
        }
      }
      const Candidate candidate = candidate_of(question_.model, result.parameters, result.fit.values);
      result.changes = change_texts(candidate.changes);
      result.settings = candidate.settings;
      if (result.logs.empty()) {
        result.failure = "no held-out window can be predicted from its first state";
        continue;
      }
      result.timesteps = by_timestep(raw.scored, floors);
      std::vector<double> fitted, untuned;
      for (const LogResult& log : result.logs)
        fitted.push_back(log.fitted.score()), untuned.push_back(log.untuned.score());
      result.score = bootstrap_mean(fitted, question_.config.seed);
      result.untuned_score = bootstrap_mean(untuned, question_.config.seed);
      warn(result);
    }
    std::ranges::sort(answer.unpredictable);
    answer.unpredictable.erase(std::ranges::unique(answer.unpredictable).begin(), answer.unpredictable.end());
    std::vector<ContenderResult> results;
    for (Raw& raw : raws) results.push_back(std::move(raw.result));
    std::ranges::stable_sort(results, {}, [](const ContenderResult& r) {
      return std::pair(!r.failure.empty(), r.failure.empty() ? r.score.value : 0.0);
    });
    for (ContenderResult& result : results) {
      if (!result.failure.empty()) continue;
      const ContenderResult& best = results.front();
      std::vector<double> differences;
      for (const LogResult& log : result.logs) {
        const auto other = std::ranges::find(best.logs, log.log, &LogResult::log);
        if (other != best.logs.end()) differences.push_back(log.fitted.score() - other->fitted.score());
      }
      if (differences.empty()) continue;
      result.behind_best = bootstrap_mean(differences, question_.config.seed);
      result.as_good_as_best = &result == &best || result.behind_best->low <= 0;
    }
    odd_logs(results, answer);
    answer.contenders = std::move(results);
  }

  // The fit at its own and at other timesteps, over the windows that are predictable; ascending.
  std::vector<TimestepResult> by_timestep(const std::vector<Scored>& scored,
                                          const std::map<std::pair<size_t, size_t>, double>& floors) const {
    std::vector<TimestepResult> results;
    const auto add = [&](double timestep_ms, const auto& errors_of) {
      TimestepResult result{timestep_ms, {}, {}, 0, 0};
      std::vector<double> scores;
      std::vector<ErrorFigures> figures;
      for (const Scored& log : scored) {
        std::vector<WindowError> errors;
        for (size_t w = 0; w < errors_of(log).size(); ++w) {
          if (floors.at({log.log, w}) > kUnpredictable) continue;
          errors.push_back(errors_of(log)[w]);
          result.failed += errors.back().failed ? 1 : 0;
        }
        if (errors.empty()) continue;
        result.windows += static_cast<int>(errors.size());
        figures.push_back(figures_of(mean_error(errors), windows_));
        scores.push_back(figures.back().score());
      }
      if (scores.empty()) return;
      result.error = mean_of(figures);
      result.score = bootstrap_mean(scores, question_.config.seed);
      results.push_back(result);
    };
    add(question_.timestep_ms, [](const Scored& log) -> const auto& { return log.fitted; });
    for (size_t t = 0; t < kOtherTimesteps.size(); ++t) {
      add(kOtherTimesteps[t] * question_.timestep_ms,
          [t](const Scored& log) -> const auto& { return log.elsewhere[t]; });
    }
    std::ranges::sort(results, {}, &TimestepResult::timestep_ms);
    return results;
  }

  static void warn(ContenderResult& result) {
    for (const std::string& name : result.fit.at_bound) {
      const auto at = std::ranges::find(result.parameters, name, &Parameter::name);
      const auto index = static_cast<size_t>(at - result.parameters.begin());
      if (at->lower == 0 && result.fit.values[index] < at->upper / 2) {
        result.warnings.push_back(fmt::format("'{}' has ended at 0: the logs ask for none of it", name));
        continue;
      }
      result.warnings.push_back(fmt::format(
          "'{}' has ended at its bound: widen it with [fit] \"{}\" = [lower, upper], or keep the model's value "
          "with = false",
          name, name));
    }
    if (result.worse_than_untuned()) {
      result.warnings.push_back(
          fmt::format("the fit is worse on held-out logs ({:.3g}) than the model as it is ({:.3g}): do not use it",
                      result.score.value, result.untuned_score.value));
    }
    int failed = 0;
    for (const LogResult& log : result.logs) failed += log.failed;
    if (failed > 0) {
      result.warnings.push_back(fmt::format("{} of its held-out windows end early with the fitted parameters", failed));
    }
  }

  // Logs that even the contender that explains them best does not explain as the others.
  static void odd_logs(const std::vector<ContenderResult>& results, MatchAnswer& answer) {
    std::map<std::string, double> least;
    for (const ContenderResult& result : results) {
      for (const LogResult& log : result.logs) {
        const auto [at, fresh] = least.try_emplace(log.log, log.fitted.score());
        if (!fresh) at->second = std::min(at->second, log.fitted.score());
      }
    }
    if (least.size() < 3) return;
    std::vector<double> scores;
    for (const auto& [log, score] : least) scores.push_back(score);
    // beyond Tukey's fence, too: of hundreds of tosses many are twice the median by chance alone
    const double usual = median(scores), upper = quantile(scores, 0.75), lower = quantile(scores, 0.25);
    const double most = std::max(kOdd * usual, upper + kFence * (upper - lower));
    std::vector<std::pair<double, std::string>> odd;
    for (const auto& [log, score] : least) {
      if (score > most) odd.emplace_back(score, log);
    }
    std::ranges::sort(odd, std::greater());
    for (const auto& [score, log] : odd) {
      answer.odd_logs.push_back(fmt::format("{}: {:.3g} at best, {:.1f} times the median of the logs ({:.3g})", log,
                                            score, score / usual, usual));
      answer.odd_names.push_back(log);
    }
  }

  // Logs to look at: by the best contender's errors the worst and the median one, and the one that parts contenders
  // most.
  static std::vector<std::pair<std::string, std::vector<std::string>>> shown_logs(
      const std::vector<const ContenderResult*>& shown) {
    std::vector<LogResult> logs = shown.front()->logs;
    std::ranges::stable_sort(logs, {}, [](const LogResult& log) { return log.fitted.score(); });
    std::vector<std::pair<std::string, std::vector<std::string>>> found;
    const auto add = [&](const std::string& log, const char* role) {
      const auto same = std::ranges::find(found, log, &std::pair<std::string, std::vector<std::string>>::first);
      if (same == found.end()) {
        found.push_back({log, {role}});
      } else {
        same->second.push_back(role);
      }
    };
    add(logs.back().log, kWorst);
    add(logs[(logs.size() - 1) / 2].log, kMedian);
    double widest = 0;
    std::string separating;
    for (const LogResult& log : logs) {
      double low = log.fitted.score(), high = low;
      for (const ContenderResult* other : shown) {
        const auto same = std::ranges::find(other->logs, log.log, &LogResult::log);
        if (same == other->logs.end()) continue;
        low = std::min(low, same->fitted.score()), high = std::max(high, same->fitted.score());
      }
      if (high - low > widest) widest = high - low, separating = log.log;
    }
    if (!separating.empty()) add(separating, kSeparating);
    return found;
  }

  // What the best contenders make of these logs, simulated again: with the fit by which the log judges and as the
  // model is.
  void keep_motion(const std::vector<Raw>& raws, MatchAnswer& answer) {
    std::vector<const ContenderResult*> shown;
    for (const ContenderResult& result : answer.contenders) {
      if (result.failure.empty() && shown.size() < kMostKeptContenders) shown.push_back(&result);
    }
    if (shown.empty()) return;
    const auto raw_of = [&](const std::string& name) -> const Raw& {
      return *std::ranges::find_if(raws, [&](const Raw& raw) { return raw.result.contender == name; });
    };
    const auto scored_of = [&](const Raw& raw, size_t log) { return std::ranges::find(raw.scored, log, &Scored::log); };
    const auto floors = floors_of(raws);
    std::vector<std::vector<size_t>> chosen;
    std::vector<size_t> strides;
    std::vector<size_t> logs;
    const Raw& best = raw_of(shown.front()->contender);
    for (const auto& [name, roles] : shown_logs(shown)) {
      const auto log =
          static_cast<size_t>(std::ranges::find(question_.logs, name, &MeasuredLog::name) - question_.logs.begin());
      std::vector<bool> only(question_.logs.size(), false);
      only[log] = true;
      const std::vector<size_t> windows = windows_of(WindowUse::kReport, only);
      const auto own = scored_of(best, log);
      size_t worst = 0;
      for (size_t w = 0; w < windows.size() && w < own->fitted.size(); ++w) {
        if (figures_of(own->fitted[w], windows_).score() > figures_of(own->fitted[worst], windows_).score()) worst = w;
      }
      const size_t columns = question_.model.joints.size() + 7 * windows_.bodies().size();
      const size_t most = std::clamp<size_t>(kMostKeptNumbers / (std::max<size_t>(1, columns) * (2 * shown.size() + 1)),
                                             kLeastKept, kMostKept);
      KeptLog kept =
          kept_log(question_.model, windows_, windows, worst, most, chosen.emplace_back(), strides.emplace_back());
      kept.log = name, kept.roles = roles;
      for (size_t w = 0; w < kept.windows.size(); ++w) {
        const auto place = static_cast<size_t>(std::ranges::find(windows, chosen.back()[w]) - windows.begin());
        const auto floor = floors.find({log, place});
        kept.windows[w].scored = floor == floors.end() || floor->second <= kUnpredictable;
      }
      answer.motion.push_back(std::move(kept));
      logs.push_back(log);
    }
    for (const ContenderResult* result : shown) {
      if (progress_) progress_(fmt::format("{}: the motion to look at", result->contender));
      MatchJob job = job_of(result->contender);
      std::vector<std::vector<size_t>> places(logs.size());  // of the job's windows
      for (size_t l = 0; l < logs.size(); ++l) {
        for (const size_t window : chosen[l]) {
          places[l].push_back(job.windows.size());
          job.windows.push_back(windows_.all()[window].message);
        }
      }
      Evaluator evaluator(std::move(job), question_.jobs, kLimitS, interrupts_);
      const Raw& raw = raw_of(result->contender);
      for (size_t l = 0; l < logs.size(); ++l) {
        const auto scored = scored_of(raw, logs[l]);
        if (scored == raw.scored.end()) continue;
        const std::vector<Candidate> candidates = {candidate_of(question_.model, raw.result.parameters, scored->values),
                                                   Candidate()};
        const auto runs = evaluator.simulate(candidates, places[l]);
        for (size_t c = 0; c < candidates.size(); ++c) {
          KeptRun run = kept_run(answer.motion[l], question_.model.joints.size(), runs[c], strides[l]);
          run.contender = result->contender, run.fitted = c == 0;
          answer.motion[l].runs.push_back(std::move(run));
        }
      }
    }
  }

  const MatchQuestion& question_;
  const std::function<void(const std::string&)>& progress_;
  const std::function<void(const MatchAnswer&)>& so_far_;
  Windows windows_;
  std::vector<Fold> folds_;
  MotionScales scales_;
  Interrupts interrupts_;
  int budget_ = 0, done_ = 0, ended_fits_ = 0;  // done_: candidates of the fits that have ended
  size_t done_contenders_ = 0;
  std::string current_;
  std::chrono::steady_clock::time_point began_;
};

}  // namespace

bool ContenderResult::worse_than_untuned() const {
  constexpr double kEqual = 1e-3;  // of the error: what is only rounding, as where the fit has found the model's values
  return score.value > (1 + kEqual) * untuned_score.value;
}

bool ContenderResult::no_better_than_rest() const {
  double fitted = 0, at_rest = 0;
  for (const LogResult& log : logs) fitted += log.fitted.score(), at_rest += log.at_rest.score();
  return fitted >= at_rest;
}

double ErrorFigures::score() const {
  double sum = joints_deg.value_or(0);
  if (position_percent) sum += 0.5 * (*position_percent + rotation_deg.value_or(0));
  return sum;
}

ErrorFigures figures_of(const WindowError& error, const Windows& windows) {
  ErrorFigures figures;
  const bool joints = std::ranges::any_of(windows.all(), [](const Window& w) { return !w.joints.empty(); });
  if (joints) figures.joints_deg = error.joints;
  if (!windows.bodies().empty()) figures.position_percent = error.position, figures.rotation_deg = error.rotation;
  return figures;
}

ErrorFigures mean_of(const std::vector<ErrorFigures>& all) {
  ErrorFigures mean;
  for (const auto member : {&ErrorFigures::joints_deg, &ErrorFigures::position_percent, &ErrorFigures::rotation_deg}) {
    double sum = 0;
    size_t count = 0;
    for (const ErrorFigures& figures : all) {
      if (const auto& value = figures.*member) sum += *value, ++count;
    }
    if (count > 0) mean.*member = sum / static_cast<double>(count);
  }
  return mean;
}

namespace {

// Whether URDF has a place for all that was fitted of the robot; what drives it and what it touches are no part of it.
bool urdf_holds(const std::vector<RunChange>& changes) {
  constexpr std::array kHeld = {ChangeKind::kDamping,     ChangeKind::kDryFriction, ChangeKind::kMass,
                                ChangeKind::kInertia,     ChangeKind::kCentre,      ChangeKind::kEncoder,
                                ChangeKind::kDelay,       ChangeKind::kGear,        ChangeKind::kDriveStiffness,
                                ChangeKind::kDriveDamping};
  return std::ranges::all_of(
      changes, [&](const RunChange& change) { return std::ranges::find(kHeld, change.kind) != kHeld.end(); });
}

void write_urdf(const Model& fitted, const std::string& folder, const std::string& name) {
  const std::string meshes = name + "-meshes";
  WrittenUrdf urdf;
  try {
    urdf = model_urdf(fitted, meshes);
  } catch (const InputError&) {
    return;  // a robot with ball joints has no URDF
  }
  if (!urdf.meshes.empty()) make_own_folder((fs::path(folder) / meshes).string());
  for (const WrittenUrdf::Mesh& mesh : urdf.meshes) write_file((fs::path(folder) / mesh.file).string(), mesh.stl);
  write_file((fs::path(folder) / (name + ".urdf")).string(), urdf.text);
}

// Of a question with one log: its last third judges.
MatchQuestion split_of(const MatchQuestion& question) {
  MatchQuestion split = question;
  const MeasuredLog& log = question.logs.front();
  if (whole_motions(question)) {
    throw InputError(
        fmt::format("there is one motion, '{}', and a fit has to be judged by another one: give more logs", log.name));
  }
  const double share = std::clamp(question.config.held_out_share, 0.1, 0.9);
  const double cut = log.time.front() + (1 - share) * (log.time.back() - log.time.front());
  const auto at = static_cast<size_t>(std::ranges::lower_bound(log.time, cut) - log.time.begin());
  if (at == 0 || at == log.samples()) {
    throw InputError(fmt::format("the log '{}' has {}, of which nothing can be held out: give longer logs", log.name,
                                 counted(log.samples(), "sample")));
  }
  split.logs = {part_of(log, 0, at, " (first part)"), part_of(log, at, log.samples(), " (last part)")};
  split.config.held_out = {"* (last part)"};
  split.config.leave_one_out = false;
  for (const SpoiledSpan& spoiled : question.check.spoiled) {
    if (spoiled.span.to > cut) split.check.spoiled.push_back({1, spoiled.span, spoiled.reason});
  }
  split.warnings.push_back(
      fmt::format("there is one log, '{}': its last {:.0f} % judge what was fitted to the rest, which tells less "
                  "than another log",
                  log.name, 100 * share));
  return split;
}

// What is said to drive the robot has to be in the logs.
void check_drive(const MatchQuestion& question) {
  const auto refuse = [](const MeasuredLog& log, const char* law, const char* what, const char* column) {
    throw InputError(fmt::format(
        "'{}' has no {}, and law = \"{}\" in [drive] asks for them: name their columns, {} in [columns], or "
        "give law = \"none\"",
        log.name, what, law, column));
  };
  for (const MeasuredLog& log : question.logs) {
    if (log.joints.empty()) continue;
    if (question.config.law == DriveLaw::kTorque && !log.has_torque()) {
      refuse(log, "torque", "torques", "JOINT.torque");
    }
    if (question.config.law == DriveLaw::kPd &&
        std::ranges::all_of(log.joints, [](const MeasuredJoint& joint) { return joint.target.empty(); })) {
      refuse(log, "pd", "targets", "JOINT.target");
    }
  }
}

}  // namespace

void check_question(const MatchQuestion& question, bool parameters_alone) {
  const MotionScales scales = motion_scales(question.model, question.logs, question.config);
  std::string why;
  bool any = question.contenders.empty();
  for (const std::string& name : question.contenders) {
    std::vector<std::string> notes;
    const bool some =
        !choose_parameters(question.model, Registry::instance().resolve(name), question.config.fit, scales, notes)
             .empty();
    if (!some && !notes.empty()) why = notes.front();
    any = any || some;
  }
  if (parameters_alone) return;
  if (!any) throw InputError(fmt::format("no contender has a parameter to fit ({}): ask for others by --fit", why));
  check_drive(question);
  const std::function<void(const std::string&)> quiet;
  const std::function<void(const MatchAnswer&)> nobody;
  if (question.logs.size() > 1) {
    static_cast<void>(Matcher(question, quiet, nobody));
    return;
  }
  const MatchQuestion split = split_of(question);
  static_cast<void>(Matcher(split, quiet, nobody));
}

MatchAnswer match(const MatchQuestion& question, const std::function<void(const std::string&)>& progress,
                  const std::function<void(const MatchAnswer&)>& so_far) {
  Optimiser::require_environment();
  if (question.logs.size() > 1) return Matcher(question, progress, so_far).match();
  const MatchQuestion split = split_of(question);
  return Matcher(split, progress, so_far).match();
}

std::string match_key(const MatchQuestion& question) {
  std::string keys;
  for (const std::string& contender : question.contenders) keys += key_of(question, contender) + " ";
  return content_hash(keys);
}

std::vector<std::string> write_fitted_models(const MatchQuestion& question, const MatchAnswer& answer,
                                             const std::string& folder) {
  std::vector<std::string> notes;
  std::error_code error;
  for (const ContenderResult& result : answer.contenders) {
    const std::string path = (fs::path(folder) / result.contender).string();
    fs::remove(path + ".urdf", error);  // of an earlier question
    if (!result.failure.empty()) {
      fs::remove(path + ".xml", error);
      continue;
    }
    make_own_folder(folder);
    const std::vector<RunChange> changes = parse_changes(result.changes);
    const Model fitted = changed_model(question.model, changes);
    try {
      write_file(path + ".xml", model_mjcf(fitted));
    } catch (const InputError& problem) {
      notes.push_back(problem.what());
    }
    if (urdf_holds(changes)) write_urdf(fitted, folder, result.contender);
  }
  return notes;
}

}  // namespace assay::match
