#include "run/messages/messages.h"

#include <array>
#include <bit>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <set>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/fields.h"
#include "base/json.h"

namespace assay {
namespace {

using nlohmann::json;

// ---- the kinds, in the order of the variants ------------------------------------------------------------------------

constexpr std::array<std::string_view, std::variant_size_v<Request>> kRequestKinds = {
    "run",     "truth",  "pieces",       "agreement", "scaling", "conformance",  "probe", "timing",
    "prepare", "sample", "single-steps", "runs",      "batch",   "batch-sample", "match", "simulate"};
constexpr std::array<std::string_view, std::variant_size_v<Reply>> kReplyKinds = {
    "done",    "test",           "error",          "crash",         "ready",    "prepared",
    "sampled", "single-stepped", "batch-prepared", "batch-sampled", "simulated"};

// ---- the fields of each message: one list, by which it is written and read --------------------------------------------

void fields(auto& is, Of<LoadOptions> auto& m) {
  visit_load_fields(m, [&](const LoadField& field, auto& value) { is(field.key, value); });
}
void fields(auto& is, Of<BodyPair> auto& m) { is("a", m.a)("b", m.b); }
void fields(auto& is, Of<ModelVariant> auto& m) {
  is("contacts", m.contacts)("gravity", m.gravity)("smooth", m.smooth);
  is("above_ground_m", m.above_ground_m)("start_rates", m.start_rates)("exclude", m.exclude);
}
void fields(auto& is, Of<ModelSpec> auto& m) {
  is("path", m.path)("hash", m.hash)("load", m.load)("variant", m.variant);
}
void fields(auto& is, Of<ContenderSpec> auto& m) { is("name", m.name)("base", m.base)("overrides", m.overrides); }
void fields(auto& is, Of<ControlSpec> auto& m) {
  is("kind", m.kind)("file", m.file)("policy", m.policy)("network", m.network);
  for (const ControlPart& part : kControlParts) is(part.name, m.*part.member);
}
void fields(auto& is, Of<Perturbation> auto& m) {
  for (const PerturbationPart& part : kPerturbationParts) is(part.name, m.*part.member);
}
void fields(auto& is, Of<InitialStates> auto& m) { is("count", m.count)("seed", m.seed)("around", m.around); }
void fields(auto& is, Of<Pushes> auto& m) {
  is("velocity", m.velocity)("every_s", m.every_s)("joint", m.joint)("seed", m.seed);
}
void fields(auto& is, Of<SubjectSpec> auto& m) {
  is("model", m.model)("control", m.control)("contender", m.contender);
  is("duration_s", m.duration_s)("sample_ms", m.sample_ms)("states", m.states);
  is("changes", m.changes);
  is("pushes", m.pushes)("push_sample_ms", m.push_sample_ms);
}
void fields(auto& is, Of<GraspBodies> auto& m) { is("object", m.object)("hand", m.hand)("drop_m", m.drop_m); }
void fields(auto& is, Of<RunJob> auto& m) {
  is("subject", m.subject)("timestep_ms", m.timestep_ms)("measures", m.measures)("trajectories", m.trajectories);
  is("state", m.state)("states", m.states);
  is("save", m.save)("use", m.use)("truth", m.truth)("seed", m.seed)("grasp", m.grasp)("partial", m.partial);
  is("against", m.against)("keep", m.keep)("keep_state", m.keep_state)("watched", m.watched);
  is("solution", m.solution);
}
void fields(auto& is, Of<TruthJob> auto& m) {
  is("model", m.model)("solution", m.solution)("duration_s", m.duration_s)("sample_ms", m.sample_ms);
  is("trajectories", m.trajectories)("save", m.save);
}
void fields(auto& is, Of<PiecesJob> auto& m) {
  is("measure", m.measure);
  is("subject", m.subject)("timestep_ms", m.timestep_ms)("trajectories", m.trajectories)("references", m.references);
  is("pieces", m.pieces)("piece_ms", m.piece_ms)("reference_ms", m.reference_ms)("grid_ms", m.grid_ms);
  is("seed", m.seed)("cold", m.cold);
}
void fields(auto& is, Of<AgreementJob::Other> auto& m) { is("name", m.name)("address", m.address); }
void fields(auto& is, Of<AgreementJob> auto& m) {
  is("measure", m.measure);
  is("trajectories", m.trajectories)("own", m.own)("others", m.others);
}
void fields(auto& is, Of<ScalingJob> auto& m) {
  is("measure", m.measure);
  is("subject", m.subject)("timestep_ms", m.timestep_ms)("seed", m.seed)("trajectories", m.trajectories);
  is("save", m.save)("most_runs", m.most_runs)("enough_s", m.enough_s);
}
void fields(auto& is, Of<ConformanceJob> auto& m) { is("contender", m.contender)("tests", m.tests); }
void fields(auto& is, Of<ProbeJob> auto& m) {
  is("subject", m.subject)("timestep_ms", m.timestep_ms)("whole_run", m.whole_run);
}
void fields(auto& is, Of<TimingJob> auto& m) {
  is("subject", m.subject)("trajectories", m.trajectories)("reference", m.reference);
  is("warmup", m.warmup);
}
void fields(auto& is, Of<TurnPlan> auto& m) {
  is("timestep_ms", m.timestep_ms)("windows", m.windows)("share", m.share)("restart", m.restart)("passes", m.passes);
  is("run", m.run);
}
void fields(auto& is, Of<RunsJob> auto& m) { is("runs", m.runs)("trajectories", m.trajectories)("limit_s", m.limit_s); }
void fields(auto& is, Of<BatchJob> auto& m) {
  is("subject", m.subject)("timestep_ms", m.timestep_ms)("worlds", m.worlds)("device", m.device);
  is("warmup", m.warmup)("seed", m.seed);
}
void fields(auto& is, Of<BatchSampleCommand> auto& m) { is("steps", m.steps)("single_steps", m.single_steps); }
void fields(auto& is, Of<MatchDrive> auto& m) {
  is("times", m.times)("torques", m.torques)("targets", m.targets)("stiffness", m.stiffness)("damping", m.damping);
}
void fields(auto& is, Of<MatchFlight> auto& m) {
  is("body", m.body)("times", m.times)("positions", m.positions)("rotations", m.rotations)("offset", m.offset);
}
void fields(auto& is, Of<MatchWindow> auto& m) {
  is("drive", m.drive)("start_s", m.start_s)("times", m.times)("position", m.position)("velocity", m.velocity);
  is("flights", m.flights);
}
void fields(auto& is, Of<MatchJob> auto& m) {
  is("subject", m.subject)("timestep_ms", m.timestep_ms)("drives", m.drives)("windows", m.windows);
}
void fields(auto& is, Of<MatchCommand> auto& m) {
  is("changes", m.changes)("settings", m.settings)("windows", m.windows)("offsets", m.offsets);
}
void fields(auto& is, Of<PrepareCommand> auto& m) { is("timestep_ms", m.timestep_ms); }
void fields(auto& is, Of<SampleCommand> auto& m) { is("how", m.how); }
void fields(auto& is, Of<SingleStepsCommand> auto& m) { is("how", m.how); }

void fields(auto& is, Of<Ending> auto& m) { is("outcome", m.outcome)("reason", m.reason); }
void fields(auto& is, Of<Value> auto& m) {
  is("name", m.name)("unit", m.unit)("value", m.value)("low", m.low)("high", m.high);
}
void fields(auto& is, Of<SampleSeries> auto& m) { is("name", m.name)("values", m.values); }
void fields(auto& is, Of<CellResult> auto& m) {
  is("measure", m.measure)("ending", m.ending)("values", m.values)("samples", m.samples);
}
void fields(auto& is, Of<JobDone> auto& m) {
  is("cells", m.cells)("engine_s", m.engine_s)("cpu_s", m.cpu_s)("step_us", m.step_us)("start_s", m.start_s)(
      "instance_s", m.instance_s);
}
void fields(auto& is, Of<TestResult> auto& m) {
  is("test", m.test)("status", m.status)("figure", m.figure)("tolerance", m.tolerance)("unit", m.unit)("note", m.note);
}
void fields(auto& is, Of<JobError> auto& m) { is("text", m.text)("input", m.input); }
void fields(auto& is, Of<JobCrash> auto& m) { is("reason", m.reason); }
void fields(auto& is, Of<SessionReady> auto& m) { is("core", m.core)("clock_s", m.clock_s); }
void fields(auto& is, Of<Prepared> auto& m) { is("ending", m.ending)("engine_s", m.engine_s)("step_s", m.step_s); }
void fields(auto& is, Of<Sampled> auto& m) {
  is("ending", m.ending)("engine_s", m.engine_s)("cpu_s", m.cpu_s)("wall_s", m.wall_s);
  is("clock_share", m.clock_share)("input_us", m.input_us)("switches", m.switches)("step_us", m.step_us);
}
void fields(auto& is, Of<SingleSteps> auto& m) {
  is("ending", m.ending)("engine_s", m.engine_s)("p50_us", m.p50_us)("p99_us", m.p99_us)("worst_us", m.worst_us);
}
void fields(auto& is, Of<BatchPrepared> auto& m) {
  is("ending", m.ending)("engine_s", m.engine_s)("step_s", m.step_s)("device", m.device)("driver", m.driver);
  is("memory_bytes", m.memory_bytes)("compile_s", m.compile_s)("processes", m.processes);
  is("equivalence_m", m.equivalence_m)("bound_m", m.bound_m)("compared", m.compared);
}
void fields(auto& is, Of<BatchSampled> auto& m) {
  is("ending", m.ending)("engine_s", m.engine_s)("wall_s", m.wall_s);
  is("step_us", m.step_us)("latency_us", m.latency_us);
}

void fields(auto& is, Of<MatchRun> auto& m) { is("ending", m.ending).packed("samples", m.samples); }
void fields(auto& is, Of<MatchSimulated> auto& m) { is("runs", m.runs)("engine_s", m.engine_s); }

// ---- packed series --------------------------------------------------------------------------------------------------

constexpr std::string_view kHexDigits = "0123456789abcdef";
constexpr size_t kDigitsOfNumber = 16;
constexpr int kBitsOfNumber = 64;

// ---- writing --------------------------------------------------------------------------------------------------------

struct Writer {
  json object = json::object();

  template <typename T>
  Writer& operator()(const char* key, const T& value) {
    object[key] = written(value);
    return *this;
  }

  // A long series as one text: 16 hexadecimal digits a number, which are read and written faster than decimal ones.
  Writer& packed(const char* key, const std::vector<double>& values) {
    std::string text;
    text.reserve(kDigitsOfNumber * values.size());
    for (const double value : values) {
      const auto bits = std::bit_cast<std::uint64_t>(value);
      for (int shift = kBitsOfNumber - 4; shift >= 0; shift -= 4) text += kHexDigits[(bits >> shift) & 15U];
    }
    object[key] = std::move(text);
    return *this;
  }

  static json written(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }
  static json written(const std::optional<double>& value) { return value ? written(*value) : json(nullptr); }
  static json written(RootJoint value) { return static_cast<int>(value); }
  static json written(Ground value) { return static_cast<int>(value); }
  static json written(Outcome value) { return std::string(outcome_text(value)); }
  template <typename T>
  static json written(const std::vector<T>& values) {
    json list = json::array();
    for (const T& value : values) list.push_back(written(value));
    return list;
  }
  template <typename T>
  static json written(const T& value) {
    if constexpr (std::integral<T> || std::constructible_from<json::string_t, T> ||
                  std::same_as<T, std::map<std::string, std::string>>) {
      return value;
    } else {
      Writer nested;
      fields(nested, value);
      return std::move(nested.object);
    }
  }
};

// ---- reading --------------------------------------------------------------------------------------------------------

class Reader {
 public:
  // `where` names the object in messages: "run.subject".
  Reader(const json& object, std::string where) : object_(object), where_(std::move(where)) {
    if (!object.is_object()) fail(where_, "is not an object");
  }

  template <typename T>
  Reader& operator()(const char* key, T& value) {
    const std::string where = fmt::format("{}.{}", where_, key);
    const auto found = object_.find(key);
    if (found == object_.end()) fail(where, "is missing");
    known_.insert(key);
    read(*found, value, where);
    return *this;
  }

  Reader& packed(const char* key, std::vector<double>& values) {
    std::string text;
    (*this)(key, text);
    if (text.size() % kDigitsOfNumber != 0) fail(fmt::format("{}.{}", where_, key), "has half a number");
    values.clear();
    values.reserve(text.size() / kDigitsOfNumber);
    std::uint64_t bits = 0;
    for (size_t i = 0; i < text.size(); ++i) {
      const char c = text[i];
      const bool decimal = c >= '0' && c <= '9';
      if (!decimal && (c < 'a' || c > 'f')) fail(fmt::format("{}.{}", where_, key), "is not hexadecimal");
      bits = bits << 4U | static_cast<std::uint64_t>(decimal ? c - '0' : c - 'a' + 10);
      if ((i + 1) % kDigitsOfNumber == 0) values.push_back(std::bit_cast<double>(bits));
    }
    return *this;
  }

  // Call it after the last field.
  void refuse_others() const {
    for (const auto& [key, value] : object_.items()) {
      if (!known_.contains(key)) fail(fmt::format("{}.{}", where_, key), "is unknown");
    }
  }

  void know(const char* key) { known_.insert(key); }

 private:
  [[noreturn]] static void fail(const std::string& where, const std::string& what) {
    throw MessageError(fmt::format("'{}' {}", where, what));
  }
  static void expect(bool fine, const json& from, const char* wanted, const std::string& where) {
    if (!fine) fail(where, fmt::format("is not {} ({})", wanted, from.type_name()));
  }

  // An enumeration whose values are 0 to 2.
  template <typename T>
    requires std::same_as<T, RootJoint> || std::same_as<T, Ground>
  static void read(const json& from, T& value, const std::string& where) {
    const bool fine = from.is_number_integer() && from.get<int>() >= 0 && from.get<int>() <= 2;
    expect(fine, from, "a number from 0 to 2", where);
    value = static_cast<T>(from.get<int>());
  }
  static void read(const json& from, bool& value, const std::string& where) {
    expect(from.is_boolean(), from, "a boolean", where);
    value = from.get<bool>();
  }
  template <std::integral T>
  static void read(const json& from, T& value, const std::string& where) {
    expect(from.is_number_integer(), from, "a whole number", where);
    const bool fits = from.is_number_unsigned() ? std::in_range<T>(from.get<std::uint64_t>())
                                                : std::in_range<T>(from.get<std::int64_t>());
    if (!fits) fail(where, fmt::format("is out of range ({})", dump_json(from)));
    value = from.get<T>();
  }
  static void read(const json& from, double& value, const std::string& where) {
    expect(from.is_number(), from, "a number", where);
    value = from.get<double>();
    if (!std::isfinite(value)) fail(where, "is out of range");
  }
  static void read(const json& from, std::optional<double>& value, const std::string& where) {
    value.reset();
    if (!from.is_null()) read(from, value.emplace(), where);
  }
  static void read(const json& from, std::string& value, const std::string& where) {
    expect(from.is_string(), from, "a text", where);
    value = from.get<std::string>();
  }
  static void read(const json& from, Outcome& value, const std::string& where) {
    std::string text;
    read(from, text, where);
    const auto outcome = parse_outcome(text);
    if (!outcome) fail(where, fmt::format("is no outcome ('{}')", text));
    value = *outcome;
  }
  static void read(const json& from, std::map<std::string, std::string>& value, const std::string& where) {
    expect(from.is_object(), from, "an object", where);
    value.clear();
    for (const auto& [key, text] : from.items()) read(text, value[key], fmt::format("{}.{}", where, key));
  }
  // A number of a series that is absent is NaN.
  static void read(const json& from, std::vector<double>& values, const std::string& where) {
    expect(from.is_array(), from, "a list", where);
    values.clear();
    for (const json& entry : from) {
      values.push_back(std::numeric_limits<double>::quiet_NaN());
      if (!entry.is_null()) read(entry, values.back(), where);
    }
  }
  template <typename T>
  static void read(const json& from, std::vector<T>& values, const std::string& where) {
    expect(from.is_array(), from, "a list", where);
    values.clear();
    for (const json& entry : from) {
      const std::string at = fmt::format("{}[{}]", where, values.size());
      read(entry, values.emplace_back(), at);
    }
  }
  template <typename T>
    requires std::is_class_v<T>
  static void read(const json& from, T& value, const std::string& where) {
    Reader nested(from, where);
    fields(nested, value);
    nested.refuse_others();
  }

  const json& object_;
  std::string where_;
  std::set<std::string> known_;
};

// ---- lines ----------------------------------------------------------------------------------------------------------

template <typename Message, size_t count>
std::string line_of(const Message& message, const std::array<std::string_view, count>& kinds) {
  json object = std::visit([](const auto& each) { return Writer::written(each); }, message);
  object["kind"] = kinds.at(message.index());
  return dump_json(object) + "\n";
}

template <typename Message, size_t index = 0>
Message read_alternative(size_t wanted, const json& object, const std::string& kind) {
  if constexpr (index < std::variant_size_v<Message>) {
    if (index != wanted) return read_alternative<Message, index + 1>(wanted, object, kind);
    std::variant_alternative_t<index, Message> message;
    Reader reader(object, kind);
    reader.know("kind");
    fields(reader, message);
    reader.refuse_others();
    return message;
  } else {
    throw MessageError(fmt::format("a message is of the unknown kind '{}'", kind));
  }
}

template <typename Message, size_t count>
Message parse(std::string_view line, const std::array<std::string_view, count>& kinds) {
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object()) throw MessageError("a message is not a JSON object");
  const auto kind = object.find("kind");
  if (kind == object.end() || !kind->is_string()) throw MessageError("a message has no kind");
  const auto name = kind->get<std::string>();
  size_t index = 0;
  while (index < count && kinds[index] != name) ++index;
  return read_alternative<Message>(index, object, name);
}

}  // namespace

std::string to_line(const Request& message) { return line_of(message, kRequestKinds); }
std::string to_line(const Reply& message) { return line_of(message, kReplyKinds); }
Request parse_request(std::string_view line) { return parse<Request>(line, kRequestKinds); }
Reply parse_reply(std::string_view line) { return parse<Reply>(line, kReplyKinds); }
std::string_view kind_of(const Reply& message) { return kReplyKinds.at(message.index()); }

}  // namespace assay
