// What keeps a model file from having its full meaning in the neutral Model, all of it at once.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/model.h"

namespace assay {

enum class Severity {
  kRefused,  // the file cannot be used as it is
  kLeftOut,  // a switch was given, so this part is left out or simplified; `message` says what that changes
};

struct Problem {
  Severity severity = Severity::kRefused;
  std::string element = {};  // "joint 'knee'", "a geom of body 'foot'"; empty for the file as a whole
  int line = 0;              // of the file; 0 when it is not known
  std::string file = {};  // the included file that has the line, as the <include> writes it; empty for the file itself
  std::string message = {};  // what is wrong, following on the element: "has a dry friction that is negative"
  std::string mend = {};     // what the user can do: "make it positive"; may be empty
  std::string option = {};   // the switch that accepts the file, with what it costs: "--drop-unsupported"; may be empty
};

// "line 12", "parts/leg.xml, line 12"; empty where no line is known.
std::string place_text(const std::string& file, int line);

// One sentence: "joint 'knee' (line 12) has ...; make it ..., or give --drop-unsupported".
std::string problem_text(const Problem& problem);

// `model` is there if and only if no problem is kRefused.
struct LoadReport {
  std::optional<Model> model;
  std::vector<Problem> problems;

  bool refused() const;
  // Adds a problem of the file as a whole that refuses it.
  void refuse(std::string message, std::string mend = {});
};

}  // namespace assay
