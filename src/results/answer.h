// The answer to a question within limits in words: what `assay recommend` and `assay run ROBOT` print, and what the
// report's page shows.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "results/limits.h"
#include "results/recommend.h"

namespace assay {

// ---- parts ------------------------------------------------------------------------------------------------------------

struct AnswerLine {
  std::string label, text;  // "margin", "sound up to 4 ms"; the label is "" for a sentence
  size_t gap = 0;           // spaces between the two on a terminal

  std::string printed() const { return (label.empty() ? "" : label + ":") + std::string(gap, ' ') + text; }
};

struct AnswerPart {
  std::string heading;
  bool evidence = false;  // what the answer rests on; else it is part of the answer itself
  std::vector<AnswerLine> lines = {};
  std::vector<std::string> columns = {};
  std::vector<std::vector<std::string>> rows = {};
  std::vector<size_t> right = {};  // columns of numbers
};

class Answer {
 public:
  // Begins a part; lines and a table go to the last one.
  void part(const std::string& heading, bool evidence = false) { parts_.push_back({heading, evidence}); }
  void line(const std::string& text) { parts_.back().lines.push_back({"", text}); }
  void line(AnswerLine line) { parts_.back().lines.push_back(std::move(line)); }
  void fact(const std::string& label, const std::string& text) { line({label, text, 2}); }
  void remark(const std::string& label, const std::string& text) { line({label, text, 1}); }
  // Columns in `right` hold numbers.
  void table(std::vector<std::string> headings, std::vector<std::vector<std::string>> rows,
             std::vector<size_t> right = {});

  const std::vector<AnswerPart>& parts() const { return parts_; }

 private:
  std::vector<AnswerPart> parts_;
};

// [{"heading", "evidence", "lines": [{"label", "text"}], "columns": [text], "rows": [[text]], "right": [column]}]
nlohmann::ordered_json parts_json(const std::vector<AnswerPart>& parts);

// The manifest's entry with the answer of `assay run ROBOT`, in the form of parts_json(); an empty list for a text that
// is none. In results of earlier versions lines are texts, and nothing is "evidence": only there labels and evidence
// are read from the words.
inline constexpr const char* kAnswerEntry = "answer";
nlohmann::json stored_answer(const std::string& entry);

// ---- sentences --------------------------------------------------------------------------------------------------------

// A sentence that depends on the limits, its places in braces filled with `words`. phrases_json() has all of them by
// name, for the report's page, which fills the same.
std::string phrase(std::string_view name, const std::vector<std::pair<std::string_view, std::string>>& words = {});
nlohmann::json phrases_json();

// "the largest timestep tried": where a candidate lies at an edge of what was tried, timed or measured, within which a
// better one may lie; "" elsewhere.
std::string edge_text(const Edge& edge);
// The sign of it behind a timestep in tables, " +", " -" or " ±", and what the signs of a table mean.
std::string edge_mark(const Edge& edge);
std::vector<std::string> mark_lines(const std::vector<Edge>& edges);
// A candidate that is named as an answer: "fast at 4 ms, 120× real time, the largest timestep tried".
std::string answering_text(const SystemAnswers& answers, size_t candidate, const Limits& limits);

// What depends on the candidate alone.
std::string place_text(const Point& point);  // "mujoco-euler at 4 ms"
std::string places_text(const SystemAnswers& answers, const std::vector<size_t>& candidates);
std::string speed_text(const Candidate& candidate);                   // "251 (249 to 252), timed at this timestep"
std::string held_text(const Interval& held);                          // of a grasp
std::string worst_text(const Worst& worst, const std::string& unit);  // "<= 3 µm" for an upper bound
// With its interval, and where it is from if not from `timestep_ms`.
std::string worst_line(const Worst& worst, const std::string& unit, double timestep_ms);

// Errors that stand in the table of contenders besides those that are limited: an error of a motion with contacts says
// little without how deep the contacts give way, and whether they push back, because a soft one is easy to repeat.
std::vector<ValueInfo> errors_besides(const SystemAnswers& answers);
inline constexpr size_t kMostErrors = 3;  // of the limited ones: columns that fit

// A limit of one of the first errors leaves the last one open.
struct NotAccuracy {
  std::vector<std::string> limited;  // "consistency"
  std::string open;                  // "truth_error_max"; "" where it was not measured
};
NotAccuracy not_accuracy(const SystemAnswers& answers);

// ---- answers ----------------------------------------------------------------------------------------------------------

// Parts with the best point, its limits, speed, errors, margin and what is not told apart from it, and each contender's
// own best. There has to be a best.
void add_best(const SystemAnswers& answers, const Question& question, const Recommendation& found, Answer& answer);

// What is to be relaxed, each limit alone, and what then answers; where that is not enough the point that misses the
// limits by the least, by how much, and what was not measured there. In one sentence.
std::string nearest_text(const SystemAnswers& answers, const Question& question, const Recommendation& found);

// What is left out, by contender and reason.
struct LeftOutPoints {
  std::string contender, why;
  std::vector<double> timesteps_ms = {};
  bool fails = false;  // at the first of them, which is why no larger one counts

  std::string when() const;  // "from 4 ms", "at 1/4, 1/2 ms"
};
// What is no candidate whatever the limits.
std::vector<LeftOutPoints> excluded_groups(const SystemAnswers& answers);
// And what is outside of these limits; by contender.
std::vector<LeftOutPoints> left_out(const SystemAnswers& answers, const Question& question,
                                    const Recommendation& found);
// A part that says so, if there is anything.
void add_left_out(const SystemAnswers& answers, const Question& question, const Recommendation& found, Answer& answer);

// A part with what stands for values that are limited and that the results lack, if anything does.
std::vector<std::string> grounds(const SystemAnswers& answers, const Question& question);
void add_grounds(const SystemAnswers& answers, const Question& question, Answer& answer);

// The whole answer where there is a best, and the sentence where there is none.
Answer best_answer(const SystemAnswers& answers, const Question& question, const Recommendation& found);
std::string none_text(const SystemAnswers& answers, const Question& question, const Recommendation& found);

// All of it as `assay recommend --json` prints it.
nlohmann::ordered_json recommendation_json(const SystemAnswers& answers, const Question& question,
                                           const Recommendation& found);

}  // namespace assay
