#include "results/values.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "measures/measure.h"

namespace assay {

std::vector<std::string> values_not_given(std::string_view contact_forces) {
  if (contact_forces == "none") {
    return {"contact_depth", "signorini_residual", "cone_violation", "dissipation_residual"};
  }
  if (contact_forces == "normal") return {"cone_violation", "dissipation_residual"};
  return {};
}

std::string_view better_text(Better better) {
  constexpr std::array<std::string_view, 3> kTexts = {"low", "high", "none"};
  return kTexts.at(static_cast<size_t>(better));
}

const std::vector<ValueInfo>& value_catalogue() {
  static const std::vector<ValueInfo> kRows = [] {
    std::vector<ValueInfo> rows;
    for (const Measure& measure : measures()) rows.insert(rows.end(), measure.values.begin(), measure.values.end());
    std::ranges::stable_sort(rows, {}, &ValueInfo::place);
    return rows;
  }();
  return kRows;
}

std::string_view time_of(std::string_view measure) {
  const Measure* of = measure_of(measure);
  return of == nullptr ? "" : of->time;
}

const ValueInfo* find_value_info(std::string_view name) {
  const auto& rows = value_catalogue();
  const auto found = std::ranges::find(rows, name, &ValueInfo::name);
  return found == rows.end() ? nullptr : &*found;
}

bool can_limit(std::string_view name) { return value_info(name).limit; }

ValueInfo value_info(std::string_view name) {
  if (const ValueInfo* row = find_value_info(name)) return *row;
  // The self-consistency error of pieces of another length: "consistency_8ms", "consistency_cold_share_8ms".
  constexpr std::string_view kUnit = "ms";
  const size_t before = name.rfind('_');
  const ValueInfo* of_pieces = before == std::string_view::npos ? nullptr : find_value_info(name.substr(0, before));
  if (of_pieces != nullptr && reads(of_pieces->measure, Reads::kPieces) && name.ends_with(kUnit) &&
      std::isdigit(static_cast<unsigned char>(name[before + 1])) != 0) {
    const std::string length(name.substr(before + 1, name.size() - before - 1 - kUnit.size()));
    ValueInfo info = *of_pieces;
    info.name = name;
    info.label += ", pieces of " + length + " ms";
    info.brief += ", pieces of " + length + " ms";
    return info;
  }
  std::string words(name);
  std::ranges::replace(words, '_', ' ');
  ValueInfo info;
  info.name = name;
  info.label = info.brief = info.meaning = words;
  if (!words.empty()) info.label[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  return info;
}

std::string value_named(std::string_view name) {
  const auto& rows = value_catalogue();
  for (const auto key : {&ValueInfo::name, &ValueInfo::measure}) {
    const auto found = std::ranges::find(rows, name, key);
    if (found != rows.end()) return found->name;
  }
  return "";
}

std::string value_named(std::string_view name, const std::vector<ValueInfo>& measured) {
  if (find_value_info(name) == nullptr) {
    for (const ValueInfo& row : value_catalogue()) {
      if (row.measure == name && std::ranges::find(measured, row.name, &ValueInfo::name) != measured.end()) {
        return row.name;
      }
    }
  }
  return value_named(name);
}

const std::vector<Term>& glossary() {
  static const std::vector<Term> kTerms = {
#include "glossary.inc"
  };
  return kTerms;
}

}  // namespace assay
