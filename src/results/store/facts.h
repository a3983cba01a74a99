// Facts that a results directory keeps as JSON text. Whoever made it may have written anything: what is not there, or
// is of another type than assay writes, counts as absent.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace assay {

// The manifest's entry with the version of the rules of soundness that judged the cells (measures/plausible.h). Older
// results have none; a directory that an older program began keeps its own.
inline constexpr const char* kSoundnessEntry = "soundness_rules";

// An object; an empty one for a text that is none.
inline nlohmann::json facts_of(const std::string& text) {
  nlohmann::json facts = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  return facts.is_object() ? facts : nlohmann::json::object();
}

inline std::string text_fact(const nlohmann::json& facts, const char* name, const std::string& otherwise = "") {
  const auto found = facts.find(name);
  return found != facts.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

inline double number_fact(const nlohmann::json& facts, const char* name, double otherwise = 0) {
  const auto found = facts.find(name);
  return found != facts.end() && found->is_number() ? found->get<double>() : otherwise;
}

}  // namespace assay
