// Mutated files of models/: whatever is wrong with a file, its refusal is a sentence of ours with a way out, and no
// words of a parser. ASSAY_MUTATIONS sets how many are tried, ASSAY_MUTATIONS_SEED from which on.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/errors.h"
#include "load/mjcf.h"

namespace assay {
namespace {

namespace fs = std::filesystem;

int setting(const char* name, int otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atoi(value);
}

std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Part of a text.
struct Span {
  size_t begin = 0, size = 0;
};

std::vector<Span> found(const std::string& text, const std::regex& what) {
  std::vector<Span> all;
  for (std::sregex_iterator it(text.begin(), text.end(), what), end; it != end; ++it) {
    all.push_back({static_cast<size_t>(it->position()), static_cast<size_t>(it->length())});
  }
  return all;
}

class Mutator {
 public:
  explicit Mutator(unsigned seed) : random_(seed) {}

  // Name of what was done with it.
  std::string mutate(std::string& text) {
    static const std::regex kAttribute(" [\\w:]+=(\"[^\"]*\"|'[^']*')"), kElement("<\\w+[^<>]*/>"), kTag("<\\w+"),
        kStart("<\\w+[^<>]*[^/<>]>"), kEnd("</\\w+>");
    switch (below(16)) {
      case 0:
        return remove(text, kAttribute) ? "an attribute less" : "";
      case 1:
        return change(text, kAttribute, [&](const std::string& a) { return " " + a.substr(2); })
                   ? "a name of an attribute"
                   : "";
      case 2:
        return change(text, kTag, [&](const std::string& tag) { return tag + "x"; }) ? "a name of an element" : "";
      case 3:
        return remove(text, kElement) ? "an element less" : "";
      case 4:
        return change(text, kElement, [](const std::string& e) { return e + e; }) ? "an element twice" : "";
      case 5:
        return remove(text, kStart) ? "a start less" : "";
      case 6:
        return remove(text, kEnd) ? "an end less" : "";
      case 7: {
        const std::vector<Span> all = found(text, kElement);
        if (all.size() < 2) return "";
        const Span from = pick(all);
        const std::string element = text.substr(from.begin, from.size);
        text.erase(from.begin, from.size);
        text.insert(pick(found(text, kTag)).begin, element);
        return "an element elsewhere";
      }
      case 8:
        text.resize(below(text.size()));
        return "an end of the file";
      case 9:
        text.insert(below(text.size()), 1, "<>\"&'/=\x80\x01"[below(9)]);
        return "a character more";
      case 10:
        if (below(4) != 0) return "";
        text = utf16(text);
        return "another encoding";
      default:
        return change(text, kAttribute, [&](const std::string& a) { return other_value(a); }) ? "a value" : "";
    }
  }

 private:
  size_t below(size_t count) { return count == 0 ? 0 : std::uniform_int_distribution<size_t>(0, count - 1)(random_); }
  Span pick(const std::vector<Span>& all) { return all.empty() ? Span() : all[below(all.size())]; }

  template <typename Work>
  bool change(std::string& text, const std::regex& what, const Work& work) {
    const std::vector<Span> all = found(text, what);
    if (all.empty()) return false;
    const Span at = pick(all);
    text.replace(at.begin, at.size, work(text.substr(at.begin, at.size)));
    return true;
  }
  bool remove(std::string& text, const std::regex& what) {
    return change(text, what, [](const std::string&) { return std::string(); });
  }

  std::string other_value(const std::string& attribute) {
    const size_t opens = attribute.find_first_of("\"'");
    std::string value = attribute.substr(opens + 1, attribute.size() - opens - 2);
    static const std::vector<std::string> kValues = {
        "",         "x",     "nan",      "inf", "1e400", "-1", "0", "0 0 0", "1 2", "true", "auto", "1 2 3 4 5 6 7 8",
        "-1 -1 -1", "1,2,3", "999999999"};
    if (below(3) == 0) {
      value += " 1";
    } else if (below(3) == 0 && !value.empty()) {
      value.erase(below(value.size()), 1);
    } else {
      value = kValues[below(kValues.size())];
    }
    return attribute.substr(0, opens + 1) + value + attribute.back();
  }

  static std::string utf16(const std::string& text) {
    std::string wide = "\xff\xfe";
    for (const char c : text) {
      wide += c;
      wide += '\0';
    }
    return wide;
  }

  std::mt19937 random_;
};

// Words of parsers and compilers.
bool is_raw(const std::string& message) {
  static const std::regex kRaw(
      "XML_ERROR|ErrorID|Error[:=]|Element '|Element name|mjMIN|mj[u_]_|libc\\+\\+|std::|\\(?id =|Schema|ParseXML|line "
      "0|terminat");
  return std::regex_search(message, kRaw) || message.find('\n') != std::string::npos;
}

// A robot with what URDF files of people have.
constexpr const char* kMutatedRobot = R"(<?xml version="1.0"?>
<robot name="walker">
  <mujoco><compiler balanceinertia="false"/></mujoco>
  <material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>
  <link name="base">
    <inertial><origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="5"/>
      <inertia ixx="0.2" ixy="0.001" ixz="0" iyy="0.3" iyz="0" izz="0.4"/></inertial>
    <visual><geometry><box size="0.4 0.3 0.2"/></geometry><material name="grey"/></visual>
    <collision><origin xyz="0 0 0.1"/><geometry><box size="0.4 0.3 0.2"/></geometry></collision>
  </link>
  <link name="thigh">
    <inertial><origin xyz="0 0 -0.1"/><mass value="1"/>
      <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.01"/></inertial>
    <collision><origin xyz="0 0 -0.1"/><geometry><capsule radius="0.04" length="0.2"/></geometry></collision>
  </link>
  <link name="shin">
    <inertial><origin xyz="0 0 -0.1"/><mass value="0.5"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.002"/></inertial>
    <collision><origin xyz="0 0 -0.2"/><geometry><sphere radius="0.03"/></geometry></collision>
  </link>
  <link name="finger">
    <inertial><mass value="0.1"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
    <collision><geometry><cylinder radius="0.01" length="0.05"/></geometry></collision>
  </link>
  <link name="tool"/>
  <joint name="hip" type="revolute">
    <parent link="base"/><child link="thigh"/><origin xyz="0.1 0 0" rpy="0 0.1 0"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="40" velocity="5"/><dynamics damping="0.1" friction="0.01"/>
  </joint>
  <joint name="knee" type="continuous">
    <parent link="thigh"/><child link="shin"/><origin xyz="0 0 -0.2"/><axis xyz="0 1 0"/>
  </joint>
  <joint name="grip" type="prismatic">
    <parent link="base"/><child link="finger"/><axis xyz="1 0 0"/><limit lower="0" upper="0.05" effort="5" velocity="1"/>
    <mimic joint="hip" multiplier="0.02" offset="0"/>
  </joint>
  <joint name="tool_mount" type="fixed"><parent link="shin"/><child link="tool"/><origin xyz="0 0 -0.2"/></joint>
</robot>
)";

// A robot with what SDF files of people have.
constexpr const char* kMutatedSdf = R"(<?xml version="1.0"?>
<sdf version="1.9">
  <model name="walker" canonical_link="base">
    <link name="base">
      <pose relative_to="__model__">0 0 0.5 0 0 0</pose>
      <inertial><mass>5</mass><inertia><ixx>0.2</ixx><iyy>0.3</iyy><izz>0.4</izz></inertia></inertial>
      <collision name="trunk"><geometry><box><size>0.4 0.3 0.2</size></box></geometry></collision>
    </link>
    <frame name="hip_frame" attached_to="base"><pose degrees="true">0.1 0 0 0 5 0</pose></frame>
    <link name="thigh">
      <pose relative_to="hip"/>
      <inertial auto="true"/>
      <collision name="tube"><geometry><capsule><radius>0.04</radius><length>0.2</length></capsule></geometry></collision>
    </link>
    <link name="shin"><pose relative_to="knee"/></link>
    <joint name="hip" type="revolute">
      <pose relative_to="hip_frame"/><parent>base</parent><child>thigh</child>
      <axis><xyz expressed_in="base">0 1 0</xyz><limit><lower>-1</lower><upper>1</upper><effort>40</effort></limit></axis>
    </joint>
    <joint name="knee" type="universal">
      <pose relative_to="thigh">0 0 -0.2 0 0 0</pose><parent>thigh</parent><child>shin</child>
      <axis><xyz>0 1 0</xyz></axis><axis2><xyz>1 0 0</xyz><mimic joint="hip" axis="axis"/></axis2>
    </joint>
  </model>
</sdf>
)";

bool same(const Problem& a, const Problem& b) {
  return a.element == b.element && a.line == b.line && a.message == b.message;
}

// Whether a switch that refusals name takes them away: none of them comes again with it.
void expect_the_switch_works(const LoadReport& report, const std::string& text, const char* name,
                             const LoadOptions& options, const std::string& which) {
  const auto names_it = [&](const Problem& problem) {
    return problem.severity == Severity::kRefused && (problem.mend + problem.option).find(name) != std::string::npos;
  };
  if (std::ranges::none_of(report.problems, names_it)) return;
  const LoadReport again = inspect_model_text(text, "robot", options);
  for (const Problem& problem : report.problems) {
    if (!names_it(problem)) continue;
    const bool stays = std::ranges::any_of(again.problems, [&](const Problem& other) {
      return other.severity == Severity::kRefused && same(problem, other);
    });
    EXPECT_FALSE(stays) << which << ", with " << name << ": " << problem_text(problem);
  }
}

void try_mutations(const std::vector<std::string>& texts) {
  const int seed = setting("ASSAY_MUTATIONS_SEED", 1), count = setting("ASSAY_MUTATIONS", 500);
  const bool loud = std::getenv("ASSAY_MUTATIONS") != nullptr;
  int refused = 0;
  for (int i = 0; i < count; ++i) {
    Mutator mutator(static_cast<unsigned>(seed + i));
    std::string text = texts[static_cast<size_t>(i) % texts.size()];
    std::string what;
    while (what.empty()) what = mutator.mutate(text);
    const std::string which = fmt::format("seed {}, {}", seed + i, what);
    const LoadReport report = inspect_model_text(text, "robot");
    if (report.refused()) ++refused;
    for (const Problem& problem : report.problems) {
      const std::string words = problem_text(problem);
      if (loud) fmt::print("{}: {}\n", which, words);
      EXPECT_FALSE(is_raw(words)) << which << ": " << words;
      if (problem.severity != Severity::kRefused) continue;
      EXPECT_TRUE(!problem.mend.empty() || !problem.option.empty()) << which << ": " << words;
    }
    if (report.model) {
      for (const std::string& note : report.model->notes) EXPECT_FALSE(is_raw(note)) << note;
    }
    expect_the_switch_works(report, text, "--drop-unsupported", {.drop_unsupported = true}, which);
    expect_the_switch_works(report, text, "--repair", {.repair = true}, which);
  }
  EXPECT_GT(refused, count / 3) << "the mutations hardly harm";
}

TEST(Mutations, OfFilesAreRefusedInOurWords) {
  std::vector<std::string> texts;
  for (const char* name : {"humanoid.xml", "grasp.xml", "planar-chain.xml", "finger.xml", "astronaut.xml"}) {
    texts.push_back(content(fs::path(ASSAY_MODELS) / name));
    ASSERT_FALSE(texts.back().empty()) << name;
  }
  try_mutations(texts);
}

TEST(Mutations, OfUrdfFilesAreRefusedInOurWords) {
  ASSERT_TRUE(inspect_model_text(kMutatedRobot, "robot").model) << "the file is valid before";
  try_mutations({kMutatedRobot});
}

TEST(Mutations, OfSdfFilesAreRefusedInOurWords) {
  ASSERT_TRUE(inspect_model_text(kMutatedSdf, "robot").model) << "the file is valid before";
  try_mutations({kMutatedSdf});
}

}  // namespace
}  // namespace assay
