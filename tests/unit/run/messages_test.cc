// Messages between the coordinator and its workers: what is written is read back, and what is damaged is refused.
#include "run/messages/messages.h"

#include <cmath>
#include <functional>
#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "base/fields.h"

namespace assay {
namespace {

using nlohmann::json;
using ::testing::AllOf;
using ::testing::HasSubstr;

// ---- a message of each kind, no field at its default ----------------------------------------------------------------

const ModelSpec kModel = {"models/chain.xml",
                          "abc",
                          {true, "home", "pose.txt", "arm", {{"my_robot", "dir"}}, RootJoint::kFloating, Ground::kNone},
                          {false, false, true, 0.05, 1}};
const ContenderSpec kContender = {"A", "mujoco-euler", {{"iterations", "50"}, {"cone", "elliptic"}}};
const SubjectSpec kSubject = {
    kModel,
    {.kind = "sine", .amplitude = 2, .frequency = 3, .phase_step = 0.1, .policy = "p.toml", .network = "p.onnx"},
    kContender,
    1.5,
    16,
    {3, 5, {.joint_rate = 0.7, .spin = 0.9}},
    {0.5, 2, "knee", 9},
    8,
    {"armature=off", "delay=1"}};
const TurnPlan kHow = {0.25, 17, 0.5, true, 8, "u"};
const Ending kEnding = {Outcome::kUnstable, "at 1 s: \"too fast\"\nsecond line \xc3\xa9"};

std::vector<Request> requests() {
  RunJob run = {kSubject, 0.25, {"drift", "truth"}, "dir", 1, 4, "s", {"u", "v"}, "t", 7, {1, 2, 0.3}, true, {"x", ""}};
  run.solution = "slide-and-roll";
  return {run,
          TruthJob{kModel, "slide-and-roll", 2, 16, "dir", "address"},
          PiecesJob{"consistency", kSubject, 0.25, "dir", {"r", "q"}, 10, {128, 8}, 1.0 / 64, 8, 7, "cold"},
          AgreementJob{"agreement", "dir", "own", {{"B", "b"}, {"C", "c"}}},
          ScalingJob{"scaling", kSubject, 0.25, 7, "dir", "s", 5, 2.5},
          ConformanceJob{kContender, {"free-fall", "sliding"}},
          ProbeJob{kSubject, 0.25, true},
          TimingJob{kSubject, "dir", "r", 5},
          PrepareCommand{0.25},
          SampleCommand{kHow},
          SingleStepsCommand{kHow},
          RunsJob{{RunJob{kSubject, 0.25, {"reference"}, "dir", 1, 4, "s", {}, "", 7, {}, true, {}}}, "dir", 30}};
}

std::vector<Reply> replies() {
  return {JobDone{{{"drift",
                    kEnding,
                    {{"energy_drift", "J", 1.0 / 3, {}, 2.5}, {"x", "1", {}, {}, {}}},
                    {{"piece_error_m", {1e-300, 0.1, -2}}, {"empty", {}}}}},
                  1.25,
                  2.5,
                  0.125,
                  3.5},
          TestResult{"free-fall", "deviation", 1e-9, {}, "m", "declared"},
          JobError{"no such file", true},
          JobCrash{"exception: why"},
          SessionReady{3, 2e-8},
          Prepared{kEnding, 0.5, 1e-5},
          Sampled{kEnding, 0.5, 0.6, 0.7, 0.01, 0.25, 3, {1, 2, 3}},
          SingleSteps{kEnding, 0.5, 1, 2, 3},
          MatchSimulated{{{kEnding, {1.0 / 3, -0.0, 1e-300}}, {{}, {}}}, 0.25}};
}

// Every message, as its line and as the function that reads such a line and writes it once more.
using Again = std::string (*)(std::string_view);
std::vector<std::pair<std::string, Again>> lines() {
  std::vector<std::pair<std::string, Again>> all;
  for (const Request& each : requests()) {
    all.emplace_back(to_line(each), [](std::string_view line) { return to_line(parse_request(line)); });
  }
  for (const Reply& each : replies()) {
    all.emplace_back(to_line(each), [](std::string_view line) { return to_line(parse_reply(line)); });
  }
  return all;
}

std::string refusal(Again again, const json& message) {
  try {
    again(message.dump());
  } catch (const MessageError& error) {
    return error.what();
  }
  ADD_FAILURE() << "was taken for a message: " << message;
  return "";
}

// ---- round trips ----------------------------------------------------------------------------------------------------

TEST(Messages, EveryKindIsReadAsItWasWritten) {
  for (const auto& [line, again] : lines()) {
    EXPECT_EQ(again(line), line);
    EXPECT_EQ(line.find('\n'), line.size() - 1) << "one line";
  }
}

TEST(Messages, EveryMemberIsWritten) {
  const auto count = [](const auto& message) {
    std::visit(
        [&](const auto& each) {
          using Message = std::decay_t<decltype(each)>;
          // std::optional makes members ambiguous; the test below compares these.
          if constexpr (!std::is_same_v<Message, TestResult>) {
            EXPECT_EQ(json::parse(to_line(message)).size(), member_count<Message>() + 1) << to_line(message);
          }
        },
        message);
  };
  for (const Request& each : requests()) count(each);
  for (const Reply& each : replies()) count(each);
  const json subject = json::parse(to_line(requests()[0])).at("subject");
  EXPECT_EQ(subject.size(), member_count<SubjectSpec>());
  EXPECT_EQ(subject.at("model").size(), member_count<ModelSpec>());
  EXPECT_EQ(subject.at("model").at("load").size(), member_count<LoadOptions>());
  EXPECT_EQ(subject.at("model").at("variant").size(), member_count<ModelVariant>());
  EXPECT_EQ(subject.at("control").size(), member_count<ControlSpec>());
  EXPECT_EQ(subject.at("contender").size(), member_count<ContenderSpec>());
}

TEST(Messages, APackedSeriesIsWholeOrRefused) {
  const auto again = [](std::string_view line) { return to_line(parse_reply(line)); };
  json message = json::parse(to_line(MatchSimulated{{{{}, {1.5}}}, 0}));
  const json::json_pointer samples("/runs/0/samples");
  EXPECT_EQ(message.at(samples), "3ff8000000000000");
  message[samples] = "3ff800000000000";
  EXPECT_EQ(refusal(again, message), "'simulated.runs[0].samples' has half a number");
  message[samples] = "3ff800000000000G";
  EXPECT_EQ(refusal(again, message), "'simulated.runs[0].samples' is not hexadecimal");
  message[samples] = {1.5};
  EXPECT_EQ(refusal(again, message), "'simulated.runs[0].samples' is not a text (array)");
}

TEST(Messages, NumbersKeepTheirBits) {
  const auto done = std::get<JobDone>(parse_reply(to_line(replies()[0])));
  const CellResult& cell = done.cells.at(0);
  EXPECT_EQ(cell.ending.outcome, Outcome::kUnstable);
  EXPECT_EQ(cell.ending.reason, kEnding.reason);
  EXPECT_EQ(cell.values.at(0).value, 1.0 / 3);
  EXPECT_EQ(cell.values.at(0).low, std::nullopt);
  EXPECT_EQ(cell.values.at(0).high, 2.5);
  EXPECT_EQ(cell.samples.at(0).values, (std::vector<double>{1e-300, 0.1, -2}));
  const auto test = std::get<TestResult>(parse_reply(to_line(replies()[1])));
  EXPECT_EQ(test.figure, 1e-9);
  EXPECT_EQ(test.tolerance, std::nullopt);
  const double infinity = std::numeric_limits<double>::infinity();
  const auto packed = std::get<MatchSimulated>(
      parse_reply(to_line(MatchSimulated{{{{}, {-1.0 / 3, -0.0, 1e-300, infinity, -std::nan("")}}}, 0})));
  const std::vector<double>& samples = packed.runs.at(0).samples;
  EXPECT_EQ(samples.size(), 5U);
  EXPECT_EQ(samples[0], -1.0 / 3);
  EXPECT_TRUE(samples[1] == 0 && std::signbit(samples[1]));
  EXPECT_EQ(samples[2], 1e-300);
  EXPECT_EQ(samples[3], infinity);
  EXPECT_TRUE(std::isnan(samples[4]));
  const auto job = std::get<RunJob>(parse_request(to_line(requests()[0])));
  EXPECT_EQ(job.seed, 7U);
  EXPECT_EQ(job.subject.contender.overrides, kContender.overrides);
  EXPECT_EQ(job.grasp.hand, 2);
  EXPECT_EQ(job.solution, "slide-and-roll");
}

TEST(Messages, WhatIsNotFiniteIsAbsent) {
  const double infinity = std::numeric_limits<double>::infinity();
  const JobDone sent = {
      {{"drift", {}, {{"x", "m", infinity, std::nan(""), 1}}, {{"s", {1, std::nan(""), 3}}}}}, 0, 0, 0};
  const CellResult read = std::get<JobDone>(parse_reply(to_line(sent))).cells.at(0);
  EXPECT_EQ(read.values[0].value, std::nullopt);
  EXPECT_EQ(read.values[0].low, std::nullopt);
  EXPECT_EQ(read.values[0].high, 1);
  EXPECT_EQ(read.samples[0].values[0], 1);
  EXPECT_TRUE(std::isnan(read.samples[0].values[1]));
  // A number that has to be there is refused when it is not finite.
  EXPECT_THROW(parse_reply(to_line(JobDone{{}, infinity, 0, 0})), MessageError);
}

TEST(Messages, BytesThatAreNotTextAreReplaced) {
  const auto read = std::get<JobCrash>(parse_reply(to_line(JobCrash{"before \xff\xfe after"})));
  EXPECT_THAT(read.reason, AllOf(HasSubstr("before "), HasSubstr(" after")));
}

// ---- damage ---------------------------------------------------------------------------------------------------------

// Calls `look` with every field of the message: the object that holds it, by its place in the message, and its key.
void each_field(const json& part, const json::json_pointer& at,
                const std::function<void(const json::json_pointer&, const std::string&)>& look) {
  if (part.is_array() && !part.empty()) each_field(part[0], at / 0, look);
  if (!part.is_object()) return;
  for (const auto& [key, value] : part.items()) {
    look(at, key);
    if (key != "overrides" && key != "packages") each_field(value, at / key, look);  // whose keys are free
  }
}

TEST(Messages, AMissingFieldIsNamed) {
  for (const auto& [line, again] : lines()) {
    const json message = json::parse(line);
    each_field(message, json::json_pointer(), [&, again = again](const json::json_pointer& at, const std::string& key) {
      json damaged = message;
      damaged[at].erase(key);
      EXPECT_THAT(refusal(again, damaged), HasSubstr(key == "kind" && at.empty() ? "no kind" : key + "' is missing"));
    });
  }
}

TEST(Messages, AFieldOfAnotherTypeIsNamed) {
  for (const auto& [line, again] : lines()) {
    const json message = json::parse(line);
    each_field(message, json::json_pointer(), [&, again = again](const json::json_pointer& at, const std::string& key) {
      json damaged = message;
      json& field = damaged[at][key];
      field = field.is_string() ? json(1) : json("a text");
      EXPECT_THAT(refusal(again, damaged), HasSubstr(key == "kind" && at.empty() ? "no kind" : key + "' is not"));
    });
  }
}

TEST(Messages, AnUnknownFieldIsNamed) {
  for (const auto& [line, again] : lines()) {
    const json message = json::parse(line);
    each_field(message, json::json_pointer(), [&, again = again](const json::json_pointer& at, const std::string&) {
      json damaged = message;
      damaged[at]["surprise"] = 1;
      EXPECT_THAT(refusal(again, damaged), HasSubstr("surprise' is unknown"));
    });
  }
}

TEST(Messages, ALineThatWasCutIsRefused) {
  for (const auto& [line, again] : lines()) {
    for (size_t length = 0; length + 2 < line.size(); ++length) {
      EXPECT_THROW(again(line.substr(0, length)), MessageError) << line.substr(0, length);
    }
  }
}

TEST(Messages, WhatIsNoMessageIsRefused) {
  for (const char* line : {"", "\n", "null", "[]", "{}", "\"run\"", R"({"kind": 1})", R"({"kind": "nonsense"})",
                           R"({"kind": "run"})", "\xff\xfe", "{\"kind\": \"crash\", \"reason\": \"\xff\"}"}) {
    EXPECT_THROW(parse_request(line), MessageError) << line;
    EXPECT_THROW(parse_reply(line), MessageError) << line;
  }
  // A reply is no request.
  EXPECT_THROW(parse_request(to_line(replies()[0])), MessageError);
  EXPECT_THROW(parse_reply(to_line(requests()[0])), MessageError);
}

TEST(Messages, NumbersOutOfRangeAreRefused) {
  for (const char* core : {"1.5", "1e3", "99999999999", "-99999999999", "18446744073709551615", "true"}) {
    EXPECT_THROW(parse_reply(fmt::format(R"({{"kind":"ready","core":{},"clock_s":0}})", core)), MessageError) << core;
  }
  EXPECT_THROW(parse_reply(R"({"kind":"ready","core":0,"clock_s":1e999})"), MessageError);
  EXPECT_THROW(parse_reply(R"({"kind":"prepared","ending":{"outcome":"fine","reason":""},"engine_s":0,"how":{}})"),
               MessageError);
}

}  // namespace
}  // namespace assay
