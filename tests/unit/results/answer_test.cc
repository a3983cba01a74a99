// Answers within limits in words.
#include "results/answer.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "answers/cases.h"
#include "results/results.h"
#include "temp_folder.h"

namespace assay {
namespace {

using nlohmann::json;

std::string joined(const AnswerLine& line) { return line.label.empty() ? line.text : line.label + ": " + line.text; }

// {"heading", "lines", "columns", "rows"} or {"none"}, "grounds" and "left_out".
json in_words(const SystemAnswers& answers, const Question& question) {
  const Recommendation found = recommend(answers, question.limits);
  json words = json::object();
  if (found.best) {
    Answer answer;
    add_best(answers, question, found, answer);
    const AnswerPart &best = answer.parts().at(0), &each = answer.parts().at(1);
    words = {{"heading", best.heading}, {"lines", json::array()}, {"columns", each.columns}, {"rows", each.rows}};
    for (const AnswerLine& line : best.lines) words["lines"].push_back(joined(line));
    for (const AnswerLine& line : each.lines) words["lines"].push_back(joined(line));
  } else {
    words = {{"none", none_text(answers, question, found)}};
  }
  words["grounds"] = grounds(answers, question);
  words["left_out"] = json::array();
  for (const LeftOutPoints& group : left_out(answers, question, found)) {
    words["left_out"].push_back({group.contender, group.when(), group.why});
  }
  return words;
}

// The limits are all there are: the page's picker shows every one of a question.
LimitOptions without_usual(const std::vector<std::string>& limits) {
  LimitOptions options;
  const auto has = [&](const char* option) {
    return std::ranges::any_of(
        limits, [&](const std::string& limit) { return usual_option(limit.substr(0, limit.find('='))) == option; });
  };
  if (!has("penetration")) options.penetration = kAnyQuantity;
  if (!has("slip")) options.slip = kAnyQuantity;
  return options;
}

class AnswerTest : public TempFolderTest {};

// tests/browser/answers.test.mjs asks the report's page the same.
TEST_F(AnswerTest, EveryCaseIsAnsweredInTheseWords) {
  const json cases = answer_cases();
  Store store = Store::create(dir_, {"test", "1"});
  put_answer_cases(store, cases);
  const Results results(store);
  ASSERT_GE(cases.at("questions").size(), 20U);
  for (const json& each : cases.at("questions")) {
    const SystemAnswers answers = answers_of(results, each.value("system", kCasesSystem));
    LimitOptions options;
    if (!each.value("usual", false)) options = without_usual(each.at("limits"));
    options.limits = each.at("limits").get<std::vector<std::string>>();
    if (each.at("realtime").is_string()) options.realtime = each["realtime"].get<std::string>();
    const json words = in_words(answers, question_of(options, answers));
    EXPECT_EQ(words, each.at("expected")) << each.at("name") << "\n" << words.dump();
  }
}

TEST_F(AnswerTest, AStoredAnswerIsReadAsItWasGiven) {
  Answer answer;
  answer.part("arm: fast at 4 ms, 120× real time");
  answer.fact("asked", "error within 1mm");
  answer.remark("margin", "sound up to 4 ms: the largest measured");
  answer.part("What fast approximates in this robot", /*evidence=*/true);
  answer.line("nothing: it carries over the whole model");
  EXPECT_EQ(stored_answer(parts_json(answer.parts()).dump()), json(parts_json(answer.parts())));
  EXPECT_EQ(stored_answer("no JSON"), json::array());
  EXPECT_EQ(stored_answer(R"([{"heading": 1}])"), json::array());
}

TEST_F(AnswerTest, AnAnswerOfAnEarlierVersionHasItsLabelsInItsLines) {
  const json parts = stored_answer(
      R"([{"heading": "arm: fast at 4 ms", "lines": ["asked:  error within 1mm", "a sentence. With: a colon"]},
          {"heading": "What fast approximates", "lines": []}, {"heading": "How sure", "lines": []}])");
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_EQ(parts[0]["lines"], json::parse(R"([{"label": "asked", "text": "error within 1mm"},
                                               {"label": "", "text": "a sentence. With: a colon"}])"));
  EXPECT_FALSE(parts[0]["evidence"].get<bool>());
  EXPECT_TRUE(parts[1]["evidence"].get<bool>());
  EXPECT_TRUE(parts[2]["evidence"].get<bool>());
}

}  // namespace
}  // namespace assay
