// Networks of policies, run by ONNX Runtime.
#include "controls/onnx_network.h"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "controls/control.h"
#include "controls/policy.h"
#include "policy_files.h"

namespace assay {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// ---- ONNX files, written as the format says: protocol buffers -------------------------------------------------------

std::string varint(std::uint64_t value) {
  std::string bytes;
  while (value >= 128) {
    bytes += static_cast<char>(value % 128 + 128);
    value /= 128;
  }
  return bytes + static_cast<char>(value);
}
std::string number(int field, std::uint64_t value) {
  return varint(static_cast<std::uint64_t>(field) * 8U) + varint(value);
}
std::string message(int field, const std::string& content) {
  return varint(static_cast<std::uint64_t>(field) * 8U + 2U) + varint(content.size()) + content;
}

constexpr int kFloats = 1, kInt64 = 7, kDoubles = 11;

// A size below 0 is dynamic.
std::string port(const std::string& name, const std::vector<int>& shape, int type = kFloats) {
  std::string sizes;
  for (const int size : shape) {
    sizes += message(1, size < 0 ? message(2, "n") : number(1, static_cast<std::uint64_t>(size)));
  }
  return message(1, name) + message(2, message(1, number(1, static_cast<std::uint64_t>(type)) + message(2, sizes)));
}

template <typename T>
std::string matrix(const std::string& name, int rows, int columns, const std::vector<T>& values, int type) {
  const std::string raw(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  return number(1, static_cast<std::uint64_t>(rows)) + number(1, static_cast<std::uint64_t>(columns)) +
         number(2, static_cast<std::uint64_t>(type)) + message(8, name) + message(9, raw);
}

std::string node(const std::string& type, const std::vector<std::string>& inputs, const std::string& output) {
  std::string text;
  for (const std::string& input : inputs) text += message(1, input);
  return text + message(2, output) + message(4, type);
}

std::string onnx_file(const std::string& graph) {
  return number(1, 8) + message(7, graph + message(2, "test")) + message(8, message(1, "") + number(2, 17));
}

// actions = obs times a matrix of three rows and two columns.
std::string linear_network(const std::vector<int>& input = {1, 3}, const std::vector<int>& output = {1, 2}) {
  return onnx_file(message(1, node("MatMul", {"obs", "w"}, "actions")) +
                   message(5, matrix<float>("w", 3, 2, {1, 10, 2, 20, 3, 30}, kFloats)) +
                   message(11, port("obs", input)) + message(12, port("actions", output)));
}

// Three numbers in, two out.
std::string three_numbers() { return config_text(term("constant", "values = [1, 2, 3]\n")); }

class OnnxNetworks : public testing::Test {
 protected:
  void SetUp() override {
    if (!has_onnx_runtime()) GTEST_SKIP() << "needs ONNX Runtime, which setup/setup.sh puts into the cache";
  }
  static std::vector<double> answer(const std::string& file, const std::vector<double>& observation,
                                    const std::string& config = three_numbers()) {
    const PolicyConfig parsed_config = parsed(config);
    std::vector<double> actions(parsed_config.joints.size());
    onnx_network(file, "policy.onnx", parsed_config)->act(observation, actions);
    return actions;
  }
  static std::string refusal(const std::string& file, const std::string& config = three_numbers()) {
    try {
      onnx_network(file, "policy.onnx", parsed(config));
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
};

TEST_F(OnnxNetworks, AreRun) {
  EXPECT_THAT(answer(linear_network(), {1, 2, 3}), ElementsAre(14, 140));
  EXPECT_THAT(answer(linear_network({-1, 3}, {-1, 2}), {1, 0, 0}), ElementsAre(1, 10));
  EXPECT_THAT(answer(linear_network({3}, {2}), {0, 0, 1}), ElementsAre(3, 30));
  const std::string doubles =
      onnx_file(message(1, node("MatMul", {"obs", "w"}, "actions")) +
                message(5, matrix<double>("w", 3, 2, {0.1, 0, 0, 0, 0, 0}, kDoubles)) +
                message(11, port("obs", {1, 3}, kDoubles)) + message(12, port("actions", {1, 2}, kDoubles)));
  EXPECT_EQ(answer(doubles, {0.3, 0, 0})[0], 0.1 * 0.3);
}

TEST_F(OnnxNetworks, OfAnotherSizeAreRefused) {
  EXPECT_THAT(refusal(linear_network(), config_text(term("base_lin_vel") + term("base_ang_vel"))),
              AllOf(HasSubstr("'obs'"), HasSubstr("float [1, 3]"), HasSubstr("has 6")));
  EXPECT_THAT(refusal(linear_network(),
                      config_text(term("constant", "values = [1, 2, 3]\n"), "", kActions, kPd, "history = 2\n")),
              HasSubstr("has 3 times a history of 2"));
  EXPECT_THAT(refusal(linear_network(), config_text(term("constant", "values = [1, 2, 3]\n"), "",
                                                    "[actions]\ntype = \"joint_effort\"\njoints = [\"hip\"]\n", "")),
              AllOf(HasSubstr("'actions'"), HasSubstr("2 numbers"), HasSubstr("has 1 action:")));
  EXPECT_THAT(refusal(linear_network({1, -1}, {1, 2})),
              AllOf(HasSubstr("float [1, ?]"), HasSubstr("size is not fixed")));
}

TEST_F(OnnxNetworks, OfOtherTypesAndPortsAreRefused) {
  const std::string cast =
      onnx_file(message(1, node("Identity", {"obs"}, "actions")) + message(11, port("obs", {1, 3}, kInt64)) +
                message(12, port("actions", {1, 3}, kInt64)));
  EXPECT_THAT(refusal(cast), AllOf(HasSubstr("int64 [1, 3]"), HasSubstr("export it as float")));
  const std::string two_inputs =
      onnx_file(message(1, node("Add", {"obs", "hidden"}, "actions")) + message(11, port("obs", {1, 3})) +
                message(11, port("hidden", {1, 3})) + message(12, port("actions", {1, 3})));
  EXPECT_THAT(refusal(two_inputs), HasSubstr("has 2 inputs (obs, hidden)"));
  const std::string two_outputs = onnx_file(
      message(1, node("MatMul", {"obs", "w"}, "actions")) + message(1, node("Neg", {"actions"}, "values")) +
      message(5, matrix<float>("w", 3, 2, {1, 10, 2, 20, 3, 30}, kFloats)) + message(11, port("obs", {1, 3})) +
      message(12, port("actions", {1, 2})) + message(12, port("values", {1, 2})));
  EXPECT_THAT(refusal(two_outputs), AllOf(HasSubstr("2 outputs (actions, values)"), HasSubstr("output = ")));
  const std::string terms = term("constant", "values = [1, 2, 3]\n");
  EXPECT_THAT(answer(two_outputs, {1, 0, 0}, config_text(terms, "output = \"values\"\n")), ElementsAre(-1, -10));
  EXPECT_THAT(refusal(two_outputs, config_text(terms, "output = \"value\"\n")), HasSubstr("has no output 'value'"));
}

TEST_F(OnnxNetworks, ThatAreNoneAreRefused) {
  EXPECT_THAT(refusal("no network"), HasSubstr("'policy.onnx' cannot be used"));
  EXPECT_THAT(refusal(""), HasSubstr("'policy.onnx' cannot be used"));
  const std::string whole = linear_network();
  EXPECT_THAT(refusal(whole.substr(0, whole.size() / 2)), HasSubstr("'policy.onnx' cannot be used"));
  const std::string unknown = onnx_file(message(1, node("Levitate", {"obs"}, "actions")) +
                                        message(11, port("obs", {1, 3})) + message(12, port("actions", {1, 2})));
  EXPECT_THAT(refusal(unknown), HasSubstr("Levitate"));
}

// What ONNX Runtime 1.32 says of a graph without its output, of an initializer that is too short, and of an operator.
TEST(OnnxWords, HaveNoSourceFilesAndNoSignatures) {
  EXPECT_EQ(onnx_words("/src/core/graph/graph.cc:1617 void onnxruntime::Graph::Initialize(const std::unordered_map<"
                       "std::__cxx11::basic_string<char>, int>&, bool) const [with T = float] This is an invalid "
                       "model. Graph output (actions) does not exist in the graph.\n"),
            "This is an invalid model. Graph output (actions) does not exist in the graph");
  EXPECT_EQ(onnx_words("Exception during initialization: /src/core/initializer.cc:51 onnxruntime::Initializer::"
                       "Initializer(const onnx::TensorProto&) [ONNXRuntimeError] : 1 : FAIL : tensorprotoutils.cc:1805 "
                       "ValidateSize Initializer 'w': data field count (3) does not match expected count (6)\n"),
            "Initializer 'w': data field count (3) does not match expected count (6)");
  EXPECT_EQ(onnx_words("/src/a.cc:5 onnxruntime::Status onnxruntime::F(int&) status.IsOK() was false. "),
            "its graph is not valid");
  EXPECT_EQ(onnx_words("Node with schema(::MatMul:13) has input size 1"),
            "Node with schema(::MatMul:13) has input size 1");
}

TEST_F(OnnxNetworks, WithABadGraphAreRefusedWithoutSignatures) {
  const auto linear = [](const std::string& weights, const std::string& output) {
    return onnx_file(message(1, node("MatMul", {"obs", "w"}, output)) + weights + message(11, port("obs", {1, 3})) +
                     message(12, port("actions", {1, 2})));
  };
  const std::string weights = message(5, matrix<float>("w", 3, 2, {1, 10, 2, 20, 3, 30}, kFloats));
  for (const std::string& bad :
       {linear(weights, "x"), linear(message(5, matrix<float>("w", 3, 2, {1, 10}, kFloats)), "actions"),
        linear("", "actions"), onnx_file(""), linear(weights, "actions") + number(1, 99)}) {
    const std::string words = refusal(bad);
    EXPECT_THAT(words, HasSubstr("the network 'policy.onnx' cannot be used: "));
    for (const char* raw : {"onnxruntime::", "std::", ".cc:", ".h:", "const ", "FAIL"}) {
      EXPECT_THAT(words, Not(HasSubstr(raw)));
    }
  }
}

TEST_F(OnnxNetworks, WhoseAnswerHasAnotherSizeThanTheySayEndTheRun) {
  // says two numbers, gives as many as there are positive ones
  const std::string varying = onnx_file(message(1, node("Greater", {"obs", "zero"}, "over")) +
                                        message(1, node("Squeeze", {"over"}, "positive")) +
                                        message(1, node("Compress", {"obs", "positive"}, "actions")) +
                                        message(5, matrix<float>("zero", 1, 1, {0}, kFloats)) +
                                        message(11, port("obs", {1, 3})) + message(12, port("actions", {2})));
  const PolicyConfig config = parsed(three_numbers());
  std::unique_ptr<ActionSource> network;
  try {
    network = onnx_network(varying, "policy.onnx", config);
  } catch (const InputError&) {
    GTEST_SKIP() << "this version refuses it when it is read";
  }
  std::vector<double> actions(2);
  EXPECT_THROW(network->act(std::vector{1.0, -1.0, -1.0}, actions), PolicyError);
}

TEST_F(PolicyFile, TheWholeWayFromFilesToTorques) {
  if (!has_onnx_runtime()) GTEST_SKIP() << "needs ONNX Runtime";
  write("policy.onnx", linear_network());
  const auto control = policy_control(
      walker(),
      write("policy.toml", config_text(term("constant", "values = [1, 2, 3]\n"), "network = \"policy.onnx\"\n",
                                       "[actions]\ntype = \"joint_effort\"\nscale = 0.1\n", "")),
      "");
  std::vector<double> torques(2);
  control->start(0.005)->torques(walker().initial, torques);
  EXPECT_NEAR(torques[0], 1.4, 1e-6);
  EXPECT_NEAR(torques[1], 14, 1e-5);
  EXPECT_NO_THROW(control->rehearse());
}

}  // namespace
}  // namespace assay
