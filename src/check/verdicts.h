// What engines do with a model, element by element: the second half of `assay check`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "check/step_bounds.h"
#include "engines/facts.h"
#include "load/file_facts.h"

namespace assay {

// One engine's contenders that treat the model alike.
struct EngineVerdict {
  std::string engine;
  std::vector<std::string> contenders;
  std::vector<Limitation> limitations;  // nothing of kind kExact
  std::vector<Fidelity> of_element;     // in the order of elements_of()
  bool as_a_whole = false;              // a limitation is about the contender as a whole: its elements say little

  Fidelity worst() const;
  std::string count(Fidelity fidelity) const;  // of limitations; empty for none
};

// One element of the model in one respect.
struct ModelElement {
  std::string sort;   // "hinge", "joint limit", "mesh": elements of one sort are shown together
  std::string label;  // "joint 'knee'", as in FileFacts::lines; of contact pairs as PairGroups has it
  std::optional<Feature> feature = {};
  size_t count = 1;  // of a group of contact pairs
};

// Every element in every respect, sorted by sort as engines meet them.
std::vector<ModelElement> elements_of(const Model& model);

// `bounds` are the model's.
std::vector<EngineVerdict> verdicts_on(const Model& model, const std::vector<ModelElement>& elements,
                                       const StepBounds& bounds);

// The text of a JSON array, as print_json() writes one at this indentation. A robot with thousands of joints has
// hundreds of thousands of limitations: as Json they take longer than all else. Many that are alike are one entry.
std::string verdicts_json_text(const std::vector<EngineVerdict>& verdicts, const FileFacts& facts, const Model& model,
                               int depth);
Json elements_json(const std::vector<EngineVerdict>& verdicts, const std::vector<ModelElement>& elements,
                   const FileFacts& facts);

// The verdicts, the elements that engines treat alike, and how.
std::string verdicts_text(const std::vector<EngineVerdict>& verdicts);
std::string elements_table(const std::vector<EngineVerdict>& verdicts, const std::vector<ModelElement>& elements,
                           const FileFacts& facts);
std::string statements_text(const std::vector<EngineVerdict>& verdicts, const Model& model);

}  // namespace assay
